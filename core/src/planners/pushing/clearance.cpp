#include "pushplan/planners/pushing/clearance.hpp"

#include "pushplan/geometry/convex.hpp"

namespace pushplan::pushing {
namespace {

constexpr double kSamples = 4.0;  // poses checked along one command
constexpr int kHalvings = 4;      // of the piece in which robot or box comes too near
// greatest rate at which a box nearer than the clearance may come nearer, per travel of the bumper:
// it is pushed along a wall, and lies against it in the end
constexpr double kGraze = 0.1;

}  // namespace

Clearance::Clearance(const Polygons& parts, std::span<const double> radii,
                     const ClearanceLimits& limits)
    : vertices_(parts.vertices.begin(), parts.vertices.end()),
      offsets_(parts.offsets.begin(), parts.offsets.end()),
      radii_(radii.begin(), radii.end()),
      limits_(limits),
      placed_(vertices_.size()) {}

/// The distance of a part at a pose [m], if it is less than the least so far.
double Clearance::gap_of(Index part, const Pose& pose, double least, const Obstacles& obstacles) {
  const Polygon body = parts()[part];
  transform(pose, body, placed_.data());
  const Polygon placed(placed_.data(), body.size());
  for (std::size_t k = 0; k < obstacles.radii.size(); ++k) {
    const Box& box = obstacles.boxes[k];
    const double dx = std::max(std::max(box.x_min - pose.x, pose.x - box.x_max), 0.0);
    const double dy = std::max(std::max(box.y_min - pose.y, pose.y - box.y_max), 0.0);
    if (std::sqrt(dx * dx + dy * dy) - radii_[static_cast<std::size_t>(part)] >= least) continue;
    const Polygon core = obstacles.cores[static_cast<Index>(k)];
    double gap = convex_distance(placed, core);
    if (gap <= 0.0) gap = -std::max(convex_penetration(placed, core).depth, 0.0);
    least = std::min(least, gap - obstacles.radii[k]);
  }
  return least;
}

Clearance::Gaps Clearance::gaps(const BoxContact& contact, double normal, const PushState& state,
                                const Obstacles& obstacles) {
  const Index last = parts().count() - 1;
  double robot = kInfinity;
  for (Index part = 0; part < last; ++part) robot = gap_of(part, state.robot, robot, obstacles);
  const Pose box = box_pose(contact, state);
  return {robot, gap_of(last, {box.x, box.y, box.theta - normal}, kInfinity, obstacles)};
}

double Clearance::free_fraction(const BoxContact& contact, double normal, const PushState& start,
                                const Twist& twist, double duration, const Obstacles& obstacles) {
  const Gaps now = gaps(contact, normal, start, obstacles);
  const double robot = std::min(limits_.least, now.robot - limits_.slack);
  const double box = std::min(limits_.least, now.box - limits_.slack);
  const double travel =
      (std::abs(twist.v) + std::abs(twist.w) * (contact.front + contact.depth)) * duration;
  // both keep their distances; a box near a wall may graze along it
  const auto is_clear = [&](const PushState& state, double travelled) {
    const Gaps here = gaps(contact, normal, state, obstacles);
    const double graze = box < limits_.least ? kGraze * travelled : 0.0;
    return here.robot >= robot && here.box >= box - graze;
  };
  PushState here = start;
  for (double i = 0.0; i < kSamples; i += 1.0) {
    PushState before = here;
    advance(contact, here, twist, duration / kSamples);
    if (is_clear(here, travel * (i + 1.0) / kSamples)) continue;
    double free = i / kSamples;
    double step = 0.5 / kSamples;
    for (int halving = 0; halving < kHalvings; ++halving) {
      here = before;
      advance(contact, here, twist, step * duration);
      if (is_clear(here, travel * (free + step))) {
        before = here;
        free += step;
      }
      step *= 0.5;
    }
    return free;
  }
  return 1.0;
}

}  // namespace pushplan::pushing
