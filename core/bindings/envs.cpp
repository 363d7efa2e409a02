#include "arrays.hpp"
#include "pushplan/envs/momentum.hpp"
#include "pushplan/envs/reach.hpp"
#include "pushplan/envs/water.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

void bind_envs(nb::module_& module) {
  module.def(
      "slow_down",
      [](const Poses& velocities, const Floats<1>& keeps, const Floats<2>& drag, double h) {
        require_count("keeps", keeps.shape(0), velocities.shape(0));
        require_count("drag", drag.shape(0), velocities.shape(0));
        const auto kept = zeros<double, 2>({velocities.shape(0), 3});
        slow_down(rows_as<const Twist>(velocities), view(keeps), rows_as<const BodyDrag>(drag), h,
                  rows_as<Twist>(kept));
        return kept;
      },
      "velocities"_a.noconvert(), "keeps"_a.noconvert(), "drag"_a.noconvert(), "h"_a);

  module.def(
      "flow_shapes",
      [](const Points& vertices, const Integers<1>& offsets) {
        const Polygons bodies = polygons(vertices, offsets);
        const auto shapes = zeros<double, 2>({static_cast<std::size_t>(bodies.count()), 4});
        flow_shapes(bodies, rows_as<FlowShape>(shapes));
        return shapes;
      },
      "vertices"_a.noconvert(), "offsets"_a.noconvert(),
      "(K, 4) mean width [m], area [m^2], two integrals of rotation [m^4, m^5] of convex bodies.");

  nb::class_<Reach>(module, "Reach", "Objects that a step of the robot can affect.")
      .def(
          "__init__",
          [](Reach* self, const Points& parts, const Integers<1>& part_offsets,
             const Points& vertices, const Integers<1>& offsets, const Floats<1>& radii) {
            const Polygons objects = polygons(vertices, offsets);
            require_count("radii", radii.shape(0), objects.count());
            new (self) Reach({polygons(parts, part_offsets), objects, view(radii)});
          },
          "parts"_a.noconvert(), "part_offsets"_a.noconvert(), "vertices"_a.noconvert(),
          "offsets"_a.noconvert(), "radii"_a.noconvert(), nb::keep_alive<1, 2>(),
          nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>(), nb::keep_alive<1, 5>(),
          nb::keep_alive<1, 6>())
      .def(
          "within",
          [](Reach& self, const OnePose& robot, double reach, const Poses& objects,
             const Floats<1>& speeds) {
            require_count("poses", objects.shape(0), self.count());
            require_count("speeds", speeds.shape(0), self.count());
            const auto found = zeros<bool, 1>({objects.shape(0)});
            self.within(pose(robot), reach, poses(objects), view(speeds), view(found));
            return found;
          },
          "robot"_a.noconvert(), "reach"_a, "poses"_a.noconvert(), "speeds"_a.noconvert())
      .def(
          "clear_time",
          [](Reach& self, const OnePose& robot, double course, double linear, double angular,
             bool holds, double limit, double margin, const Poses& objects,
             const Obstacles& obstacles) {
            require_count("poses", objects.shape(0), self.count());
            return self.clear_time(pose(robot), {course, linear, angular, holds}, limit, margin,
                                   poses(objects), obstacles);
          },
          "robot"_a.noconvert(), "course"_a, "linear"_a, "angular"_a, "holds"_a, "limit"_a,
          "margin"_a, "poses"_a.noconvert(), "obstacles"_a, ReleaseGil(),
          "Time [s] for which a robot that drives an arc certainly touches nothing.")
      .def(
          "struck",
          [](Reach& self, const Array<const bool, 1>& loaded, const Floats<3>& paths,
             const Poses& before) {
            require_count("before", before.shape(0), self.count());
            require_count("loaded", loaded.shape(0), self.count());
            require_room("paths", paths.shape(0), 1);
            require_count("columns of paths", paths.shape(1), self.count());
            const auto found = zeros<bool, 1>({before.shape(0)});
            self.struck(view(loaded), grid_as<const Pose>(paths), poses(before), view(found));
            return found;
          },
          "loaded"_a.noconvert(), "paths"_a.noconvert(), "before"_a.noconvert());

  module.def(
      "arc_pose",
      [](const OnePose& start, double course, double linear, double angular, bool holds,
         double time, const OnePoseOut& out) {
        *reinterpret_cast<Pose*>(out.data()) =
            arc_pose(pose(start), {course, linear, angular, holds}, time);
      },
      "start"_a.noconvert(), "course"_a, "linear"_a, "angular"_a, "holds"_a, "time"_a,
      "out"_a.noconvert());
}

}  // namespace pushplan::bindings
