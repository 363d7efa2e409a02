#include "arrays.hpp"
#include "pushplan/scenarios/floes.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

namespace {

/// (K, N, 2) numbers as K rows of N points.
template <class Point, class Array>
ArrayView<Point, 2> corner_rows(const Array& array) {
  return {reinterpret_cast<Point*>(array.data()),
          {static_cast<Index>(array.shape(0)), static_cast<Index>(array.shape(1))}};
}

Outlines outlines(const Floats<3>& corners, const Integers<1>& counts) {
  return {corner_rows<const Vec2>(corners), view(counts)};
}

OutlinesOut outlines_out(const FloatsOut<3>& corners, const IntegersOut<1>& counts) {
  return {corner_rows<Vec2>(corners), view(counts)};
}

}  // namespace

void bind_scenarios(nb::module_& module) {
  module.attr("FLOE_CORNERS") = kFloeCorners;

  nb::class_<IceWater>(module, "IceWater", "A rectangle of water with regions to stay off.")
      .def(
          "__init__",
          [](IceWater* self, const Floats<1>& box, const Points& blocks,
             const Integers<1>& block_offsets, double gap) {
            const double* b = box.data();
            new (self) IceWater{b[0], b[1], b[2], b[3], {points(blocks), view(block_offsets)}, gap};
          },
          "box"_a.noconvert(), "blocks"_a.noconvert(), "block_offsets"_a.noconvert(), "gap"_a,
          nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>());

  module.def(
      "cut_cells",
      [](const Points& centres, const Floats<1>& radii, const Floats<1>& reaches,
         const Integers<1>& neighbours, const Integers<1>& neighbour_offsets,
         const IceWater& water, const FloatsOut<3>& corners, const IntegersOut<1>& counts) {
        cut_cells({points(centres), view(radii), view(reaches), view(neighbours),
                   view(neighbour_offsets)},
                  water, outlines_out(corners, counts));
      },
      "centres"_a.noconvert(), "radii"_a.noconvert(), "reaches"_a.noconvert(),
      "neighbours"_a.noconvert(), "neighbour_offsets"_a.noconvert(), "water"_a,
      "corners"_a.noconvert(), "counts"_a.noconvert(), ReleaseGil());

  module.def(
      "fit_floes",
      [](const Floats<3>& shapes, const Integers<1>& shape_counts, const Points& centres,
         const Floats<3>& cells, const Integers<1>& cell_counts, const Floats<1>& targets,
         double stretch, const FloatsOut<3>& corners, const IntegersOut<1>& counts) {
        fit_floes(outlines(shapes, shape_counts), points(centres), outlines(cells, cell_counts),
                  view(targets), stretch, outlines_out(corners, counts));
      },
      "shapes"_a.noconvert(), "shape_counts"_a.noconvert(), "centres"_a.noconvert(),
      "cells"_a.noconvert(), "cell_counts"_a.noconvert(), "targets"_a.noconvert(), "stretch"_a,
      "corners"_a.noconvert(), "counts"_a.noconvert(), ReleaseGil());

  module.def(
      "place_discs",
      [](const Floats<1>& radii, const Floats<3>& draws, const Floats<2>& density,
         const IceWater& water, const FloatsOut<2>& centres) {
        return place_discs(view(radii), view(draws), view(density), water, rows_as<Vec2>(centres));
      },
      "radii"_a.noconvert(), "draws"_a.noconvert(), "density"_a.noconvert(), "water"_a,
      "centres"_a.noconvert(), ReleaseGil());
}

}  // namespace pushplan::bindings
