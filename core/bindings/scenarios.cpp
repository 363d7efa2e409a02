#include <nanobind/stl/tuple.h>

#include <tuple>
#include <vector>

#include "arrays.hpp"
#include "pushplan/scenarios/floes.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

namespace {

/// K outlines whose corners fit into a buffer.
Outlines outlines(const Floats<3>& corners, const Integers<1>& counts, std::size_t count) {
  require_count("outlines", corners.shape(0), count);
  require_count("counts", counts.shape(0), count);
  for (const Index used : view(counts)) {
    require_between("counts", used, 0, static_cast<Index>(corners.shape(1)));
    require_between("counts", used, 0, kFloeCorners);
  }
  return {grid_as<const Vec2>(corners), view(counts)};
}

/// Outlines to be filled and returned.
struct NewOutlines {
  explicit NewOutlines(std::size_t count)
      : corners(zeros<double, 3>({count, kFloeCorners, 2})), counts(zeros<Index, 1>({count})) {}

  OutlinesOut out() const { return {grid_as<Vec2>(corners), view(counts)}; }
  auto arrays() const { return std::tuple(corners, counts); }

  NewArray<double, 3> corners;
  NewArray<Index, 1> counts;
};

}  // namespace

void bind_scenarios(nb::module_& module) {
  nb::class_<IceWater>(module, "IceWater", "A rectangle of water with regions to stay off.")
      .def(
          "__init__",
          [](IceWater* self, const Numbers<4>& box, const Points& blocks,
             const Integers<1>& block_offsets, double gap) {
            const double* b = box.data();
            new (self) IceWater{b[0], b[1], b[2], b[3], polygons(blocks, block_offsets), gap};
          },
          "box"_a, "blocks"_a, "block_offsets"_a, "gap"_a, nb::keep_alive<1, 3>(),
          nb::keep_alive<1, 4>())
      .def_ro("gap", &IceWater::gap, "Least distance between floes, and to the regions [m].");

  module.def(
      "cut_cells",
      [](const Points& centres, const Floats<1>& radii, const Floats<1>& reaches,
         const Integers<1>& neighbours, const Integers<1>& neighbour_offsets,
         const IceWater& water) {
        const std::size_t count = centres.shape(0);
        require_count("radii", radii.shape(0), count);
        require_count("reaches", reaches.shape(0), count);
        require_count("neighbour_offsets", neighbour_offsets.shape(0), count + 1);
        require_offsets("neighbour_offsets", view(neighbour_offsets), neighbours.shape(0));
        require_indices("neighbours", view(neighbours), static_cast<Index>(count));
        const NewOutlines cells(count);
        const OutlinesOut out = cells.out();
        {
          nb::gil_scoped_release release;
          cut_cells({points(centres), view(radii), view(reaches), view(neighbours),
                     view(neighbour_offsets)},
                    water, out);
        }
        return cells.arrays();
      },
      "centres"_a, "radii"_a, "reaches"_a, "neighbours"_a, "neighbour_offsets"_a, "water"_a,
      "Cells of a power diagram (Laguerre tessellation), half a gap smaller on every side: corners "
      "in rows of equal length, and how many of each row are in use.");

  module.def(
      "fit_floes",
      [](const Floats<3>& shapes, const Integers<1>& shape_counts, const Points& centres,
         const Floats<3>& cells, const Integers<1>& cell_counts, const Floats<1>& targets,
         double stretch) {
        const std::size_t count = centres.shape(0);
        require_count("targets", targets.shape(0), count);
        const NewOutlines floes(count);
        const Outlines all_shapes = outlines(shapes, shape_counts, count);
        const Outlines all_cells = outlines(cells, cell_counts, count);
        const OutlinesOut out = floes.out();
        {
          nb::gil_scoped_release release;
          fit_floes(all_shapes, points(centres), all_cells, view(targets), stretch, out);
        }
        return floes.arrays();
      },
      "shapes"_a, "shape_counts"_a, "centres"_a, "cells"_a, "cell_counts"_a, "targets"_a,
      "stretch"_a,
      "Shapes of area 1 grown within their cells until they have their target areas, or cannot "
      "grow further.");

  module.def(
      "place_discs",
      [](const Floats<1>& radii, const Floats<3>& draws, const Floats<2>& density,
         const IceWater& water) {
        require_room("radii", radii.shape(0), 1);
        require_count("draws", draws.shape(0), radii.shape(0));
        require_count("columns of draws", draws.shape(2), std::size_t{3});
        require_room("density", density.size(), 1);
        std::vector<Vec2> centres(radii.shape(0));
        {
          nb::gil_scoped_release release;
          const Index placed = place_discs(view(radii), view(draws), view(density), water, centres);
          centres.resize(static_cast<std::size_t>(placed));
        }
        return copied_rows<double>(std::span<const Vec2>(centres));
      },
      "radii"_a, "draws"_a, "density"_a, "water"_a,
      "(J, 2) centres of the first J discs, largest first, which found a place.");
}

}  // namespace pushplan::bindings
