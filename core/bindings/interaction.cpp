#include "arrays.hpp"
#include "pushplan/interaction/model.hpp"
#include "pushplan/interaction/occupancy.hpp"
#include "pushplan/interaction/path_sweep.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

namespace {

using CoverageOut = Array<float, 2>;

RasterFrame raster_frame(const OnePose& frame, double cell) { return {pose(frame), cell}; }

/// Requires poses and lengths of as many objects as a model has.
template <class M>
void require_objects(const M& model, const auto& objects, const auto& lengths) {
  require_count("poses", objects.shape(0), model.radii().size());
  require_count("lengths", lengths.shape(0), model.radii().size());
}

/// Poses of K objects at each of some poses of a path.
ArrayView<Pose, 2> swept_poses(const FloatsOut<3>& out, const Poses& path, const PosesOut& objects,
                               std::size_t count) {
  require_room("path", path.shape(0), 1);
  require_count("poses", objects.shape(0), count);
  require_room("out", out.shape(0), path.shape(0));
  require_count("columns of out", out.shape(1), count);
  return grid_as<Pose>(out);
}

template <InteractionModel M>
void bind_step(nb::class_<M> model) {
  model
      .def(
          "advance",
          [](M& self, const OnePose& from, const OnePose& to, const PosesOut& objects,
             const FloatsOut<1>& lengths) {
            require_objects(self, objects, lengths);
            return self.advance(pose(from), pose(to), poses(objects), view(lengths));
          },
          "robot_from"_a, "robot_to"_a, "poses"_a, "lengths"_a, ReleaseGil())
      .def_prop_ro("tests", &M::tests);
}

template <class M>
nb::class_<M> bind_sweep(nb::class_<M> model) {
  return model.def(
      "sweep",
      [](M& self, const Poses& path, const PosesOut& objects, const FloatsOut<3>& out) {
        const auto rows = swept_poses(out, path, objects, self.bodies().radii.size());
        return self.sweep(poses(path), poses(objects), rows);
      },
      "path"_a, "poses"_a, "out"_a, ReleaseGil());
}

void bind_portions(nb::module_& module) {
  module.def(
      "cover_objects",
      [](const Poses& bodies, const Points& vertices, const Integers<1>& offsets,
         const OnePose& frame, double cell, const CoverageOut& out) {
        const Polygons outlines = polygons(vertices, offsets);
        require_count("poses", bodies.shape(0), outlines.count());
        cover_objects(poses(bodies), outlines, raster_frame(frame, cell), view(out));
      },
      "poses"_a, "vertices"_a, "offsets"_a, "frame"_a, "cell"_a, "out"_a, ReleaseGil());
  module.def(
      "cover_sweep",
      [](const Poses& path, const Points& vertices, const Integers<1>& offsets,
         const OnePose& frame, double cell, const CoverageOut& out) {
        cover_sweep(poses(path), polygons(vertices, offsets), raster_frame(frame, cell), view(out));
      },
      "path"_a, "vertices"_a, "offsets"_a, "frame"_a, "cell"_a, "out"_a, ReleaseGil());
  module.def(
      "step_works",
      [](const FloatsOut<3>& swept, const Floats<1>& masses, const FloatsOut<1>& works) {
        require_room("swept", swept.shape(0), works.shape(0) + 1);
        require_count("masses", masses.shape(0), swept.shape(1));
        step_works(grid_as<Pose>(swept), view(masses), view(works));
      },
      "swept"_a, "masses"_a, "works"_a, ReleaseGil());
  module.def(
      "sweep_near",
      [](const Poses& path, const PosesOut& floes, const IceBodies& bodies, double step,
         Index iterations, double hull_friction, double friction, double still, double margin,
         const FloatsOut<3>& out, const FloatsOut<1>& works) {
        const auto rows = swept_poses(out, path, floes, bodies.radii.size());
        require_count("works", works.shape(0), path.shape(0) - 1);
        sweep_near(poses(path), poses(floes), bodies,
                   {step, iterations, hull_friction, friction, still}, margin, rows, view(works));
      },
      "path"_a, "poses"_a, "bodies"_a, "step"_a, "iterations"_a, "hull_friction"_a, "friction"_a,
      "still"_a, "margin"_a, "out"_a, "works"_a, ReleaseGil());
}

}  // namespace

