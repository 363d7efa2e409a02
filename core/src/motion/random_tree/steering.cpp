#include "pushplan/motion/random_tree/steering.hpp"

#include <algorithm>
#include <cmath>

#include "pushplan/arithmetic.hpp"

namespace pushplan {
namespace {

constexpr int kSpread = 5;  // curvatures that are spread evenly

}  // namespace

/// Takes the point of an arc that misses the target by least, if it is nearer than `least` [m].
void Steering::try_arc(const Pose& start, const Pose& target, const Arc& arc, double& least,
                       SteeredArc& best) {
  const Index steps = ceil_index(std::abs(arc.length) / step_along(arc.curvature, limits_.spacing));
  for (Index step = 1; step <= steps; ++step) {
    const double length = arc.length * static_cast<double>(step) / static_cast<double>(steps);
    const Pose pose = along_arc(start, {length, arc.curvature});
    if (!checker_.is_free(pose)) return;
    const double turn = std::abs(wrap_below_pi(pose.theta - target.theta));
    const double dx = pose.x - target.x;
    const double dy = pose.y - target.y;
    double miss = std::sqrt(dx * dx + dy * dy);
    miss += limits_.turn_weight * turn;
    if (miss < least) {
      least = miss;
      best = {{length, arc.curvature}, pose};
    }
  }
}

SteeredArc Steering::steer(const Pose& start, const Pose& target, double sampled, double backward) {
  const double bound = limits_.max_curvature;
  const double dx = target.x - start.x;
  const double dy = target.y - start.y;
  const double side = -std::sin(start.theta) * dx + std::cos(start.theta) * dy;
  // the circle through both that is tangent to the start
  const double aimed = 2.0 * side / std::max(dx * dx + dy * dy, 1e-12);
  double least = kInfinity;
  SteeredArc best{{0.0, 0.0}, start};
  const auto try_all = [&](double length) {
    try_arc(start, target, {length, sampled}, least, best);
    try_arc(start, target, {length, std::min(std::max(aimed, -bound), bound)}, least, best);
    for (int i = 0; i < kSpread; ++i) {
      try_arc(start, target, {length, bound * (0.5 * static_cast<double>(i) - 1.0)}, least, best);
    }
  };
  try_all(limits_.edge_length);
  if (backward > 0.0) try_all(-std::min(limits_.edge_length, backward));
  return best;
}

}  // namespace pushplan
