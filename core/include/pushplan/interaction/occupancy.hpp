// Rasters of floes and hulls: how much of each cell is covered.
#pragma once

#include <span>

#include "pushplan/geometry/pose.hpp"

namespace pushplan {

/// Where a raster lies. Columns count up along its heading, rows to the left of it.
struct RasterFrame {
  Pose corner;  // outer corner of the first cell, and the heading
  double cell;  // side of a cell [m]
};

/// Values from 0 to 1.
using Coverage = ArrayView<float, 2>;

/// Writes the fraction of each cell that lies under an object. Outlines are in body frames [m].
void cover_objects(std::span<const Pose> poses, const Polygons& outlines, const RasterFrame& frame,
                   Coverage out);

/// Writes the fraction of each cell that a robot passes over on a path of straight pieces; of one
/// pose, its footprint.
void cover_sweep(std::span<const Pose> path, const Polygons& robot, const RasterFrame& frame,
                 Coverage out);

}  // namespace pushplan
