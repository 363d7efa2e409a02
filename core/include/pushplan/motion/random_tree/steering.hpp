// The edges of a kinodynamic random tree.
#pragma once

#include "pushplan/motion/collision.hpp"
#include "pushplan/motion/dubins.hpp"

namespace pushplan {

/// Limits on the edges of a tree.
struct TreeLimits {
  double max_curvature;  // greatest |curvature| of an edge [1/m]
  double edge_length;    // longest edge [m]
  double spacing;        // distance between collision checks [m]
  double turn_weight;    // length that a radian of heading error is worth [m]
};

/// An arc, and where it leads; its length is 0 if every arc is blocked.
struct SteeredArc {
  Arc arc;
  Pose end;
};

/// Steers towards targets, with memory for one thread.
class Steering {
 public:
  Steering(const TreeLimits& limits, const Footprint& footprint, const ConvexObstacles& obstacles)
      : limits_(limits), checker_(footprint, obstacles) {}

  /// The free arc that ends nearest to a target, of seven. Where it may lead back, by `backward` at
  /// most [m], there are seven more, whose lengths are negative.
  SteeredArc steer(const Pose& start, const Pose& target,
                   double sampled,  // a random curvature [1/m]; the others are spread evenly or aim
                                    // at the target
                   double backward);

 private:
  void try_arc(const Pose& start, const Pose& target, const Arc& arc, double& least,
               SteeredArc& best);

  TreeLimits limits_;
  CollisionChecker checker_;
};

}  // namespace pushplan
