// A random tree of drivable arcs (LaValle and Kuffner, "Randomized kinodynamic planning", 2001).
#pragma once

#include <map>
#include <span>
#include <utility>
#include <vector>

#include "pushplan/motion/goal_region.hpp"
#include "pushplan/motion/random_tree/steering.hpp"
#include "pushplan/random.hpp"

namespace pushplan {

/// A tree that grows from a root to a goal. What it is given has to outlive it.
class PathTree {
 public:
  PathTree(const Pose& root, const GoalRegion& goal, const TreeLimits& limits,
           double backward,  // greatest total length that a path may lead back [m]
           const Footprint& footprint, const ConvexObstacles& among);

  /// Drives from the node nearest to a target towards it; `sampled` is a random curvature [1/m].
  /// True if the goal is reached, to which `arcs` then leads.
  bool grow(const Pose& target, double sampled);

  /// The arcs from the root to the node that came last.
  std::vector<Arc> arcs() const;

  Index count() const { return static_cast<Index>(nodes_.size()); }

 private:
  struct Node {
    Pose pose;
    Arc arc;  // that has led to it
    Index parent;
    double backward;  // length that may still lead back [m]
  };

  /// A square, as wide as the longest edge, with nodes in it.
  struct Cell {
    Vec2 centre;
    std::vector<std::pair<Pose, Index>> nodes;  // their poses and numbers
    double gap_squared = 0.0;                   // from a target [m^2]
  };

  void add(const Node& node);
  Index nearest(const Pose& target);

  GoalRegion goal_;
  TreeLimits limits_;
  Steering steering_;
  std::vector<Node> nodes_;
  std::vector<Cell> cells_;
  std::map<std::pair<Index, Index>, std::size_t> cell_numbers_;  // of columns and rows
};

/// Draws poses that a tree grows towards. The coarse path and the generator have to outlive it.
class TreeTargets {
 public:
  TreeTargets(std::span<const Vec2> coarse_path,  // one point or more [m]
              double fraction,  // of the targets that are near it; the others are uniform
              double spread,    // standard deviation of those about it [m]
              const Box& bounds, Random& random)
      : coarse_path_(coarse_path),
        fraction_(fraction),
        spread_(spread),
        bounds_(bounds),
        random_(random) {}

  Pose draw();

 private:
  std::span<const Vec2> coarse_path_;
  double fraction_;
  double spread_;
  Box bounds_;
  Random& random_;
};

}  // namespace pushplan
