#include "pushplan/planners/ship_predictive/arcs.hpp"

#include <cmath>
#include <limits>

namespace pushplan {

Index steer_on(const IceCostToGo& costs, const Pose& start, std::span<const double> curvatures,
               double step, std::span<ArcPose> out) {
  const double goal = costs.goal();
  Pose here = start;
  for (std::size_t n = 0; n < out.size(); ++n) {
    if (here.y >= goal) return static_cast<Index>(n);
    double least = std::numeric_limits<double>::infinity();
    ArcPose chosen{here, curvatures[0]};
    for (const double curvature : curvatures) {
      const double middle = here.theta + 0.5 * curvature * step;
      const Pose next{here.x + step * std::cos(middle), here.y + step * std::sin(middle),
                      here.theta + curvature * step};
      double cost = step * (costs.mass + costs.weight * costs.mass_ahead(next));
      cost += costs.cost_to_go(next);
      cost += 1e-7 * costs.mass * step * std::abs(curvature) * costs.radius;  // a tie-break
      if (cost < least) {
        least = cost;
        chosen = {next, curvature};
      }
    }
    out[n] = chosen;
    here = chosen.pose;
  }
  return here.y >= goal ? static_cast<Index>(out.size()) : 0;
}

Index arc_ahead(const ShipChannel& channel, const Pose& start, double curvature, double step,
                std::span<ArcPose> out) {
  out[0] = {start, curvature};
  for (std::size_t n = 1; n < out.size(); ++n) {
    const auto steps = static_cast<double>(n);
    const double half = 0.5 * curvature * step * steps;
    const double chord = step * steps * (half != 0.0 ? std::sin(half) / half : 1.0);
    const Vec2 place{start.x + chord * std::cos(start.theta + half),
                     start.y + chord * std::sin(start.theta + half)};
    if (!channel.box.contains(place, 0.0)) return 0;
    out[n] = {{place.x, place.y, start.theta + 2.0 * half}, curvature};
    if (place.y >= channel.goal) return static_cast<Index>(n) + 1;
  }
  return static_cast<Index>(out.size());
}

CostAhead cost_ahead(const IceCostToGo& costs, std::span<const ArcPose> arc, double step) {
  double work = 0.0;
  for (const ArcPose& at : arc.subspan(1)) work += step * costs.mass_ahead(at.pose);
  return {work, costs.cost_to_go(arc.back().pose)};
}

}  // namespace pushplan
