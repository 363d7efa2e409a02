#include "arrays.hpp"
#include "pushplan/learned/rays.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

void bind_learned(nb::module_& module) {
  module.def(
      "cast_rays",
      [](const FloatsOut<1>& lengths, double x, double y, double heading, const Points& vertices,
         const Integers<1>& offsets) {
        require_room("lengths", lengths.shape(0), 1);
        cast_rays(view(lengths), {x, y, heading}, polygons(vertices, offsets));
      },
      "lengths"_a.noconvert(), "x"_a, "y"_a, "heading"_a, "vertices"_a.noconvert(),
      "offsets"_a.noconvert(), ReleaseGil());
}

}  // namespace pushplan::bindings
