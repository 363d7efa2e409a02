// Quasi-static pushing: overlaps are resolved by the least total motion.
//
// Objects rest unless something moves them. When the robot advances by a small step, every overlap
// is removed by the motion that is least in the norm sum of m (dx^2 + dy^2 + c^2 dtheta^2), object
// by object and point by point (projected Gauss-Seidel). That is Gauss's principle for bodies whose
// velocity dies at once, so it is what a simulator with full damping computes, and it is the
// ellipsoidal limit surface of Goyal, Ruina and Papadopoulos (1991) for a body pushed on the
// ground: (v_x, v_y, omega) is proportional to (f_x, f_y, tau / c^2).
#pragma once

#include <span>
#include <vector>

#include "pushplan/geometry/pose.hpp"
#include "pushplan/interaction/contact.hpp"

namespace pushplan {

/// A robot, K objects and walls.
struct Bodies {
  Polygons robot;       // convex parts in its body frame
  Index wall_parts;     // number of the first parts, which count at walls: all but the wheels
  double robot_radius;  // circumscribed [m]
  Polygons objects;     // convex hulls in their body frames
  Compounds shapes;     // the objects themselves
  std::span<const double> radii;             // (K,) circumscribed radii of the objects [m]
  std::span<const double> inverse_masses;    // (K,) [1/kg]
  std::span<const double> inverse_gyration;  // (K,) 1 / c^2 [1/m^2]
  Polygons walls;                            // convex static parts in the world frame
  std::span<const Box> wall_boxes;           // their bounding boxes
};

struct QuasiStaticSettings {
  double max_step;         // longest motion of a robot corner in one resolution step [m]
  double tolerance;        // overlap that counts as resolved [m]
  double jam_depth;        // overlap that cannot be resolved and counts as a jam [m]
  Index iterations;        // Gauss-Seidel rounds in one step
  double friction;         // Coulomb coefficient between robot and objects
  double static_friction;  // and between objects and walls
};

/// The model with its memory, for one thread. The bodies' arrays have to outlive it. Nothing is
/// allocated after construction.
class QuasiStatic {
 public:
  QuasiStatic(const Bodies& bodies, const QuasiStaticSettings& settings);

  /// Drives the robot to a near pose along a straight line, pushing what is in the way. Changes the
  /// objects' poses and adds to the lengths of their paths [m]. False where it jams: then the last
  /// small step is undone.
  bool advance(const Pose& robot_from, const Pose& robot_to, std::span<Pose> poses,
               std::span<double> lengths);

  /// Whether the robot at a pose overlaps static obstacles beyond the jam depth.
  bool robot_held(const Pose& pose);

  /// Sweeps the robot along a path; `out`, (N, K), receives the poses at each pose of the path.
  /// Returns the number of the first pose that is not reached, or -1.
  Index sweep(std::span<const Pose> path, std::span<Pose> poses, ArrayView<Pose, 2> out);

  const Bodies& bodies() const { return bodies_; }
  std::span<const double> radii() const { return bodies_.radii; }
  std::span<const double> inverse_masses() const { return bodies_.inverse_masses; }
  /// Pairs of outlines tested so far: a measure of time without a clock.
  Index tests() const { return tests_; }
  void reset_tests() { tests_ = 0; }

 private:
  struct Push {  // what moves objects, and from where to where
    Polygon piece;
    Pose from;
    Pose to;
    double friction;
  };

  void gather(Vec2 centre, double reach, std::span<const Pose> poses);
  Index touching(Vec2 centre, double reach, std::span<const Pose> poses);
  void widen(Index k, std::span<const Pose> poses);
  double push_out(const Push& push, Index k, std::span<Pose> poses);
  double against_robot(Index k, const Pose& from, const Pose& to, std::span<Pose> poses);
  double against_walls(Index k, std::span<Pose> poses);
  double against_objects(Index i, std::span<Pose> poses);
  double resolve(const Pose& from, const Pose& to, std::span<Pose> poses);
  Polygon part(Index p) const { return Polygons{corners_, bodies_.shapes.parts.offsets}[p]; }
  void place(Index k, std::span<const Pose> poses);

  Bodies bodies_;
  QuasiStaticSettings settings_;
  std::vector<Vec2> robot_;     // corners of the robot in the world frame
  std::vector<Vec2> corners_;   // of the objects' parts
  std::vector<Index> active_;   // objects that may move in this step: the first `count_`
  Index count_ = 0;
  std::vector<Pose> before_;    // poses before this step
  std::vector<Pose> saved_;     // of the objects nearby, before this small step
  std::vector<Index> near_;     // objects nearby, in order: no other one is touched or moves
  std::vector<double> unused_;  // lengths that `sweep` does not report
  Vec2 near_centre_{};          // every object whose disc reaches into this disc is nearby
  double near_reach_ = 0.0;
  Index tests_ = 0;
};

}  // namespace pushplan
