// Pixels that a robot does not see, as the length of the way to them.
#pragma once

#include "pushplan/observation/view.hpp"

namespace pushplan {

/// Data for finding the corners of shortest paths that a robot sees.
struct Sight {
  Polygons loops;                   // convex outlines that cast shadows [m]
  ArrayView<const float, 3> table;  // (rows, columns, corners) distances from the corners [m]
  Vec2 origin;                      // of the table [m]
  double step;                      // side of its cells [m]
  std::span<const Index> bends;     // corners in sight
  std::span<const double> lengths;  // paths to them [m]
};

/// Overwrites the pixels in the shadow of the loops, seen from `eye` [m], by the length of the path
/// to them. `per_metre` is the value of a pixel that is 1 m away; what passes 255, or is cut off,
/// becomes 255.
void fill_hidden(Image image, const ImageView& view, Vec2 eye, const Sight& sight,
                 double per_metre);

}  // namespace pushplan
