// Few convex parts for a shape that is cut into triangles.
#pragma once

#include <span>
#include <vector>

#include "pushplan/geometry/pose.hpp"

namespace pushplan {

/// Merges convex pieces that touch along whole edges into few convex parts: again and again the two
/// neighbours whose hull has the least area beyond theirs, as Hertel and Mehlhorn do where it has
/// none, until a merger would bring these areas above `budget` [m^2]. Returns the number of the
/// part of each piece, 0 to K - 1.
std::vector<Index> merge_pieces(const Polygons& pieces, double budget);

}  // namespace pushplan
