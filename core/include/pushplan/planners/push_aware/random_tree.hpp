// A random tree in the space of poses and costs, with the objects carried along.
//
// AO-RRT (Hauser and Zhou, "Asymptotically optimal planning by feasible kinodynamic planning in a
// state-cost space", arXiv 1505.04098; Kleinbort, Granados, Solovey, Bonalli, Bekris and Halperin,
// "Refined analysis of asymptotically-optimal kinodynamic planning in the state-cost space", 2020):
// targets are drawn uniformly from poses and costs, the node that is nearest in both is driven on
// with a random curvature over a random length, and what cannot become cheaper than the best plan
// is thrown away. Nothing in it depends on a table, a lattice or a coarse path. The best-first
// search is far quicker to good plans; this is what finds, in the end, any plan that it cannot
// represent.
#pragma once

#include <span>

#include "pushplan/planners/push_aware/push_tree.hpp"

namespace pushplan {

/// Random numbers of one arc, in [0, 1).
struct GrowthDraw {
  double x;
  double y;
  double heading;
  double cost;
  double curvature;
  double length;
};

/// What counts as one unit of distance between nodes.
struct GrowthScales {
  double metres;
  double radians;
  double cost;  // [kg m]
};

/// What a tree grows towards.
struct GrowthTarget {
  Pose pose;
  double cost;  // [kg m]
};

/// The node nearest to a target among those that cost less than a bound [kg m].
Index nearest_node(const PushTree& tree, const GrowthTarget& target, const GrowthScales& scales,
                   double bound);

struct Growth {
  enum class Status { kGoing, kFound, kFull };

  Status status;
  Index node;  // in the goal, if one was found
};

/// Adds a random arc for each draw, until one leads to the goal. `bound` is the cost that a plan
/// has to undercut [kg m], `longest` the longest arc [m].
template <InteractionModel M>
Growth grow(PushTree& tree, std::span<const GrowthDraw> draws, double bound, double longest,
            const GrowthScales& scales, const PathProblem& problem, M& model) {
  ArcRollout<M> rollout(problem, model);
  const Box& box = problem.walls.bounds;
  for (const GrowthDraw& draw : draws) {
    if (!tree.has_room(1) || !tree.has_room_for_objects()) return {Growth::Status::kFull, -1};
    const GrowthTarget target{
        {box.x_min + draw.x * (box.x_max - box.x_min), box.y_min + draw.y * (box.y_max - box.y_min),
         2.0 * std::numbers::pi * draw.heading},
        bound * draw.cost};
    PushTree::Node& node = tree.spare();
    node.parent = nearest_node(tree, target, scales, bound);
    const PushTree::Node& parent = tree[node.parent];
    node.arc = {longest * (1.0 - draw.length),
                (2.0 * draw.curvature - 1.0) / problem.turning_radius};
    node.pose = along_arc(parent.pose, node.arc);
    const double length = tree.drive(node, rollout);
    if (length == 0.0) continue;
    const double work = work_of(rollout.moved(), model.inverse_masses());
    const Vec2 place{node.pose.x, node.pose.y};
    const double priced = length * problem.price.factor(place);
    const double cost = parent.cost + problem.robot_mass * priced + problem.push_weight * work;
    if (!(cost + problem.robot_mass * problem.goal.distance(place) < bound)) continue;
    node.arc.length = length;
    node.cost = cost;
    node.row = work > 0.0 ? tree.add_objects(rollout.objects()) : parent.row;
    const Index added = tree.keep();
    if (problem.goal.contains(place)) return {Growth::Status::kFound, added};
  }
  return {Growth::Status::kGoing, -1};
}

}  // namespace pushplan
