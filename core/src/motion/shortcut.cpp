#include "pushplan/motion/shortcut.hpp"

#include <algorithm>
#include <cmath>

namespace pushplan {

Index copy_start(const Path& path, Index last, const PathBuffer& out) {
  std::copy_n(path.poses.begin(), last + 1, out.poses.begin());
  std::copy_n(path.curvatures.begin(), last + 1, out.curvatures.begin());
  return last + 1;
}

Index lay_dubins(const Pose& start, const Pose& end, const DubinsLimits& limits,
                 const PathBuffer& out) {
  const DubinsPath path = dubins(start, end, limits.radius);
  if (path.turn() > limits.most_turn) return -1;
  return sample_arcs(start, path.arcs, limits.spacing, out);
}

Index lay_straight(const Pose& start, const Pose& end, double spacing, const PathBuffer& out) {
  const double dx = end.x - start.x;
  const double dy = end.y - start.y;
  const double turn = wrap_below_pi(end.theta - start.theta);
  const double steps =
      std::ceil(std::max(std::sqrt(dx * dx + dy * dy) / spacing, std::abs(turn) / kMaxTurn));
  if (!(steps <= static_cast<double>(out.size()))) return -1;
  for (Index i = 0; i < static_cast<Index>(steps); ++i) {
    const double part = static_cast<double>(i + 1) / steps;
    out.poses[static_cast<std::size_t>(i)] = {start.x + part * dx, start.y + part * dy,
                                              start.theta + part * turn};
    out.curvatures[static_cast<std::size_t>(i)] = 0.0;
  }
  return static_cast<Index>(steps);
}

Index copy_rest(const Path& path, Index last, const PathBuffer& out, Index size) {
  const Index rest = path.size() - 1 - last;
  // the new piece may end with whole turns more or less than the old one
  const double difference = out.poses[static_cast<std::size_t>(size - 1)].theta -
                            path.poses[static_cast<std::size_t>(last)].theta;
  const double turns = std::rint(difference / kTurn);
  std::copy_n(path.poses.begin() + last + 1, rest, out.poses.begin() + size);
  std::copy_n(path.curvatures.begin() + last + 1, rest, out.curvatures.begin() + size);
  for (Index n = size; n < size + rest; ++n) {
    out.poses[static_cast<std::size_t>(n)].theta += kTurn * turns;
  }
  return size + rest;
}

}  // namespace pushplan
