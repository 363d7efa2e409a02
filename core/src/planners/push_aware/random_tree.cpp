#include "pushplan/planners/push_aware/random_tree.hpp"

#include <limits>

namespace pushplan {

Index nearest_node(const PushTree& tree, const GrowthTarget& target, const GrowthScales& scales,
                   double bound) {
  Index best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (Index i = 0; i < tree.count(); ++i) {
    const PushTree::Node& node = tree[i];
    if (node.cost >= bound) continue;
    const double dx = node.pose.x - target.pose.x;
    const double dy = node.pose.y - target.pose.y;
    const double turn = wrap_below_pi(node.pose.theta - target.pose.theta) / scales.radians;
    const double more = (node.cost - target.cost) / scales.cost;
    double gap = (dx * dx + dy * dy) / (scales.metres * scales.metres) + turn * turn;
    gap += more * more;
    if (gap < least) {
      best = i;
      least = gap;
    }
  }
  return best;
}

}  // namespace pushplan
