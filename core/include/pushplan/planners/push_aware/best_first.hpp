// Best-first search over driven arcs whose nodes carry the objects that they have pushed.
//
// A hybrid-state A* (Dolgov, Thrun, Montemerlo and Diebel, "Path Planning for Autonomous Vehicles
// in Unknown Semi-structured Environments", 2010) whose nodes hold, besides the pose, where the
// objects are by then, as in PAMO* (Ren et al., arXiv 2410.18333). An edge costs m0 times its
// length plus w times the interaction work of driving it, which the interaction model tells. An
// edge that moves nothing shares the objects of its parent, so that objects at rest cost neither
// time nor memory. Edges are driven only when they come first in the queue (Cohen, Phillips and
// Likhachev, "Planning Single-arm Manipulations with N-arm Robots", 2014: lazy weighted A*); until
// then they count as if they pushed nothing.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "pushplan/arithmetic.hpp"
#include "pushplan/planners/push_aware/cost_to_go.hpp"
#include "pushplan/planners/push_aware/push_tree.hpp"
#include "pushplan/search/astar.hpp"

namespace pushplan {

/// Parameters of the expansion of nodes.
struct Branching {
  std::span<const double> curvatures;  // (C,) [1/m]
  double length;                       // of an edge [m]
  double inflation;                    // of the heuristic, in the order of the queue
  double pruning_factor;  // on the length that is left, where a node is given up for its cost
  std::span<const double> masses;  // (K,) of the objects as the search weighs them [kg]
};

/// Poses and pushed objects, as a lattice for `AStar` whose nodes are made as it goes. Node k of
/// the tree has two numbers there: 2 k is its arc as guessed, whose only successor is 2 k + 1, the
/// arc as driven; from that the next arcs branch. The root is 1.
template <InteractionModel M>
class PushLattice {
 public:
  PushLattice(PushTree& tree, const CostToGo& table, const Branching& branching,
              double bound,  // cost above which nodes are of no use [kg m]
              const PathProblem& problem, M& model)
      : tree_(&tree),
        table_(table),
        branching_(branching),
        bound_(bound),
        rollout_(problem, model) {}

  template <class Visit>
  void expand(Index number, Visit&& visit);

  /// The estimated cost to go; the arc of a guess is paid when it is driven.
  double estimate(Index number) const {
    const PushTree::Node& node = (*tree_)[number >> 1];
    const PushTree::Node& paid = number % 2 == 0 ? (*tree_)[node.parent] : node;
    return node.estimate - paid.cost;
  }

  /// True for driven nodes in the goal.
  bool is_goal(Index number) const {
    return number % 2 == 1 && in_goal((*tree_)[number >> 1].pose);
  }

 private:
  const PathProblem& problem() const { return rollout_.problem(); }
  bool in_goal(const Pose& pose) const { return problem().goal.contains({pose.x, pose.y}); }

  Index cell_of(const Pose& pose) const;
  bool settle(PushTree::Node& node, double length);
  bool drive_to(PushTree::Node& node);
  template <class Visit>
  void branch(Index node, Visit& visit);

  PushTree* tree_;
  CostToGo table_;
  Branching branching_;
  double bound_;
  ArcRollout<M> rollout_;
};

// ----------------------------------------------------------------------------

template <InteractionModel M>
Index PushLattice<M>::cell_of(const Pose& pose) const {
  const PushTree::CellShape& shape = tree_->cells();
  const Index place = table_.row_of(pose.y) * shape.columns + table_.column_of(pose.x);
  return place * shape.headings + table_.heading_of(pose.theta);
}

/// Writes down what a node really costs. False if its cell has a cheaper one.
template <InteractionModel M>
bool PushLattice<M>::settle(PushTree::Node& node, double length) {
  PushTree& tree = *tree_;
  const PushTree::Node& parent = tree[node.parent];
  const auto moved = rollout_.moved();
  double work = 0.0;
  for (std::size_t k = 0; k < moved.size(); ++k) work += moved[k] * branching_.masses[k];
  const double priced = length * problem().price.factor({node.pose.x, node.pose.y});
  const double cost = parent.cost + problem().robot_mass * priced + problem().push_weight * work;
  const bool goal = in_goal(node.pose);
  if (!goal) {
    double& best = tree.best(cell_of(node.pose));
    if (cost >= best) return false;
    best = cost;
  }
  node.row = work > 0.0 ? tree.add_objects(rollout_.objects()) : parent.row;
  // only work, a price and a shorter arc change what was guessed
  node.estimate += std::max(cost - node.cost, 0.0);
  if (goal) node.estimate = std::max(cost, parent.estimate);
  node.cost = cost;
  node.arc.length = length;
  return true;
}

/// Drives a node's arc. False if that leads nowhere, or memory is full.
template <InteractionModel M>
bool PushLattice<M>::drive_to(PushTree::Node& node) {
  ++tree_->driven;
  if (!tree_->has_room_for_objects()) {
    tree_->full = true;
    return false;
  }
  const double length = tree_->drive(node, rollout_);
  return length != 0.0 && settle(node, length) && node.cost < bound_;
}

template <InteractionModel M>
template <class Visit>
void PushLattice<M>::expand(Index number, Visit&& visit) {
  PushTree& tree = *tree_;
  const Index at = number >> 1;
  PushTree::Node& node = tree[at];
  if (number % 2 == 0) {
    if (drive_to(node)) visit(number + 1, node.cost - tree[node.parent].cost, Index{0});
    return;
  }
  if (!tree.has_room(static_cast<Index>(branching_.curvatures.size()))) {
    tree.full = true;
    return;
  }
  if (node.parent >= 0) {
    const double best = tree.best(cell_of(node.pose));
    if (node.cost > best * (1.0 + 1e-12)) return;  // a cheaper node has taken its cell since
  }
  branch(at, visit);
}

/// Lists the arcs that leave a node, as if they pushed nothing.
template <InteractionModel M>
template <class Visit>
void PushLattice<M>::branch(Index at, Visit& visit) {
  PushTree& tree = *tree_;
  const PushTree::Node& node = tree[at];
  const double mass = problem().robot_mass;
  const double length = branching_.length;
  const double cost = node.cost + mass * length;
  for (const double curvature : branching_.curvatures) {
    PushTree::Node& next = tree.spare();
    next.pose = along_arc(node.pose, {length, curvature});
    double left = 0.0;
    if (!in_goal(next.pose)) {
      left = table_.length_to_go(next.pose);
      if (cost >= tree.best(cell_of(next.pose))) continue;
    }
    if (!(cost + branching_.pruning_factor * mass * left < bound_)) continue;
    next.cost = cost;
    next.estimate = std::max(cost + branching_.inflation * mass * left, node.estimate);
    next.parent = at;
    next.arc = {length, curvature};
    next.row = PushTree::kNone;
    visit(2 * tree.keep(), 0.0, Index{0});
  }
}

}  // namespace pushplan
