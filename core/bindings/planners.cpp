#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/unique_ptr.h>

#include <array>
#include <memory>

#include "arrays.hpp"
#include "goal.hpp"
#include "pushplan/planners/mppi/rollout.hpp"
#include "pushplan/planners/push_aware/best_first.hpp"
#include "pushplan/planners/push_aware/random_tree.hpp"
#include "pushplan/planners/ship_lattice/shortcut_proposals.hpp"
#include "pushplan/planners/ship_predictive/arcs.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

namespace {

using Flags2 = Array<const bool, 2>;
using Flags3 = Array<const bool, 3>;

/// `PushLattice` and its search, whatever the model of interaction is.
class PushSearch {
 public:
  virtual ~PushSearch() = default;
  virtual SearchStatus run(Index budget) = 0;
  virtual Index goal() const = 0;
};

template <InteractionModel M>
class PushSearchOver final : public PushSearch {
 public:
  PushSearchOver(PushLattice<M> lattice, Index size) : search_(std::move(lattice), size) {
    search_.start(1);
  }

  SearchStatus run(Index budget) override { return search_.run(budget); }
  Index goal() const override { return search_.goal(); }

 private:
  AStar<PushLattice<M>> search_;
};

void bind_cost_to_go(nb::module_& module) {
  nb::class_<CostToGo>(module, "CostToGo", "A table of lengths to the goal.")
      .def(
          "__init__",
          [](CostToGo* self, const Floats<3>& values, const Floats<2>& floor, double x, double y,
             double cell) { new (self) CostToGo{view(values), view(floor), {{x, y}, cell}}; },
          "values"_a.noconvert(), "floor"_a.noconvert(), "x"_a, "y"_a, "cell"_a,
          nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>())
      .def_prop_ro("shape",
                   [](const CostToGo& self) {
                     return std::tuple(self.rows(), self.columns(), self.headings());
                   })
      .def_prop_ro("cell", [](const CostToGo& self) { return self.cells.step; })
      .def(
          "length_to_go",
          [](const CostToGo& self, double x, double y, double theta) {
            return self.length_to_go({x, y, theta});
          },
          "x"_a, "y"_a, "theta"_a)
      .def(
          "sweep",
          [](const CostToGo& self, const FloatsOut<3>& values, const Flags3& free,
             const Integers<1>& order, const Floats<3>& ends, double length) {
            const ArrayView<const Pose, 2> poses(
                reinterpret_cast<const Pose*>(ends.data()),
                {static_cast<Index>(ends.shape(0)), static_cast<Index>(ends.shape(1))});
            return sweep_cost_to_go(view(values), self, view(free), view(order), {poses, length});
          },
          "values"_a.noconvert(), "free"_a.noconvert(), "order"_a.noconvert(), "ends"_a.noconvert(),
          "length"_a, ReleaseGil(), "`values` are those of the table, to write to.");
  module.def(
      "mark_free",
      [](const Array<bool, 3>& free, Index first, Index last, double x, double y, double cell,
         const Footprint& footprint, const ConvexObstacles& walls) {
        mark_free(view(free), first, last, {{x, y}, cell}, footprint, walls);
      },
      "free"_a.noconvert(), "first"_a, "last"_a, "x"_a, "y"_a, "cell"_a, "footprint"_a, "walls"_a,
      ReleaseGil());
  module.def(
      "flood",
      [](const Flags2& open, double x, double y, double cell, const Floats<1>& goal, Index centre,
         const FloatsOut<2>& lengths) {
        Flood found;
        {
          nb::gil_scoped_release released;
          found = flood(view(open), {{x, y}, cell}, goal_region(goal), centre);
        }
        std::copy(found.lengths.begin(), found.lengths.end(), lengths.data());
        return copied(std::span<const Index>(found.order));
      },
      "open"_a.noconvert(), "x"_a, "y"_a, "cell"_a, "goal"_a.noconvert(), "centre"_a,
      "lengths"_a.noconvert(), kOwned);
}

template <InteractionModel M>
void bind_push_searches(nb::module_& module) {
  module.def(
      "push_search",
      [](PushTree& tree, const CostToGo& table, const Floats<1>& curvatures, double length,
         double inflation, double pruning_factor, const Floats<1>& masses, double bound,
         const PathProblem& problem, M& model, Index size) -> std::unique_ptr<PushSearch> {
        const Branching branching{view(curvatures), length, inflation, pruning_factor,
                                  view(masses)};
        return std::make_unique<PushSearchOver<M>>(
            PushLattice<M>(tree, table, branching, bound, problem, model), size);
      },
      "tree"_a, "table"_a, "curvatures"_a.noconvert(), "length"_a, "inflation"_a,
      "pruning_factor"_a, "masses"_a.noconvert(), "bound"_a, "problem"_a, "model"_a, "size"_a,
      nb::keep_alive<0, 1>(), nb::keep_alive<0, 2>(), nb::keep_alive<0, 3>(),
      nb::keep_alive<0, 7>(), nb::keep_alive<0, 9>(), nb::keep_alive<0, 10>(),
      "A search from the root of a planted tree; `size` is twice the nodes of the tree.");
  module.def(
      "grow",
      [](PushTree& tree, const Floats<2>& draws, double bound, double longest,
         const Floats<1>& scales, const PathProblem& problem, M& model) {
        const double* s = scales.data();
        const Growth found = grow(tree, rows_as<const GrowthDraw>(draws), bound, longest,
                                  {s[0], s[1], s[2]}, problem, model);
        return found.status == Growth::Status::kFull ? Index{-2} : found.node;
      },
      "tree"_a, "draws"_a.noconvert(), "bound"_a, "longest"_a, "scales"_a.noconvert(), "problem"_a,
      "model"_a, ReleaseGil(), "A node in the goal; -1: none; -2: memory is full.");
  module.def(
      "roll_objects",
      [](M& model, const Poses& start, const Rollouts& rollouts) {
        roll_objects(model, poses(start), rollouts);
      },
      "model"_a, "start"_a.noconvert(), "rollouts"_a, ReleaseGil());
}

void bind_push_aware(nb::module_& module) {
  nb::class_<PushTree>(module, "PushTree", "A search tree, in memory that is made once.")
      .def(
          "__init__",
          [](PushTree* self, Index nodes, Index objects, double memory, Index rows, Index columns,
             Index headings, Index signatures) {
            new (self) PushTree(nodes, objects, memory, {rows, columns, headings, signatures});
          },
          "nodes"_a, "objects"_a, "memory"_a, "rows"_a = 1, "columns"_a = 1, "headings"_a = 1,
          "signatures"_a = 1)
      .def(
          "set_cells",
          [](PushTree& self, Index rows, Index columns, Index headings, Index signatures) {
            self.set_cells({rows, columns, headings, signatures});
          },
          "rows"_a, "columns"_a, "headings"_a, "signatures"_a)
      .def(
          "plant",
          [](PushTree& self, const OnePose& root, const Poses& objects, double estimate) {
            self.plant(pose(root), poses(objects), estimate);
          },
          "pose"_a.noconvert(), "objects"_a.noconvert(), "estimate"_a)
      .def_prop_ro("count", &PushTree::count)
      .def_ro("full", &PushTree::full)
      .def_ro("driven", &PushTree::driven)
      .def(
          "cost", [](const PushTree& self, Index node) { return self[node].cost; }, "node"_a)
      .def(
          "arcs_to",
          [](const PushTree& self, Index node) {
            const std::vector<Arc> arcs = self.arcs_to(node);
            return copied_rows<double>(std::span<const Arc>(arcs));
          },
          "node"_a, kOwned);
  nb::class_<PushSearch>(module, "PushSearch", "A best-first search over arcs that push.")
      .def("run", &PushSearch::run, "budget"_a, ReleaseGil())
      .def_prop_ro(
          "goal", [](const PushSearch& self) { return self.goal() >> 1; },
          "The node of the tree in the goal, -1 before it is reached.");
}

void bind_rollouts(nb::module_& module) {
  nb::class_<RolloutProblem>(module, "RolloutProblem", "Robot, static obstacles and goal.")
      .def(
          "__init__",
          [](RolloutProblem* self, double period, Index substeps, const Floats<1>& limits,
             const Footprint& footprint, const ConvexObstacles& walls, const Floats<1>& goal,
             bool has_goal, double allowed) {
            new (self) RolloutProblem{
                period,    substeps, *reinterpret_cast<const DriveLimits*>(limits.data()),
                footprint, walls,    goal_region(goal),
                has_goal,  allowed};
          },
          "period"_a, "substeps"_a, "limits"_a.noconvert(), "footprint"_a, "walls"_a,
          "goal"_a.noconvert(), "has_goal"_a, "allowed"_a, nb::keep_alive<1, 5>(),
          nb::keep_alive<1, 6>());
  nb::class_<Rollouts>(module, "Rollouts", "Rollouts of poses among objects.")
      .def(
          "__init__",
          [](Rollouts* self, const FloatsOut<3>& paths, const FloatsOut<3>& twists,
             const IntegersOut<1>& ends, const IntegersOut<1>& outcomes,
             const FloatsOut<3>& objects, const FloatsOut<1>& works) {
            new (self) Rollouts{
                pose_rows(paths),
                {reinterpret_cast<DriveCommand*>(twists.data()),
                 {static_cast<Index>(twists.shape(0)), static_cast<Index>(twists.shape(1))}},
                view(ends),
                rows_as<RolloutOutcome>(outcomes),
                pose_rows(objects),
                view(works)};
          },
          "paths"_a.noconvert(), "twists"_a.noconvert(), "ends"_a.noconvert(),
          "outcomes"_a.noconvert(), "objects"_a.noconvert(), "works"_a.noconvert(),
          nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>(),
          nb::keep_alive<1, 5>(), nb::keep_alive<1, 6>(), nb::keep_alive<1, 7>());
  module.def(
      "roll_robots",
      [](const Floats<3>& controls, const OnePose& start, double speed, double turn_rate,
         const RolloutProblem& problem, const Rollouts& out) {
        const ArrayView<const DriveCommand, 2> commands(
            reinterpret_cast<const DriveCommand*>(controls.data()),
            {static_cast<Index>(controls.shape(0)), static_cast<Index>(controls.shape(1))});
        roll_robots(commands, pose(start), {speed, turn_rate}, problem, out);
      },
      "controls"_a.noconvert(), "start"_a.noconvert(), "speed"_a, "turn_rate"_a, "problem"_a,
      "out"_a, ReleaseGil());
}

void bind_ships(nb::module_& module) {
  module.def(
      "propose_change",
      [](const Poses& path, const Floats<1>& curvatures, const Floats<1>& draws,
         const Floats<1>& normals, const Floats<1>& problem, const PosesOut& out,
         const FloatsOut<1>& out_curvatures) {
        const double* p = problem.data();
        const ChangedPath changed = propose_change(
            {poses(path), view(curvatures)}, *reinterpret_cast<const ChangeDraw*>(draws.data()),
            *reinterpret_cast<const ChangeShift*>(normals.data()),
            {{p[0], p[1], p[3]}, p[2], p[4], {{p[5], p[6]}, {p[7], p[8]}}},
            {poses(out), view(out_curvatures)});
        return std::array{changed.first, changed.rest, changed.size};
      },
      "poses"_a.noconvert(), "curvatures"_a.noconvert(), "draws"_a.noconvert(),
      "normals"_a.noconvert(), "problem"_a.noconvert(), "out"_a.noconvert(),
      "out_curvatures"_a.noconvert(), ReleaseGil(),
      "`problem` is radius, spacing, spread, most turn, end fraction, and the goal line.");
  nb::class_<IceCostToGo>(module, "IceCostToGo", "Costs to the goal line if no floe moved.")
      .def(
          "__init__",
          [](IceCostToGo* self, const FloatsOut<3>& table, const FloatsOut<2>& field, double left,
             double low, double column, double row, double cell, double bow, double mass,
             double weight, double radius) {
            new (self) IceCostToGo{view(table), view(field), left, low,    column, row,
                                   cell,        bow,         mass, weight, radius};
          },
          "table"_a.noconvert(), "field"_a.noconvert(), "left"_a, "low"_a, "column"_a, "row"_a,
          "cell"_a, "bow"_a, "mass"_a, "weight"_a, "radius"_a, nb::keep_alive<1, 2>(),
          nb::keep_alive<1, 3>())
      .def(
          "fill_field",
          [](const IceCostToGo& self, const Poses& floes, const Floats<1>& radii,
             const Floats<1>& masses, double half_beam) {
            self.fill_field({poses(floes), view(radii), view(masses), half_beam});
          },
          "poses"_a.noconvert(), "radii"_a.noconvert(), "masses"_a.noconvert(), "half_beam"_a,
          ReleaseGil())
      .def("fill_table", &IceCostToGo::fill_table, ReleaseGil())
      .def(
          "mass_ahead",
          [](const IceCostToGo& self, double x, double y, double theta) {
            return self.mass_ahead({x, y, theta});
          },
          "x"_a, "y"_a, "theta"_a)
      .def(
          "cost_to_go",
          [](const IceCostToGo& self, double x, double y, double theta) {
            return self.cost_to_go({x, y, theta});
          },
          "x"_a, "y"_a, "theta"_a)
      .def(
          "cost_ahead",
          [](const IceCostToGo& self, const Floats<2>& arc, double step) {
            const CostAhead costs = cost_ahead(self, rows_as<const ArcPose>(arc), step);
            return std::pair(costs.work, costs.to_go);
          },
          "arc"_a.noconvert(), "step"_a)
      .def(
          "steer_on",
          [](const IceCostToGo& self, const OnePose& start, const Floats<1>& curvatures,
             double step, const FloatsOut<2>& out) {
            return steer_on(self, pose(start), view(curvatures), step, rows_as<ArcPose>(out));
          },
          "pose"_a.noconvert(), "curvatures"_a.noconvert(), "step"_a, "out"_a.noconvert(),
          ReleaseGil());
  module.def(
      "arc_ahead",
      [](double goal, const Floats<1>& low, const Floats<1>& high, const OnePose& start,
         double curvature, double step, const FloatsOut<2>& out) {
        const Box box{low.data()[0], low.data()[1], high.data()[0], high.data()[1]};
        return arc_ahead({goal, box}, pose(start), curvature, step, rows_as<ArcPose>(out));
      },
      "goal"_a, "low"_a.noconvert(), "high"_a.noconvert(), "pose"_a.noconvert(), "curvature"_a,
      "step"_a, "out"_a.noconvert());
}

}  // namespace

void bind_planners(nb::module_& module) {
  bind_cost_to_go(module);
  bind_push_aware(module);
  bind_rollouts(module);
  bind_push_searches<QuasiStatic>(module);
  bind_push_searches<IceInteraction>(module);
  bind_push_searches<CalledInteraction>(module);
  bind_ships(module);
}

}  // namespace pushplan::bindings
