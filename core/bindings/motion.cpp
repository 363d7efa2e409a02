#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>

#include <algorithm>
#include <cmath>

#include "arrays.hpp"
#include "goal.hpp"
#include "pushplan/motion/goal_region.hpp"
#include "pushplan/motion/reeds_shepp.hpp"
#include "pushplan/motion/state_lattice/cost_map.hpp"
#include "pushplan/motion/state_lattice/place_costs.hpp"
#include "pushplan/motion/state_lattice/pose_lattice.hpp"
#include "pushplan/motion/state_lattice/primitives.hpp"
#include "pushplan/motion/state_lattice/swaths.hpp"
#include "pushplan/search/astar.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

namespace {

using Corner = Exact<const Index, nb::shape<2>>;
using LatticeSearch = AStar<PoseLattice>;

PathBuffer buffer(const PosesOut& out, const FloatsOut<1>& curvatures) {
  require_count("curvatures", curvatures.shape(0), out.shape(0));
  return {poses(out), view(curvatures)};
}

using FiveArcs = Exact<double, nb::shape<5, 2>>;

/// The numbers of `PoseLattice.goal` of Python.
LatticeGoal lattice_goal(const Numbers<4>& numbers) {
  const double* n = numbers.data();
  return {n[0] == 0.0, n[1], n[2], n[3]};
}

void bind_paths(nb::module_& module) {
  module.def(
      "shortest_curve",
      [](const OnePose& start, const OnePose& end, double radius, bool reverses,
         const FiveArcs& arcs) {
        const ShortestCurve curve = shortest_curve(pose(start), pose(end), radius, reverses);
        std::copy(curve.arcs.begin(), curve.arcs.end(), reinterpret_cast<Arc*>(arcs.data()));
        return curve.length;
      },
      "start"_a, "end"_a, "radius"_a, "reverses"_a, "arcs"_a);
  module.def(
      "along_arc",
      [](const OnePose& start, double length, double curvature, const OnePoseOut& out) {
        *reinterpret_cast<Pose*>(out.data()) = along_arc(pose(start), {length, curvature});
      },
      "start"_a, "length"_a, "curvature"_a, "out"_a);
  module.def(
      "sample_pieces",
      [](const OnePose& start, const Floats<2>& arcs, double spacing, const PosesOut& out,
         const FloatsOut<1>& curvatures) {
        return sample_arcs(pose(start), rows_as<const Arc>(arcs), spacing, buffer(out, curvatures));
      },
      "start"_a, "pieces"_a, "spacing"_a, "out"_a, "curvatures"_a);
  module.def(
      "in_goal",
      [](double x, double y, const Numbers<5>& goal) { return goal_region(goal).contains({x, y}); },
      "x"_a, "y"_a, "goal"_a);
  module.def(
      "goal_is_outside",
      [](const Numbers<5>& goal, const Numbers<4>& bounds) {
        return goal_region(goal).is_outside(*reinterpret_cast<const Box*>(bounds.data()));
      },
      "goal"_a, "bounds"_a);
}

/// Requires a place on a map that may be large, but not so large that its cells cannot be counted.
void require_countable(double place) {
  constexpr double kMost = 1e7;
  if (!(std::abs(place) <= kMost)) refuse("outlines", std::to_string(place), "within 1e7 cells");
}

void bind_maps(nb::module_& module) {
  module.def(
      "add_floes",
      [](const Points& outlines, const Integers<1>& offsets, const Points& centres,
         const Floats<1>& radii, const Floats<1>& totals, double exponent, double soft,
         const FloatsOut<2>& grid) {
        const Polygons floes = polygons(outlines, offsets);
        require_count("centres", centres.shape(0), floes.count());
        require_count("radii", radii.shape(0), floes.count());
        require_count("totals", totals.shape(0), floes.count());
        for (Index k = 0; k < floes.count(); ++k) {  // and not all corners, which may be many more
          for (const Vec2 corner : floes[k]) {
            require_countable(corner.x);
            require_countable(corner.y);
          }
        }
        add_floes({floes, points(centres), view(radii), {view(totals), exponent, soft}},
                  view(grid));
      },
      "outlines"_a, "offsets"_a, "centres"_a, "radii"_a, "totals"_a, "exponent"_a, "soft"_a,
      "grid"_a, ReleaseGil());
  module.def(
      "block",
      [](const Points& outlines, const Integers<1>& offsets, double margin,
         const FloatsOut<2>& grid) {
        block_cells(polygons(outlines, offsets), margin, view(grid));
      },
      "outlines"_a, "offsets"_a, "margin"_a, "grid"_a, ReleaseGil());
  module.def(
      "prefix_sums",
      [](const Floats<2>& grid, const FloatsOut<2>& sums) {
        require_count("sums", sums.shape(0), grid.shape(1));
        require_count("columns of sums", sums.shape(1), grid.shape(0) + 1);
        prefix_sums(view(grid), view(sums));
      },
      "grid"_a, "sums"_a, ReleaseGil());
  module.def(
      "place_costs",
      [](const Floats<2>& sums, const Integers<1>& rows, Index goal_row, const Integers<1>& columns,
         std::pair<Index, Index> between, Index half, Index reach, Index along, Index stage,
         double factor, double cell, double lean, const FloatsOut<2>& costs) {
        place_costs(view(sums),
                    {view(rows), view(columns), goal_row, between.first, between.second},
                    {half, reach, along, stage, factor, cell, lean}, view(costs));
      },
      "sums"_a, "rows"_a, "goal_row"_a, "columns"_a, "between"_a, "half"_a, "reach"_a, "along"_a,
      "stage"_a, "factor"_a, "cell"_a, "lean"_a, "costs"_a, ReleaseGil());
}

constexpr Index kMostReach = 10'000;  // of primitives [steps]; 8 are usual

void bind_primitives(nb::module_& module) {
  module.def(
      "fill_connections",
      [](double heading, double target, double radius, Index reach, double slack,
         const FloatsOut<2>& out) {
        require_between("reach", reach, 0, kMostReach);
        return find_connections(heading, target, {radius, reach, slack},
                                rows_as<LatticeConnection>(out));
      },
      "heading"_a, "target"_a, "radius"_a, "reach"_a, "slack"_a, "out"_a, ReleaseGil());
  module.def(
      "primitive_boxes",
      [](const Floats<1>& headings, const Floats<3>& pieces, const Floats<1>& lengths,
         const FloatsOut<2>& boxes) {
        require_count("pieces", pieces.shape(0), headings.shape(0));
        require_count("lengths", lengths.shape(0), headings.shape(0));
        require_count("boxes", boxes.shape(0), headings.shape(0));
        primitive_boxes(view(headings), rows_as<const std::array<Arc, 3>>(pieces), view(lengths),
                        rows_as<OriginBox>(boxes));
      },
      "headings"_a, "pieces"_a, "lengths"_a, "boxes"_a, ReleaseGil());
  module.def(
      "sweep_cells",
      [](double heading, const Floats<2>& pieces, const Points& vertices,
         const Integers<1>& offsets, double reach, double spacing) {
        std::vector<ColumnRun> runs;
        {
          nb::gil_scoped_release released;
          runs = sweep_cells(heading, rows_as<const Arc>(pieces), polygons(vertices, offsets),
                             reach, spacing);
        }
        return copied_rows<Index>(std::span<const ColumnRun>(runs));
      },
      "heading"_a, "pieces"_a, "vertices"_a, "offsets"_a, "reach"_a, "spacing"_a, kOwned);
}

Index node_count(const PoseLattice& lattice) {
  return (static_cast<Index>(lattice.first.size()) - 1) * lattice.rows * lattice.columns;
}

void require_node(const PoseLattice& lattice, Index node) {
  require_index("node", node, node_count(lattice));
}

void bind_lattice(nb::module_& module) {
  nb::class_<PoseLattice>(module, "PoseLattice", "Places and headings joined by motion primitives.")
      .def(
          "__init__",
          [](PoseLattice* self, Index rows, Index columns, double step, Index cells,
             const Corner& corner, const Integers<1>& first, const Integers<2>& ends,
             const Floats<1>& lengths, const Floats<2>& boxes, const Integers<1>& run_first,
             const Integers<2>& runs, const Floats<1>& cost_sums, const Floats<1>& blocked_sums,
             Index stride, const Floats<2>& planes, const Numbers<4>& goal,
             const Floats<2>& row_bounds, const Floats<2>& place_costs, double inflation) {
            new (self) PoseLattice{rows,
                                   columns,
                                   step,
                                   cells,
                                   corner.data()[0],
                                   corner.data()[1],
                                   view(first),
                                   rows_as<const PrimitiveEnd>(ends),
                                   view(lengths),
                                   rows_as<const OriginBox>(boxes),
                                   view(run_first),
                                   rows_as<const SwathRun>(runs),
                                   view(cost_sums),
                                   view(blocked_sums),
                                   stride,
                                   rows_as<const OriginLimit>(planes),
                                   lattice_goal(goal),
                                   view(row_bounds),
                                   view(place_costs),
                                   inflation};
          },
          "rows"_a, "columns"_a, "step"_a, "cells"_a, "corner"_a, "first"_a, "ends"_a, "lengths"_a,
          "boxes"_a, "run_first"_a, "runs"_a, "cost_sums"_a, "blocked_sums"_a, "stride"_a,
          "planes"_a, "goal"_a, "row_bounds"_a, "place_costs"_a, "inflation"_a,
          nb::keep_alive<1, 7>(), nb::keep_alive<1, 8>(), nb::keep_alive<1, 9>(),
          nb::keep_alive<1, 10>(), nb::keep_alive<1, 11>(), nb::keep_alive<1, 12>(),
          nb::keep_alive<1, 13>(), nb::keep_alive<1, 14>(), nb::keep_alive<1, 16>(),
          nb::keep_alive<1, 18>(), nb::keep_alive<1, 19>())
      .def(
          "successors",
          [](const PoseLattice& self, Index node, const IntegersOut<1>& nodes,
             const FloatsOut<1>& costs, const IntegersOut<1>& edges) {
            require_node(self, node);
            const auto heading = static_cast<std::size_t>(self.place_of(node).heading);
            const auto most =
                static_cast<std::size_t>(self.first[heading + 1] - self.first[heading]);
            require_room("nodes", nodes.shape(0), most);
            require_room("costs", costs.shape(0), most);
            require_room("edges", edges.shape(0), most);
            Index count = 0;
            self.expand(node, [&](Index successor, double cost, Index edge) {
              nodes.data()[count] = successor;
              costs.data()[count] = cost;
              edges.data()[count] = edge;
              ++count;
            });
            return count;
          },
          "node"_a, "nodes"_a, "costs"_a, "edges"_a)
      .def(
          "place_of",
          [](const PoseLattice& self, Index node) {
            require_node(self, node);
            const auto [heading, row, column] = self.place_of(node);
            return std::tuple(heading, row, column);
          },
          "node"_a, "Heading, row and column of a node.")
      .def(
          "estimate",
          [](const PoseLattice& self, Index node) {
            require_node(self, node);
            return self.estimate(node);
          },
          "node"_a)
      .def(
          "is_goal",
          [](const PoseLattice& self, Index node) {
            require_node(self, node);
            return self.is_goal(node);
          },
          "node"_a)
      .def(
          "within",
          [](const PoseLattice& self, Index u, Index v, const Numbers<4>& box) {
            return within(self.planes, u, v, *reinterpret_cast<const OriginBox*>(box.data()));
          },
          "row"_a, "column"_a, "box"_a);
  module.def(
      "swath_sum",
      [](const Floats<1>& sums, const Integers<2>& runs, Index begin, Index end, Index at) {
        const auto all = rows_as<const SwathRun>(runs);
        require_between("end", end, 0, static_cast<Index>(all.size()));
        require_between("begin", begin, 0, end);
        return swath_sum(
            view(sums),
            all.subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin)),
            at);
      },
      "sums"_a, "runs"_a, "begin"_a, "end"_a, "at"_a);

  nb::class_<LatticeSearch>(module, "LatticeSearch", "A* over a `PoseLattice`.")
      .def(
          "__init__",
          [](LatticeSearch* self, const PoseLattice& lattice, Index size) {
            require_room("size", static_cast<std::size_t>(std::max(size, Index{0})),
                         static_cast<std::size_t>(node_count(lattice)));
            new (self) LatticeSearch(lattice, size);
          },
          "lattice"_a, "size"_a, nb::keep_alive<1, 2>())
      .def(
          "restart",
          [](LatticeSearch& self, const PoseLattice& lattice) {
            require_between("nodes", node_count(lattice), 0, self.tree().size());
            self.restart(lattice);
          },
          "lattice"_a, nb::keep_alive<1, 2>())
      .def(
          "start",
          [](LatticeSearch& self, Index node, double cost, double bound, Index edge) {
            require_index("node", node, self.tree().size());
            self.start(node, cost, bound, edge);
          },
          "node"_a, "cost"_a = 0.0, "bound"_a = 0.0, "edge"_a = -1)
      .def("run", &LatticeSearch::run, "budget"_a, ReleaseGil())
      .def_prop_ro("goal", &LatticeSearch::goal)
      .def_prop_ro("cost", &LatticeSearch::cost)
      .def_prop_ro(
          "tree", [](LatticeSearch& self) -> SearchTree& { return self.tree(); },
          nb::rv_policy::reference_internal);
}

}  // namespace

void bind_motion(nb::module_& module) {
  bind_paths(module);
  bind_maps(module);
  bind_primitives(module);
  bind_lattice(module);
}

}  // namespace pushplan::bindings
