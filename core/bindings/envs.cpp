#include "arrays.hpp"
#include "pushplan/envs/momentum.hpp"
#include "pushplan/envs/reach.hpp"
#include "pushplan/envs/water.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

void bind_envs(nb::module_& module) {
  module.def(
      "slow_down",
      [](const Floats<2>& velocities, const Floats<1>& keeps, const Floats<2>& drag, double h,
         const FloatsOut<2>& out) {
        slow_down(rows_as<const Twist>(velocities), view(keeps), rows_as<const BodyDrag>(drag), h,
                  rows_as<Twist>(out));
      },
      "velocities"_a.noconvert(), "keeps"_a.noconvert(), "drag"_a.noconvert(), "h"_a,
      "out"_a.noconvert(), ReleaseGil());

  module.def(
      "flow_shapes",
      [](const Points& vertices, const Integers<1>& offsets, const FloatsOut<2>& out) {
        flow_shapes({points(vertices), view(offsets)}, rows_as<FlowShape>(out));
      },
      "vertices"_a.noconvert(), "offsets"_a.noconvert(), "out"_a.noconvert(), ReleaseGil());

  nb::class_<Reach>(module, "Reach", "Objects that a step of the robot can affect.")
      .def(
          "__init__",
          [](Reach* self, const Points& parts, const Integers<1>& part_offsets,
             const Points& vertices, const Integers<1>& offsets, const Floats<1>& radii) {
            new (self) Reach({{points(parts), view(part_offsets)},
                              {points(vertices), view(offsets)},
                              view(radii)});
          },
          "parts"_a.noconvert(), "part_offsets"_a.noconvert(), "vertices"_a.noconvert(),
          "offsets"_a.noconvert(), "radii"_a.noconvert(), nb::keep_alive<1, 2>(),
          nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>(), nb::keep_alive<1, 5>(),
          nb::keep_alive<1, 6>())
      .def(
          "within",
          [](Reach& self, const OnePose& robot, double reach, const Poses& objects,
             const Floats<1>& speeds, const Array<bool, 1>& found) {
            self.within(pose(robot), reach, poses(objects), view(speeds), view(found));
          },
          "robot"_a.noconvert(), "reach"_a, "poses"_a.noconvert(), "speeds"_a.noconvert(),
          "found"_a.noconvert(), ReleaseGil())
      .def(
          "clear_time",
          [](Reach& self, const OnePose& robot, double course, double linear, double angular,
             bool holds, double limit, double margin, const Poses& objects, const Points& cores,
             const Integers<1>& core_offsets, const Floats<1>& core_radii) {
            return self.clear_time(pose(robot), {course, linear, angular, holds}, limit, margin,
                                   poses(objects),
                                   {{points(cores), view(core_offsets)}, view(core_radii), {}});
          },
          "robot"_a.noconvert(), "course"_a, "linear"_a, "angular"_a, "holds"_a, "limit"_a,
          "margin"_a, "poses"_a.noconvert(), "cores"_a.noconvert(), "core_offsets"_a.noconvert(),
          "core_radii"_a.noconvert(), ReleaseGil())
      .def(
          "struck",
          [](Reach& self, const Array<const bool, 1>& loaded, const Floats<3>& paths,
             const Poses& before, const Array<bool, 1>& found) {
            const ArrayView<const Pose, 2> rows(
                reinterpret_cast<const Pose*>(paths.data()),
                {static_cast<Index>(paths.shape(0)), static_cast<Index>(paths.shape(1))});
            self.struck(view(loaded), rows, poses(before), view(found));
          },
          "loaded"_a.noconvert(), "paths"_a.noconvert(), "before"_a.noconvert(),
          "found"_a.noconvert(), ReleaseGil());

  module.def(
      "arc_pose",
      [](const OnePose& start, double course, double linear, double angular, bool holds,
         double time, const FloatsOut<1>& out) {
        *reinterpret_cast<Pose*>(out.data()) =
            arc_pose(pose(start), {course, linear, angular, holds}, time);
      },
      "start"_a.noconvert(), "course"_a, "linear"_a, "angular"_a, "holds"_a, "time"_a,
      "out"_a.noconvert());
}

}  // namespace pushplan::bindings