void bind_interaction(nb::module_& module) {
  nb::class_<Bodies>(module, "Bodies", "A robot, objects and walls.")
      .def(
          "__init__",
          [](Bodies* self, const Points& robot_vertices, const Integers<1>& robot_offsets,
             Index wall_parts, double robot_radius, const Points& vertices,
             const Integers<1>& offsets, const Points& part_vertices,
             const Integers<1>& part_offsets, const Integers<1>& first_parts,
             const Floats<1>& radii, const Floats<1>& inverse_masses,
             const Floats<1>& inverse_gyration, const Points& wall_vertices,
             const Integers<1>& wall_offsets, const Floats<2>& wall_boxes) {
            const Polygons robot = polygons(robot_vertices, robot_offsets);
            const Polygons objects = polygons(vertices, offsets);
            const Compounds shapes = compounds(part_vertices, part_offsets, first_parts);
            const Polygons walls = polygons(wall_vertices, wall_offsets);
            require_count("first_parts", first_parts.shape(0), objects.count() + 1);
            require_between("wall_parts", wall_parts, 0, robot.count());
            require_count("radii", radii.shape(0), objects.count());
            require_count("inverse_masses", inverse_masses.shape(0), objects.count());
            require_count("inverse_gyration", inverse_gyration.shape(0), objects.count());
            require_count("wall_boxes", wall_boxes.shape(0), walls.count());
            new (self) Bodies{robot,
                              wall_parts,
                              robot_radius,
                              objects,
                              shapes,
                              view(radii),
                              view(inverse_masses),
                              view(inverse_gyration),
                              walls,
                              rows_as<const Box>(wall_boxes)};
          },
          "robot_vertices"_a, "robot_offsets"_a, "wall_parts"_a, "robot_radius"_a, "vertices"_a,
          "offsets"_a, "part_vertices"_a, "part_offsets"_a, "first_parts"_a, "radii"_a,
          "inverse_masses"_a, "inverse_gyration"_a, "wall_vertices"_a, "wall_offsets"_a,
          "wall_boxes"_a, nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(), nb::keep_alive<1, 6>(),
          nb::keep_alive<1, 7>(), nb::keep_alive<1, 8>(), nb::keep_alive<1, 9>(),
          nb::keep_alive<1, 10>(), nb::keep_alive<1, 11>(), nb::keep_alive<1, 12>(),
          nb::keep_alive<1, 13>(), nb::keep_alive<1, 14>(), nb::keep_alive<1, 15>(),
          nb::keep_alive<1, 16>());

  bind_step(bind_sweep(
      nb::class_<QuasiStatic>(module, "QuasiStatic",
                              "Quasi-static pushing with memory for one thread.")
          .def(
              "__init__",
              [](QuasiStatic* self, const Bodies& bodies, double max_step, double tolerance,
                 double jam_depth, Index iterations, double friction, double static_friction) {
                new (self) QuasiStatic(bodies, {max_step, tolerance, jam_depth, iterations,
                                                friction, static_friction});
              },
              "bodies"_a, "max_step"_a, "tolerance"_a, "jam_depth"_a, "iterations"_a, "friction"_a,
              "static_friction"_a, nb::keep_alive<1, 2>())));

  nb::class_<IceBodies>(module, "IceBodies", "A hull among floes.")
      .def(
          "__init__",
          [](IceBodies* self, const Points& hull_vertices, const Integers<1>& hull_offsets,
             double hull_radius, const Points& vertices, const Integers<1>& offsets,
             const Integers<1>& first_parts, const Floats<1>& radii, const Floats<1>& masses,
             const Floats<1>& inverse_gyration) {
            const Compounds floes = compounds(vertices, offsets, first_parts);
            require_count("radii", radii.shape(0), floes.count());
            require_count("masses", masses.shape(0), floes.count());
            require_count("inverse_gyration", inverse_gyration.shape(0), floes.count());
            new (self) IceBodies{polygons(hull_vertices, hull_offsets),
                                 hull_radius,
                                 floes,
                                 view(radii),
                                 view(masses),
                                 view(inverse_gyration)};
          },
          "hull_vertices"_a, "hull_offsets"_a, "hull_radius"_a, "vertices"_a, "offsets"_a,
          "first_parts"_a, "radii"_a, "masses"_a, "inverse_gyration"_a, nb::keep_alive<1, 2>(),
          nb::keep_alive<1, 3>(), nb::keep_alive<1, 5>(), nb::keep_alive<1, 6>(),
          nb::keep_alive<1, 7>(), nb::keep_alive<1, 8>(), nb::keep_alive<1, 9>(),
          nb::keep_alive<1, 10>());

  bind_sweep(nb::class_<IceContacts>(module, "IceContacts",
                                     "Floes that push floes, with memory for one thread.")
                 .def(
                     "__init__",
                     [](IceContacts* self, const IceBodies& bodies, double step, Index iterations,
                        double hull_friction, double friction, double still) {
                       new (self)
                           IceContacts(bodies, {step, iterations, hull_friction, friction, still});
                     },
                     "bodies"_a, "step"_a, "iterations"_a, "hull_friction"_a, "friction"_a,
                     "still"_a, nb::keep_alive<1, 2>()));

  bind_step<IceInteraction>(
      nb::class_<IceInteraction>(module, "IceInteraction",
                                 "Floes as a model that is driven step by step.")
          .def(
              "__init__",
              [](IceInteraction* self, const IceBodies& bodies, double step, Index iterations,
                 double hull_friction, double friction, double still) {
                new (self)
                    IceInteraction(bodies, {step, iterations, hull_friction, friction, still});
              },
              "bodies"_a, "step"_a, "iterations"_a, "hull_friction"_a, "friction"_a, "still"_a,
              nb::keep_alive<1, 2>()));

  bind_step<CalledInteraction>(
      nb::class_<CalledInteraction>(module, "CalledInteraction", "Any model behind a C function.")
          .def(
              "__init__",
              [](CalledInteraction* self, std::uintptr_t function, std::uintptr_t context,
                 const Floats<1>& radii, const Floats<1>& inverse_masses, const nb::object&) {
                require_count("inverse_masses", inverse_masses.shape(0), radii.shape(0));
                new (self) CalledInteraction(reinterpret_cast<CalledInteraction::Advance>(function),
                                             reinterpret_cast<void*>(context), view(radii),
                                             view(inverse_masses));
              },
              "function"_a, "context"_a, "radii"_a, "inverse_masses"_a, "owner"_a = nb::none(),
              nb::keep_alive<1, 4>(), nb::keep_alive<1, 5>(), nb::keep_alive<1, 6>(),
              "Addresses of a `CalledInteraction::Advance` and of what it is given as its context; "
              "`owner` is kept alive for them."));

  bind_portions(module);
}

}  // namespace pushplan::bindings
