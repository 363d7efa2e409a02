#include "arrays.hpp"
#include "pushplan/observation/hidden.hpp"
#include "pushplan/observation/view.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

namespace {

using ImageOut = Array<std::uint8_t, 2>;

/// A view as `View.numbers` of Python gives it.
ImageView image_view(const Numbers<7>& numbers) {
  const double* n = numbers.data();
  return {{n[0], n[1], n[2]}, n[3], n[4], n[5], n[6]};
}

}  // namespace

void bind_observation(nb::module_& module) {
  module.def(
      "to_pixels",
      [](const Numbers<7>& view, const Points& world, const PointsOut& out) {
        to_pixels(image_view(view), points(world), points_out(out, world.shape(0)));
      },
      "view"_a, "points"_a, "out"_a);
  module.def(
      "fill_parts",
      [](const ImageOut& image, const Numbers<7>& numbers, const Points& vertices,
         const Integers<1>& offsets, std::uint8_t value) {
        fill_parts(view(image), image_view(numbers), polygons(vertices, offsets), value);
      },
      "image"_a, "view"_a, "vertices"_a, "offsets"_a, "value"_a, ReleaseGil());
  module.def(
      "fill_bodies",
      [](const ImageOut& image, const Numbers<7>& numbers, const Poses& bodies,
         const Points& vertices, const Integers<1>& offsets, const Floats<1>& radii,
         std::uint8_t value) {
        const Polygons outlines = polygons(vertices, offsets);
        require_count("poses", bodies.shape(0), outlines.count());
        require_count("radii", radii.shape(0), outlines.count());
        fill_bodies(view(image), image_view(numbers), poses(bodies), outlines, view(radii), value);
      },
      "image"_a, "view"_a, "poses"_a, "vertices"_a, "offsets"_a, "radii"_a, "value"_a,
      ReleaseGil());
  module.def(
      "sample",
      [](const ImageOut& image, const Numbers<7>& numbers,
         const Array<const std::uint8_t, 2>& values, double x, double y, double step) {
        require_room("values", values.size(), 1);
        sample_raster(view(image), image_view(numbers), {view(values), {x, y}, step});
      },
      "image"_a, "view"_a, "values"_a, "x"_a, "y"_a, "step"_a, ReleaseGil());
  module.def(
      "fill_hidden",
      [](const ImageOut& image, const Numbers<7>& numbers, double x, double y, const Points& loops,
         const Integers<1>& offsets, const Array<const float, 3>& table, const Numbers<2>& origin,
         double step, const Integers<1>& bends, const Floats<1>& lengths, double per_metre) {
        require_count("lengths", lengths.shape(0), bends.shape(0));
        require_indices("bends", view(bends), view(table).extent(2));
        fill_hidden(view(image), image_view(numbers), {x, y},
                    {polygons(loops, offsets),
                     view(table),
                     {origin.data()[0], origin.data()[1]},
                     step,
                     view(bends),
                     view(lengths)},
                    per_metre);
      },
      "image"_a, "view"_a, "x"_a, "y"_a, "loops"_a, "offsets"_a, "table"_a, "origin"_a, "step"_a,
      "bends"_a, "lengths"_a, "per_metre"_a, ReleaseGil());
}

}  // namespace pushplan::bindings
