#include <nanobind/stl/array.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <bit>

#include "arrays.hpp"
#include "pushplan/envs/planar_simulator.hpp"
#include "pushplan/envs/water.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

namespace {

using Address = std::uintptr_t;
using Functions = std::array<Address, sizeof(Chipmunk) / sizeof(Address)>;

template <class T>
std::vector<T*> pointers(const std::vector<Address>& addresses) {
  std::vector<T*> found;
  for (const Address address : addresses) found.push_back(std::bit_cast<T*>(address));
  return found;
}

/// What a simulator recorded in its last step: (T, 3) poses of the robot, (T, K, 3) of the objects.
auto recorded(const PlanarSimulator& simulator) {
  const auto& [robot, objects, held, touched] = simulator.record();
  const auto poses = zeros<double, 2>({robot.size(), 3});
  const auto paths = zeros<double, 3>({robot.size(), simulator.count(), 3});
  std::ranges::copy(robot, reinterpret_cast<Pose*>(poses.data()));
  std::ranges::copy(objects, reinterpret_cast<Pose*>(paths.data()));
  return std::tuple(poses, paths, held, touched);
}

}  // namespace

void bind_envs(nb::module_& module) {
  module.def(
      "flow_shapes",
      [](const Points& vertices, const Integers<1>& offsets) {
        const Polygons bodies = polygons(vertices, offsets);
        const auto shapes = zeros<double, 2>({static_cast<std::size_t>(bodies.count()), 4});
        flow_shapes(bodies, rows_as<FlowShape>(shapes));
        return shapes;
      },
      "vertices"_a, "offsets"_a,
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
          "parts"_a, "part_offsets"_a, "vertices"_a, "offsets"_a, "radii"_a, nb::keep_alive<1, 2>(),
          nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>(), nb::keep_alive<1, 5>(),
          nb::keep_alive<1, 6>());

  module.def("contact_points_size", [] { return sizeof(ContactPoints); });
  module.def(
      "contact_callbacks",
      [](bool of_robot, bool with_fixed) {
        return std::bit_cast<std::array<Address, 3>>(contact_callbacks(of_robot, with_fixed));
      },
      "of_robot"_a, "with_fixed"_a);

  nb::class_<PlanarSimulator>(module, "PlanarSimulator",
                              "A robot among objects in a space of Chipmunk.")
      .def(
          "__init__",
          [](PlanarSimulator* self, const Functions& functions, Address space,
             const std::vector<Address>& bodies, const std::vector<std::vector<Address>>& shapes,
             const nb::object&, const Reach& reach, const Obstacles& obstacles,
             const Floats<1>& keeps, const Floats<2>& inertia, const Floats<2>& drag,
             const FloatsOut<2>& states, double travel, double tolerance, double rest, double decay,
             Index samples, bool holds) {
            ChipmunkHandles handles{std::bit_cast<cpSpace*>(space), pointers<cpBody>(bodies), {}};
            for (const auto& own : shapes) handles.shapes.push_back(pointers<cpShape>(own));
            require_count("shapes", shapes.size(), bodies.size());
            require_count("bodies", bodies.size(), reach.count() + 1);
            for (const std::size_t rows :
                 {keeps.shape(0), inertia.shape(0), drag.shape(0), states.shape(0)}) {
              require_count("rows of bodies", rows, bodies.size());
            }
            const Momentum momentum{view(keeps), rows_as<const Inertia>(inertia),
                                    rows_as<const BodyDrag>(drag)};
            new (self) PlanarSimulator(
                std::bit_cast<Chipmunk>(functions), handles, reach, obstacles, momentum,
                {travel, tolerance, rest, decay, samples, holds}, rows_as<BodyState>(states));
          },
          "functions"_a, "space"_a, "bodies"_a, "shapes"_a, "owner"_a, "reach"_a, "obstacles"_a,
          "keeps"_a, "inertia"_a, "drag"_a, "states"_a, "travel"_a, "tolerance"_a, "rest"_a,
          "decay"_a, "samples"_a, "holds"_a, nb::keep_alive<1, 6>(), nb::keep_alive<1, 7>(),
          nb::keep_alive<1, 8>(), nb::keep_alive<1, 9>(), nb::keep_alive<1, 10>(),
          nb::keep_alive<1, 11>(), nb::keep_alive<1, 12>())
      .def(
          "step",
          [](PlanarSimulator& self, double linear, double angular, double lateral,
             double duration) {
            self.step(linear, angular, lateral, duration);
            return recorded(self);
          },
          "linear"_a, "angular"_a, "lateral"_a, "duration"_a,
          "Poses (T, 3) of the robot and (T, K, 3) of the objects in a step; whether the robot was\n"
          "held, and touched something static.")
      .def(
          "sweep",
          [](PlanarSimulator& self, const OnePose& to, const OnePose& motion, double length,
             double duration) { return self.sweep(pose(to), pose(motion), length, duration); },
          "to"_a, "motion"_a, "length"_a, "duration"_a,
          "Drive straight to a pose; False if the robot was held.")
      .def("clear_for", &PlanarSimulator::clear_for, "linear"_a, "angular"_a, "lateral"_a,
           "limit"_a, "Time [s] for which the robot certainly touches nothing.")
      .def_prop_ro("loaded", &PlanarSimulator::loaded,
                   "Number of objects that the last step needed the engine for.")
      .def_rw("most_shapes", &PlanarSimulator::most_shapes,
              "Greatest number of shapes that were in the engine at once.")
      .def_rw("loads_all", &PlanarSimulator::loads_all,
              "True if objects that cannot move are simulated as well.")
      .def_prop_ro("contacts", [](PlanarSimulator& self) {
        return reinterpret_cast<Address>(&self.contacts());
      });
}

}  // namespace pushplan::bindings
