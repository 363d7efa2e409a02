// A world in the arrays that the core works with.
#pragma once

#include <string>
#include <vector>

#include "pushplan/interaction/quasi_static.hpp"
#include "pushplan/motion/collision.hpp"
#include "pushplan/planner.hpp"

namespace pushplan {

/// Says what is wrong with the arguments of a planning call; empty if nothing is.
std::string fault_of(const World& world, const PlannerOptions& options);

/// Outlines that own their corners, counter-clockwise, with a box around each, and around groups.
class Outlines {
 public:
  void add(Polygon outline);
  Polygons polygons() const { return {vertices_, offsets_}; }
  std::span<const Box> boxes() const { return boxes_; }
  ConvexObstacles within(const Box& bounds) const { return {polygons(), boxes_, groups_, bounds}; }
  double radius() const;  // of the disc about the origin that holds all [m]

 private:
  std::vector<Vec2> vertices_;
  std::vector<Index> offsets_{0};
  std::vector<Box> boxes_;
  std::vector<Box> groups_;
};

/// A world without faults. It has to outlive the scene, and the scene what is made of it.
class Scene {
 public:
  explicit Scene(const World& world);
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  double size;                 // R, circumscribed radius of the robot [m]
  std::vector<Pose> poses;     // (K,) of the objects, each about its centroid
  std::vector<double> masses;  // (K,) [kg]

  Index count() const { return static_cast<Index>(masses.size()); }
  double total_mass() const;
  double turning_radius() const;
  GoalRegion goal(double inset) const;  // entered by an inset [m]
  Footprint footprint() const { return {robot_.polygons(), size}; }
  /// The footprint with a margin, set by `grow_footprint` [m].
  Footprint grown_footprint() const { return {grown_.polygons(), grown_.radius()}; }
  void grow_footprint(double margin);
  ConvexObstacles walls() const { return walls_.within(world_.bounds); }
  ConvexObstacles everything() const { return everything_.within(world_.bounds); }
  Bodies bodies() const;
  QuasiStaticSettings settings(double friction, double static_friction) const;
  /// The pose of an object in the frame in which it was given.
  Pose given_pose(Index k, const Pose& about_centroid) const;

 private:
  const World& world_;
  Outlines robot_;
  Outlines grown_;
  Outlines walls_;
  Outlines objects_;
  Outlines everything_;  // walls, and objects where they are
  std::vector<Vec2> centroids_;
  std::vector<double> radii_;
  std::vector<double> inverse_masses_;
  std::vector<double> inverse_gyration_;
};

}  // namespace pushplan
