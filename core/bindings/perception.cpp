#include <nanobind/stl/array.h>

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
      "lengths"_a.noconvert(), "x"_a, "y"_a, "heading"_a, "vertices"_a.noconvert(),
      "offsets"_a.noconvert(), ReleaseGil());
  module.def(
      "mark_scan",
      [](const FloatsOut<2>& values, double corner_x, double corner_y, double side, double x,
         double y, const Floats<1>& bearings, const Floats<1>& passed, const Floats<1>& hits,
         const std::array<double, 4>& evidence) {
        require_count("passed", passed.shape(0), bearings.shape(0));
        require_count("hits", hits.shape(0), bearings.shape(0));
        const auto [hit, miss, lowest, highest] = evidence;
        mark_scan({view(values), {corner_x, corner_y}, side}, {x, y}, view(bearings), view(passed),
                  view(hits), {hit, miss, lowest, highest});
      },
      "values"_a.noconvert(), "corner_x"_a, "corner_y"_a, "side"_a, "x"_a, "y"_a,
      "bearings"_a.noconvert(), "passed"_a.noconvert(), "hits"_a.noconvert(), "evidence"_a,
      ReleaseGil());
}

}  // namespace pushplan::bindings
