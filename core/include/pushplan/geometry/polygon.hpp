// Measures of polygons, and polygons that are grown.
#pragma once

#include <vector>

#include "pushplan/geometry/pose.hpp"

namespace pushplan {

/// Area [m^2] by the shoelace formula, positive if counter-clockwise. At least one corner.
double polygon_area(Polygon polygon);

/// Centre of area [m]; the mean of the corners where there is no area. At least one corner.
Vec2 polygon_centroid(Polygon polygon);

/// Second moment of area about the centroid over the area [m^2]; 0 without area.
double polygon_inertia(Polygon polygon);

/// Radius [m] of the largest disc about the origin inside a convex outline; 0 if there is none.
double inscribed_radius(Polygon outline);

/// Least distance [m] between two parallel lines that hold a convex outline.
double least_width(Polygon outline);

/// A convex outline that holds all points within a margin [m] of another one, with a corner for
/// each of its corners and two for sharp ones (that turn by more than 100 degrees); at corners it
/// reaches at most 1.56 margins away.
std::vector<Vec2> grown_outline(Polygon outline, double margin);

}  // namespace pushplan
