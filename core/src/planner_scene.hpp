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

/// Outlines that own their corners, counter-clockwise, with boxes around them.
struct Outlines {
  void add(Polygon outline);
  Polygons polygons() const { return {vertices, offsets}; }
  double radius() const;  // of the disc about the origin that holds all [m]
  double width() const;   // least distance between parallel lines that hold one [m]

  std::vector<Vec2> vertices;
  std::vector<Index> offsets{0};
  std::vector<Box> boxes;
  std::vector<Box> groups;
};

/// A world without faults. It has to outlive the scene, and the scene what is made of it.
struct Scene {
  explicit Scene(const World& world);

  /// The footprint, with a margin [m].
  Outlines footprint(double margin) const;
  ConvexObstacles obstacles() const;
  GoalRegion goal(double inset) const;  // entered by an inset [m]
  Bodies bodies() const;
  QuasiStaticSettings settings(const PlannerOptions& options) const;

  const World& world;
  Outlines robot;
  Outlines walls;
  Outlines objects;            // each about its centroid
  std::vector<Index> first_parts{0};
  double size;                 // R, circumscribed radius of the robot [m]
  double turning_radius;       // least one at full speed [m]
  std::vector<Pose> poses;     // (K,) of the objects
  std::vector<double> masses;  // [kg]
  std::vector<double> radii;   // circumscribed [m]
  std::vector<double> inverse_masses;
  std::vector<double> inverse_gyration;
};

}  // namespace pushplan
