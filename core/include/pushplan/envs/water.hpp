// Shapes of floating bodies as the drag of water depends on them.
#pragma once

#include <span>

#include "pushplan/geometry/pose.hpp"

namespace pushplan {

struct FlowShape {
  double width;          // mean width: circumference over pi (Cauchy) [m]
  double area;           // [m^2]
  double edge_rotation;  // sum over both halves of each edge of half the integral of |t|^3 dt [m^4]
  double area_rotation;  // integral of |r|^3 dA [m^5]
};

/// Measures convex bodies with corners about their centroids [m], counter-clockwise.
void flow_shapes(const Polygons& bodies, std::span<FlowShape> out);

}  // namespace pushplan
