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
  nb::class_<CostToGoMaker>(module, "CostToGo", "A table of lengths to the goal, made in steps.")
      .def(
          "__init__",
          [](CostToGoMaker* self, const Footprint& footprint, const ConvexObstacles& walls,
             const Numbers<5>& goal, double size, double radius) {
            if (!(radius > 0.0)) refuse("radius", std::to_string(radius), "positive");
            new (self) CostToGoMaker(footprint, walls, goal_region(goal), size, radius);
          },
          "footprint"_a, "walls"_a, "goal"_a.noconvert(), "size"_a, "radius"_a,
          nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>())
      .def_prop_ro("useful", &CostToGoMaker::useful)
      .def_prop_ro("done", &CostToGoMaker::done)
      .def("step", &CostToGoMaker::step, ReleaseGil())
      .def_prop_ro("shape",
                   [](const CostToGoMaker& self) {
                     const CostToGo table = self.table();
                     return std::tuple(table.rows(), table.columns(), table.headings());
                   })
      .def_prop_ro("cell", [](const CostToGoMaker& self) { return self.table().cells.step; })
      .def(
          "length_to_go",
          [](const CostToGoMaker& self, double x, double y, double theta) {
            return self.table().length_to_go({x, y, theta});
          },
          "x"_a, "y"_a, "theta"_a);
}

constexpr Index kMostNodes = Index{1} << 31;  // of a tree

/// Requires a tree that has a root, and a model of as many objects.
template <InteractionModel M>
void require_planted(const PushTree& tree, const M& model) {
  require_room("nodes of the tree", static_cast<std::size_t>(tree.count()), 1);
  require_count("objects of the tree", tree.objects(0).size(), model.radii().size());
}

/// The shape of cells of a tree.
PushTree::CellShape cell_shape(Index rows, Index columns, Index headings, Index signatures) {
  constexpr Index kMost = 30'000;  // so that their product is an Index
  require_between("rows", rows, 1, kMost);
  require_between("columns", columns, 1, kMost);
  require_between("headings", headings, 1, kMost);
  require_between("signatures", signatures, 1, kMost);
  return {rows, columns, headings, signatures};
}

template <InteractionModel M>
void bind_push_searches(nb::module_& module) {
  module.def(
      "push_search",
      [](PushTree& tree, const CostToGoMaker& maker, const Floats<1>& curvatures, double length,
         double inflation, double pruning_factor, const Floats<1>& masses, double bound,
         const PathProblem& problem, M& model, Index size) -> std::unique_ptr<PushSearch> {
        const CostToGo table = maker.table();
        require_planted(tree, model);
        require_count("masses", masses.shape(0), model.radii().size());
        require_between("size", size, 2 * tree.capacity(), 2 * kMostNodes);
        require_between("rows of the table", table.rows(), 1, tree.cells().rows);
        require_between("columns of the table", table.columns(), 1, tree.cells().columns);
        require_between("headings of the table", table.headings(), 1, tree.cells().headings);
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
         const Numbers<3>& scales, const PathProblem& problem, M& model) {
        require_planted(tree, model);
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
        const std::size_t count = model.radii().size();
        require_count("start", start.shape(0), count);
        require_count("objects", count, rollouts.objects.extent(1));
        require_indices("ends", rollouts.ends, rollouts.paths.extent(1));
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
            require_between("nodes", nodes, 1, kMostNodes);
            require_between("objects", objects, 0, kMostNodes);
            require_not_negative("memory", memory);
            require_finite("memory", memory);
            new (self)
                PushTree(nodes, objects, memory, cell_shape(rows, columns, headings, signatures));
          },
          "nodes"_a, "objects"_a, "memory"_a, "rows"_a = 1, "columns"_a = 1, "headings"_a = 1,
          "signatures"_a = 1)
      .def(
          "set_cells",
          [](PushTree& self, Index rows, Index columns, Index headings, Index signatures) {
            self.set_cells(cell_shape(rows, columns, headings, signatures));
          },
          "rows"_a, "columns"_a, "headings"_a, "signatures"_a)
      .def(
          "plant",
          [](PushTree& self, const OnePose& root, const Poses& objects, double estimate) {
            require_count("objects", objects.shape(0), self.objects(0).size());
            self.plant(pose(root), poses(objects), estimate);
          },
          "pose"_a.noconvert(), "objects"_a.noconvert(), "estimate"_a)
      .def_prop_ro("count", &PushTree::count)
      .def_ro("full", &PushTree::full)
      .def_ro("driven", &PushTree::driven)
      .def(
          "cost",
          [](const PushTree& self, Index node) {
            require_index("node", node, self.count());
            return self[node].cost;
          },
          "node"_a)
      .def(
          "arcs_to",
          [](const PushTree& self, Index node) {
            require_index("node", node, self.count());
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
          "period"_a, "substeps"_a, "limits"_a.noconvert(), "footprint"_a, "walls"_a,
          "goal"_a.noconvert(), "has_goal"_a, "allowed"_a, nb::keep_alive<1, 5>(),
          nb::keep_alive<1, 6>());
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
          "paths"_a.noconvert(), "twists"_a.noconvert(), "ends"_a.noconvert(),
          "outcomes"_a.noconvert(), "objects"_a.noconvert(), "works"_a.noconvert(),
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
      "controls"_a.noconvert(), "start"_a.noconvert(), "speed"_a, "turn_rate"_a, "problem"_a,
      "out"_a, ReleaseGil());
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
            for (const std::size_t axis : {0, 1, 2}) require_room("table", table.shape(axis), 2);
            for (const std::size_t axis : {0, 1}) require_room("field", field.shape(axis), 2);
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
            require_count("radii", radii.shape(0), floes.shape(0));
            require_count("masses", masses.shape(0), floes.shape(0));
            self.fill_field({poses(floes), view(radii), view(masses), half_beam});
          },
          "poses"_a.noconvert(), "radii"_a.noconvert(), "masses"_a.noconvert(), "half_beam"_a,
          ReleaseGil())
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
          "arc"_a.noconvert(), "step"_a)
      .def(
          "steer_on",
          [](const IceCostToGo& self, const OnePose& start, const Floats<1>& curvatures,
             double step, const FloatsOut<2>& out) {
            require_room("curvatures", curvatures.shape(0), 1);
            return steer_on(self, pose(start), view(curvatures), step, rows_as<ArcPose>(out));
          },
          "pose"_a.noconvert(), "curvatures"_a.noconvert(), "step"_a, "out"_a.noconvert(),
          ReleaseGil());
  module.def(
      "arc_ahead",
      [](double goal, const Numbers<2>& low, const Numbers<2>& high, const OnePose& start,
         double curvature, double step, const FloatsOut<2>& out) {
        require_room("out", out.shape(0), 1);
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
