#include "pushplan/observation/hidden.hpp"

#include <limits>

#include "pushplan/geometry/shadows.hpp"

namespace pushplan {

void fill_hidden(Image image, const ImageView& view, Vec2 eye, const Sight& sight,
                 double per_metre) {
  const Index rows = image.extent(0);
  const Index cols = image.extent(1);
  std::vector<Vec2> spots(sight.loops.vertices.size());
  to_pixels(view, sight.loops.vertices, spots.data());
  Vec2 at;
  to_pixels(view, {&eye, 1}, &at);
  std::vector<std::uint8_t> shadow(static_cast<std::size_t>(rows * cols), 0);
  const Image hidden(shadow.data(), {rows, cols});
  ShadowPainter({spots, sight.loops.offsets}).fill(hidden, at, 1);
  const double c = std::cos(view.window.theta);
  const double s = std::sin(view.window.theta);
  const auto table_rows = static_cast<double>(sight.table.extent(0));
  const auto table_cols = static_cast<double>(sight.table.extent(1));
  for (Index r = 0; r < rows; ++r) {
    const double up = (0.5 * view.rows - static_cast<double>(r) - 0.5) * view.step_up;
    for (Index q = 0; q < cols; ++q) {
      if (!hidden(r, q)) continue;
      const double left = (0.5 * view.cols - static_cast<double>(q) - 0.5) * view.step_across;
      const double u = (view.window.x + c * up - s * left - sight.origin.x) / sight.step;
      const double v = (view.window.y + s * up + c * left - sight.origin.y) / sight.step;
      double best = std::numeric_limits<double>::infinity();
      if (0.0 <= u && u < table_cols && 0.0 <= v && v < table_rows) {  // ways stay in the bounds
        const auto cell = sight.table.row(static_cast<Index>(v)).row(static_cast<Index>(u));
        for (std::size_t k = 0; k < sight.bends.size(); ++k) {
          const float rest = cell[static_cast<std::size_t>(sight.bends[k])];
          best = std::min(best, sight.lengths[k] + static_cast<double>(rest));
        }
      }
      image(r, q) = static_cast<std::uint8_t>(std::min(255.0, per_metre * best + 0.5));
    }
  }
}

}  // namespace pushplan
