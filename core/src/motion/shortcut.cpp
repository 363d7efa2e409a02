#include "pushplan/motion/shortcut.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

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

Index copy_rest(const Path& path, Index last, const PathBuffer& out, Index size) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
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
