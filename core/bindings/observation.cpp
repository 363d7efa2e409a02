#include "arrays.hpp"
#include "pushplan/observation/hidden.hpp"
#include "pushplan/observation/view.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

namespace {

using ImageOut = Array<std::uint8_t, 2>;

/// A view as `View.numbers` of Python gives it.
ImageView image_view(const Floats<1>& numbers) {
  const double* n = numbers.data();
  return {{n[0], n[1], n[2]}, n[3], n[4], n[5], n[6]};
}

}  // namespace

void bind_observation(nb::module_& module) {
  module.def(
      "to_pixels",
      [](const Floats<1>& view, const Points& world, const FloatsOut<2>& out) {
        to_pixels(image_view(view), points(world), reinterpret_cast<Vec2*>(out.data()));
      },
      "view"_a.noconvert(), "points"_a.noconvert(), "out"_a.noconvert());
  module.def(
      "fill_parts",
      [](const ImageOut& image, const Floats<1>& numbers, const Points& vertices,
         const Integers<1>& offsets, std::uint8_t value) {
        fill_parts(view(image), image_view(numbers), {points(vertices), view(offsets)}, value);
      },
      "image"_a.noconvert(), "view"_a.noconvert(), "vertices"_a.noconvert(),
      "offsets"_a.noconvert(), "value"_a, ReleaseGil());
  module.def(
      "fill_bodies",
      [](const ImageOut& image, const Floats<1>& numbers, const Poses& bodies,
         const Points& vertices, const Integers<1>& offsets, const Floats<1>& radii,
         std::uint8_t value) {
        fill_bodies(view(image), image_view(numbers), poses(bodies),
                    {points(vertices), view(offsets)}, view(radii), value);
      },
      "image"_a.noconvert(), "view"_a.noconvert(), "poses"_a.noconvert(), "vertices"_a.noconvert(),
      "offsets"_a.noconvert(), "radii"_a.noconvert(), "value"_a, ReleaseGil());
  module.def(
      "sample",
      [](const ImageOut& image, const Floats<1>& numbers,
         const Array<const std::uint8_t, 2>& values, double x, double y, double step) {
        sample_raster(view(image), image_view(numbers), {view(values), {x, y}, step});
      },
      "image"_a.noconvert(), "view"_a.noconvert(), "values"_a.noconvert(), "x"_a, "y"_a, "step"_a,
      ReleaseGil());
  module.def(
      "fill_hidden",
      [](const ImageOut& image, const Floats<1>& numbers, double x, double y, const Points& loops,
         const Integers<1>& offsets, const Array<const float, 3>& table, const Floats<1>& origin,
         double step, const Integers<1>& bends, const Floats<1>& lengths, double per_metre) {
        fill_hidden(view(image), image_view(numbers), {x, y},
                    {{points(loops), view(offsets)},
                     view(table),
                     {origin.data()[0], origin.data()[1]},
                     step,
                     view(bends),
                     view(lengths)},
                    per_metre);
      },
      "image"_a.noconvert(), "view"_a.noconvert(), "x"_a, "y"_a, "loops"_a.noconvert(),
      "offsets"_a.noconvert(), "table"_a.noconvert(), "origin"_a.noconvert(), "step"_a,
      "bends"_a.noconvert(), "lengths"_a.noconvert(), "per_metre"_a, ReleaseGil());
}

}  // namespace pushplan::bindings
