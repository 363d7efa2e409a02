#include "pushplan/motion/coarse_path.hpp"

#include <algorithm>

#include "pushplan/geometry/obstacles.hpp"

namespace pushplan {

void add_cell_weights(ArrayView<double, 2> extra, const Cells& cells, const Polygons& polygons,
                      std::span<const CellBox> within, const Surcharge& surcharge) {
  for (Index k = 0; k < polygons.count(); ++k) {
    const auto at = static_cast<std::size_t>(k);
    const CellBox& box = within[at];
    const double reach = surcharge.reach[at];
    const Index row_end = std::min(box.last_row + 1, extra.extent(0));
    const Index column_end = std::min(box.last_column + 1, extra.extent(1));
    for (Index r = std::max(box.first_row, Index{0}); r < row_end; ++r) {
      for (Index c = std::max(box.first_column, Index{0}); c < column_end; ++c) {
        const double gap = std::max(core_distance(cells.centre(r, c), polygons[k]), 0.0);
        if (gap < reach) extra(r, c) += surcharge.weight[at] * (1.0 - gap / reach);
      }
    }
  }
}

}  // namespace pushplan
