// What obstacles hide from a viewpoint, and the bends of shortest paths that it sees.
//
// Shadows of convex shapes are convex, so they are filled like any other polygon instead of being
// tested cell by cell.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pushplan/geometry/distance_field.hpp"
#include "pushplan/geometry/raster.hpp"
#include "pushplan/geometry/visibility.hpp"

namespace pushplan {

/// Fills shadows of convex polygons [px] into images; with memory, for one thread. The polygons'
/// arrays have to outlive it.
class ShadowPainter {
 public:
  explicit ShadowPainter(const Polygons& polygons);

  /// Fills each polygon and all that it hides from `eye`; none from inside of it.
  void fill(ArrayView<std::uint8_t, 2> mask, Vec2 eye, std::uint8_t value);

 private:
  void fill_one(ArrayView<std::uint8_t, 2> mask, Vec2 eye, Polygon corners, std::uint8_t value);

  Polygons polygons_;
  std::vector<Vec2> hull_;  // outline of a shadow
  ConvexFiller filler_;
};

/// Writes for each cell the distance [m] to each bend, over the bends that the cell sees; infinite
/// where there is no way.
void fill_bend_distances(ArrayView<float, 3> table,  // (rows, columns, B)
                         const Cells& cells, const Bends& bends,
                         ArrayView<const double, 2> between,  // (B, B) distances of bends [m]
                         const Polygons& outlines,            // just around the obstacles [m]
                         double gap);

/// Bends over which a shortest path from a place may lead, and how far each is [m].
struct BendsInSight {
  std::vector<Index> bends;
  std::vector<double> lengths;
};

BendsInSight bends_in_sight(Vec2 p, const Bends& bends, const Obstacles& obstacles, double gap,
                            double sliver);  // a place this close to an obstacle may be inside of
                                             // the outline around it [m]

}  // namespace pushplan
