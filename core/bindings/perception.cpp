#include <nanobind/stl/tuple.h>

#include "arrays.hpp"
#include "pushplan/perception/rays.hpp"
#include "pushplan/perception/scan_marking.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

void bind_perception(nb::module_& module) {
  module.def(
      "cast_rays",
      [](const FloatsOut<1>& lengths, double x, double y, double heading, const Points& vertices,
         const Integers<1>& offsets) {
        require_room("lengths", lengths.shape(0), 1);
        cast_rays(view(lengths), {x, y, heading}, polygons(vertices, offsets));
      },
      "lengths"_a, "x"_a, "y"_a, "heading"_a, "vertices"_a, "offsets"_a, ReleaseGil());
  module.def(
      "mark_scan",
      [](const FloatsOut<2>& values, double corner_x, double corner_y, double side, double x,
         double y, const Floats<1>& bearings, const Floats<1>& passed, const Floats<1>& hits,
         const Floats<1>& evidence, bool averaged) {
        require_count("passed", passed.shape(0), bearings.shape(0));
        require_count("hits", hits.shape(0), bearings.shape(0));
        require_count("evidence", evidence.shape(0), Index{4});
        for (const double value : {corner_x, corner_y, x, y}) require_finite("places", value);
        if (!(side > 0.0)) refuse("side", std::to_string(side), "positive");
        const std::span<const double> odds = view(evidence);
        const CellWindow window =
            mark_scan({view(values), {corner_x, corner_y}, side}, {x, y}, view(bearings),
                      view(passed), view(hits), {odds[0], odds[1], odds[2], odds[3], averaged});
        return std::tuple{window.row, window.column, window.end_row, window.end_column};
      },
      "values"_a, "corner_x"_a, "corner_y"_a, "side"_a, "x"_a, "y"_a, "bearings"_a, "passed"_a,
      "hits"_a, "evidence"_a, "averaged"_a, ReleaseGil());
}

}  // namespace pushplan::bindings
