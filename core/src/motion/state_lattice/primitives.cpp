#include "pushplan/motion/state_lattice/primitives.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace pushplan {

Index find_connections(double heading, double target, const ConnectionLimits& limits,
                       std::span<LatticeConnection> out) {
  const double most_turn = std::abs(wrap_angle(target - heading)) + limits.slack;
  const double c = std::cos(heading);
  const double s = std::sin(heading);
  const Pose start{0.0, 0.0, heading};
  const Index reach = limits.reach;
  std::size_t count = 0;
  for (Index x = -reach; x <= reach; ++x) {
    for (Index y = -reach; y <= reach; ++y) {
      const Vec2 end{static_cast<double>(x), static_cast<double>(y)};
      const double ahead = end.x * c + end.y * s;
      if (ahead <= 0.0 || x * x + y * y > reach * reach) continue;
      if (count == out.size()) return static_cast<Index>(count);
      const DubinsPath path = dubins(start, {end.x, end.y, target}, limits.radius);
      if (path.turn() > most_turn) continue;
      out[count++] = {path.length, end, path.arcs};
    }
  }
  return static_cast<Index>(count);
}

void primitive_boxes(std::span<const double> headings, std::span<const std::array<Arc, 3>> arcs,
                     std::span<const double> lengths, std::span<OriginBox> boxes) {
  constexpr std::size_t kPoses = 1000;  // room for what the spacing and the turns ask for
  constexpr double kSpacing = 0.02;     // between poses, in lengths of the primitive
  std::vector<Pose> poses(kPoses);
  std::vector<double> curvatures(kPoses);
  for (std::size_t p = 0; p < headings.size(); ++p) {
    OriginBox box{0.0, 0.0, 0.0, 0.0};
    const Index count =
        sample_arcs({0.0, 0.0, headings[p]}, arcs[p], kSpacing * lengths[p], {poses, curvatures});
    for (Index i = 0; i < count; ++i) {
      const Pose& pose = poses[static_cast<std::size_t>(i)];
      box.row_min = std::min(box.row_min, pose.x);
      box.row_max = std::max(box.row_max, pose.x);
      box.column_min = std::min(box.column_min, pose.y);
      box.column_max = std::max(box.column_max, pose.y);
    }
    boxes[p] = box;
  }
}

}  // namespace pushplan
