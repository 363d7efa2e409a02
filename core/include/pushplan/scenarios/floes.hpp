// Steps of the ice generator: placing discs, cutting cells, fitting floes into them.
#pragma once

#include <span>

#include "pushplan/geometry/pose.hpp"

namespace pushplan {

/// Corners that a buffer for one outline holds; a floe has far fewer.
inline constexpr Index kFloeCorners = 48;

/// A rectangle of water with regions to stay off.
struct IceWater {
  double x_min;  // [m]; floes stay inside
  double y_min;
  double x_max;
  double y_max;
  Polygons blocks;  // convex regions [m], counter-clockwise
  double gap;       // least distance between floes, and from floes to regions [m]
};

/// A point of a polygon and how far it is from another point.
struct NearestPoint {
  double distance;  // [m]
  Vec2 point;
};

/// The point of a convex polygon, its inside included, that is nearest to a point.
NearestPoint nearest_point(Vec2 p, Polygon polygon);

/// K discs that a power diagram is of, and which of them may be neighbours.
struct Discs {
  std::span<const Vec2> centres;    // (K,) [m]
  std::span<const double> radii;    // (K,) [m]; a disc that overlaps no other lies in its own cell
  std::span<const double> reaches;  // (K,) half side of the square that a cell cannot leave [m]
  std::span<const Index> neighbours;         // discs whose squares may meet, those of one disc
                                             // after those of the one before
  std::span<const Index> neighbour_offsets;  // (K + 1,) where those of each disc start
};

/// K convex outlines, counter-clockwise, in buffers of `kFloeCorners` corners.
struct Outlines {
  ArrayView<const Vec2, 2> corners;  // (K, kFloeCorners)
  std::span<const Index> counts;     // (K,) corners in use

  Polygon operator[](Index k) const {
    return corners.row(k).first(static_cast<std::size_t>(counts[static_cast<std::size_t>(k)]));
  }
};

/// The same to be filled.
struct OutlinesOut {
  ArrayView<Vec2, 2> corners;
  std::span<Index> counts;
};

/// Cuts the cells of a power diagram (Laguerre tessellation), half a gap smaller on every side. A
/// cell without room has no corners.
void cut_cells(const Discs& discs, const IceWater& water, const OutlinesOut& cells);

/// Grows shapes of area 1 about the origin within their cells until they have their target areas
/// [m^2], or cannot grow further. A floe has no corners where its cell has none.
void fit_floes(const Outlines& shapes,
               std::span<const Vec2> centres,    // (K,) [m]
               const Outlines& cells,            // [m]
               std::span<const double> targets,  // (K,) areas [m^2]
               double stretch,  // greatest scale of a shape, in roots of its target area
               const OutlinesOut& floes);

/// Places discs, largest first, off each other and off the regions, each at the first of its places
/// that is free. Returns how many found one before the first that did not; `centres` holds theirs.
Index place_discs(std::span<const double> radii,       // (K,) [m]
                  ArrayView<const double, 3> draws,    // (K, T, 3) uniform in [0, 1): place, and
                                                       // whether it is taken
                  ArrayView<const double, 2> density,  // (R, C) chance that a place is taken,
                                                       // over the water
                  const IceWater& water, std::span<Vec2> centres);  // (K,) filled [m]

}  // namespace pushplan
