#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>

#include <array>

#include "arrays.hpp"
#include "goal.hpp"
#include "pushplan/planners/mppi/rollout.hpp"
#include "pushplan/planners/ship_lattice/shortcut_proposals.hpp"
#include "pushplan/planners/ship_predictive/arcs.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

namespace {

template <InteractionModel M>
void bind_roll_objects(nb::module_& module) {
  module.def(
      "roll_objects",
      [](M& model, const Poses& start, const Rollouts& rollouts) {
        const std::size_t count = model.radii().size();
        require_count("start", start.shape(0), count);
        require_count("objects", count, rollouts.objects.extent(1));
        require_indices("ends", rollouts.ends, rollouts.paths.extent(1));
        roll_objects(model, poses(start), rollouts);
      },
      "model"_a, "start"_a, "rollouts"_a, ReleaseGil());
}

constexpr Index kMostSubsteps = 10'000;

void bind_rollouts(nb::module_& module) {
  nb::class_<RolloutProblem>(module, "RolloutProblem", "Robot, static obstacles and goal.")
      .def(
          "__init__",
          [](RolloutProblem* self, double period, Index substeps, const Numbers<6>& limits,
             const Footprint& footprint, const ConvexObstacles& walls, const Numbers<5>& goal,
             bool has_goal, double allowed) {
            require_between("substeps", substeps, 1, kMostSubsteps);
            new (self) RolloutProblem{
                period,    substeps, *reinterpret_cast<const DriveLimits*>(limits.data()),
                footprint, walls,    goal_region(goal),
                has_goal,  allowed};
          },
          "period"_a, "substeps"_a, "limits"_a, "footprint"_a, "walls"_a, "goal"_a, "has_goal"_a,
          "allowed"_a, nb::keep_alive<1, 5>(), nb::keep_alive<1, 6>());
  nb::class_<Rollouts>(module, "Rollouts", "Rollouts of poses among objects.")
      .def(
          "__init__",
          [](Rollouts* self, const FloatsOut<3>& paths, const FloatsOut<3>& twists,
             const IntegersOut<1>& ends, const IntegersOut<1>& outcomes,
             const FloatsOut<3>& objects, const FloatsOut<1>& works) {
            const std::size_t count = paths.shape(0);
            require_room("poses of paths", paths.shape(1), 1);
            require_count("twists", twists.shape(0), count);
            require_count("ends", ends.shape(0), count);
            require_count("outcomes", outcomes.shape(0), count);
            require_count("objects", objects.shape(0), count);
            require_count("works", works.shape(0), count);
            new (self) Rollouts{grid_as<Pose>(paths),
                                grid_as<DriveCommand>(twists),
                                view(ends),
                                rows_as<RolloutOutcome>(outcomes),
                                grid_as<Pose>(objects),
                                view(works)};
          },
          "paths"_a, "twists"_a, "ends"_a, "outcomes"_a, "objects"_a, "works"_a,
          nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>(),
          nb::keep_alive<1, 5>(), nb::keep_alive<1, 6>(), nb::keep_alive<1, 7>());
  module.def(
      "roll_robots",
      [](const Floats<3>& controls, const OnePose& start, double speed, double turn_rate,
         const RolloutProblem& problem, const Rollouts& out) {
        const auto commands = grid_as<const DriveCommand>(controls);
        require_count("controls", controls.shape(0), out.paths.extent(0));
        require_count("columns of controls", controls.shape(1), out.twists.extent(1));
        require_room("poses of paths", static_cast<std::size_t>(out.paths.extent(1)),
                     controls.shape(1) * static_cast<std::size_t>(problem.substeps) + 1);
        roll_robots(commands, pose(start), {speed, turn_rate}, problem, out);
      },
      "controls"_a, "start"_a, "speed"_a, "turn_rate"_a, "problem"_a, "out"_a, ReleaseGil());
}

void bind_ships(nb::module_& module) {
  module.def(
      "propose_change",
      [](const Poses& path, const Floats<1>& curvatures, const Numbers<4>& draws,
         const Numbers<2>& normals, const Numbers<9>& problem, const PosesOut& out,
         const FloatsOut<1>& out_curvatures) {
        require_count("curvatures", curvatures.shape(0), path.shape(0));
        require_count("out_curvatures", out_curvatures.shape(0), out.shape(0));
        for (const double draw : std::span(draws.data(), 4)) {
          if (!(draw >= 0.0 && draw < 1.0)) refuse("draws", std::to_string(draw), "in [0, 1)");
        }
        const double* p = problem.data();
        const ChangedPath changed = propose_change(
            {poses(path), view(curvatures)}, *reinterpret_cast<const ChangeDraw*>(draws.data()),
            *reinterpret_cast<const ChangeShift*>(normals.data()),
            {{p[0], p[1], p[3]}, p[2], p[4], {{p[5], p[6]}, {p[7], p[8]}}},
            {poses(out), view(out_curvatures)});
        return std::array{changed.first, changed.rest, changed.size};
      },
      "poses"_a, "curvatures"_a, "draws"_a, "normals"_a, "problem"_a, "out"_a, "out_curvatures"_a,
      ReleaseGil(),
      "`problem` is radius, spacing, spread, most turn, end fraction, and the goal line.");
  nb::class_<IceCostToGo>(module, "IceCostToGo", "Costs to the goal line if no floe moved.")
      .def(
          "__init__",
          [](IceCostToGo* self, const FloatsOut<3>& table, const FloatsOut<2>& field, double left,
             double low, double column, double row, double cell, double bow, double mass,
             double weight, double radius) {
            for (const std::size_t axis : {0, 1, 2}) require_room("table", table.shape(axis), 2);
            for (const std::size_t axis : {0, 1}) require_room("field", field.shape(axis), 2);
            new (self) IceCostToGo{view(table), view(field), left, low,    column, row,
                                   cell,        bow,         mass, weight, radius};
          },
          "table"_a, "field"_a, "left"_a, "low"_a, "column"_a, "row"_a, "cell"_a, "bow"_a, "mass"_a,
          "weight"_a, "radius"_a, nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>())
      .def(
          "fill_field",
          [](const IceCostToGo& self, const Poses& floes, const Floats<1>& radii,
             const Floats<1>& masses, double half_beam) {
            require_count("radii", radii.shape(0), floes.shape(0));
            require_count("masses", masses.shape(0), floes.shape(0));
            self.fill_field({poses(floes), view(radii), view(masses), half_beam});
          },
          "poses"_a, "radii"_a, "masses"_a, "half_beam"_a, ReleaseGil())
      .def("fill_table", &IceCostToGo::fill_table, ReleaseGil())
      .def(
          "cost_to_go",
          [](const IceCostToGo& self, double x, double y, double theta) {
            return self.cost_to_go({x, y, theta});
          },
          "x"_a, "y"_a, "theta"_a)
      .def(
          "cost_ahead",
          [](const IceCostToGo& self, const Floats<2>& arc, double step) {
            require_room("arc", arc.shape(0), 1);
            const CostAhead costs = cost_ahead(self, rows_as<const ArcPose>(arc), step);
            return std::pair(costs.work, costs.to_go);
          },
          "arc"_a, "step"_a)
      .def(
          "steer_on",
          [](const IceCostToGo& self, const OnePose& start, const Floats<1>& curvatures,
             double step, const FloatsOut<2>& out) {
            require_room("curvatures", curvatures.shape(0), 1);
            return steer_on(self, pose(start), view(curvatures), step, rows_as<ArcPose>(out));
          },
          "pose"_a, "curvatures"_a, "step"_a, "out"_a, ReleaseGil());
  module.def(
      "arc_ahead",
      [](double goal, const Numbers<2>& low, const Numbers<2>& high, const OnePose& start,
         double curvature, double step, const FloatsOut<2>& out) {
        require_room("out", out.shape(0), 1);
        const Box box{low.data()[0], low.data()[1], high.data()[0], high.data()[1]};
        return arc_ahead({goal, box}, pose(start), curvature, step, rows_as<ArcPose>(out));
      },
      "goal"_a, "low"_a, "high"_a, "pose"_a, "curvature"_a, "step"_a, "out"_a);
}

}  // namespace

void bind_planners(nb::module_& module) {
  bind_rollouts(module);
  bind_roll_objects<QuasiStatic>(module);
  bind_roll_objects<IceInteraction>(module);
  bind_roll_objects<CalledInteraction>(module);
  bind_ships(module);
}

}  // namespace pushplan::bindings
