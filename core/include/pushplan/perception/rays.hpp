// Rays around a robot, as an observation of what is near.
#pragma once

#include <span>

#include "pushplan/geometry/pose.hpp"

namespace pushplan {

/// Shortens N rays from a pose to where they first cross a closed outline of the world. Ray i
/// points 2 pi i / N to the left of the heading; `lengths` [m] are changed.
void cast_rays(std::span<double> lengths, const Pose& start, const Polygons& outlines);

}  // namespace pushplan
