// Objects that a step of the robot can affect, so that a simulator can leave out the rest.
#pragma once

#include <span>
#include <vector>

#include "pushplan/geometry/obstacles.hpp"

namespace pushplan {

/// Outlines of the robot and K objects, in their body frames [m].
struct ReachShapes {
  Polygons robot;  // convex parts
  Polygons objects;
  std::span<const double> radii;  // (K,) circumscribed radii of the objects
};

/// How a robot drives from where it is.
struct ArcMotion {
  double course;         // in which direction of the world it begins to go [rad]
  double linear;         // its speed in this direction [m/s]
  double angular;        // its turn rate [rad/s]
  bool holds;            // true if it keeps its course; else this turns with it
  double bearing = 0.0;  // of its motion in the body frame, 0 ahead [rad]
};

/// The pose after some time [s].
Pose arc_pose(const Pose& start, const ArcMotion& motion, double time);

/// The tests with their memory, for one thread. The shapes' arrays have to outlive it.
class Reach {
 public:
  explicit Reach(const ReachShapes& shapes);

  /// Number of objects.
  Index count() const { return shapes_.objects.count(); }

  /// Circumscribed radii of the robot and of the objects (K,) [m].
  double robot_radius() const { return size_; }
  std::span<const double> radii() const { return shapes_.radii; }

  /// Marks the objects in reach of the robot, those in motion, and those in reach of either.
  void within(const Pose& robot,
              double reach,  // greatest distance that one of its points moves in the step [m]
              std::span<const Pose> objects,
              std::span<const double> speeds,  // (K,) how far each object would move by itself in
                                               // the step [m]
              std::span<bool> found);          // (K,) filled

  /// Time [s] for which a robot that drives an arc certainly touches nothing, at most `limit`.
  /// Conservative advancement (Mirtich 1996): what is a distance away is not reached before the
  /// fastest point of the robot has gone that far.
  double clear_time(const Pose& robot, const ArcMotion& motion, double limit,
                    double margin,  // distance that counts as contact [m]
                    std::span<const Pose> objects, const Obstacles& obstacles);

  /// Marks the objects that were left out although something that moved came to overlap them.
  void struck(std::span<const bool> loaded,    // (K,) which objects were simulated
              ArrayView<const Pose, 2> paths,  // (T, K); those of the others do not change
              std::span<const Pose> before,    // (K,) poses before the step
              std::span<bool> found);          // (K,) filled

 private:
  std::span<Vec2> outline(Index k);
  void place(Index k, const Pose& pose);

  ReachShapes shapes_;
  double size_ = 0.0;          // radius of the robot about its origin [m]
  std::vector<Vec2> robot_;    // its corners in the world frame
  std::vector<Vec2> corners_;  // those of the objects
  std::vector<Vec2> moving_;   // those of one object on its way
  std::vector<char> near_;
  std::vector<Index> close_objects_;
  std::vector<Index> close_walls_;
};

}  // namespace pushplan
