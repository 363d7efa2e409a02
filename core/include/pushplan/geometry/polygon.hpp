// Measures of simple polygons: area, centroid, inertia.
#pragma once

#include "pushplan/geometry/pose.hpp"

namespace pushplan {

/// Area [m^2] by the shoelace formula, positive if counter-clockwise. At least one corner.
double polygon_area(Polygon polygon);

/// Centre of area [m]; the mean of the corners where there is no area. At least one corner.
Vec2 polygon_centroid(Polygon polygon);

/// Second moment of area about the centroid over the area [m^2]; 0 without area.
double polygon_inertia(Polygon polygon);

}  // namespace pushplan
