// A world in the arrays that the core works with.
#pragma once

#include "pushplan/interaction/quasi_static.hpp"
#include "pushplan/motion/path_problem.hpp"
#include "pushplan/planner.hpp"

namespace pushplan {

/// A world without faults, and what is made of it once for a planning call.
class Scene {
 public:
  Scene(World of, const PlannerOptions& options);
  Scene(const Scene&) = delete;

  const Robot& robot() const { return world.robot; }
  std::size_t object_count() const { return poses.size(); }
  /// The footprint as what is static sees it, without wheels or margin.
  Polygons wall_parts() const;
  PriceGrid price() const;
  Bodies bodies() const;
  QuasiStaticSettings settings(Index iterations) const;
  /// The convex parts of an object, in the world frame.
  void place_parts(std::size_t object, const Pose& at, OwnPolygons& out) const;

  World world;
  const PlannerOptions options;
  double size = 0.0;       // R, circumscribed radius of the robot [m]
  double inscribed = 0.0;  // radius of the largest disc about its origin in one part [m]
  std::vector<Pose> poses{};      // (K,) of the objects
  std::vector<double> masses{};   // [kg]
  std::vector<double> radii{};    // circumscribed [m]
  std::shared_ptr<const StaticMap> keep_out{};  // the map, grown by the margin of the world

 private:
  void add(const Object& object);

  OwnPolygons robot_parts_{};
  OwnPolygons hulls_{};  // of the objects, each in its frame
  OwnPolygons parts_{};
  std::vector<Index> first_parts_{0};
  std::vector<double> inverse_masses_{};
  std::vector<double> inverse_gyration_{};
};

}  // namespace pushplan
