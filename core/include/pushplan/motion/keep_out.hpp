// What is static, grown by the margin that a robot keeps.
#pragma once

#include <memory>

#include "pushplan/geometry/static_map.hpp"

namespace pushplan {

/// The map of what a robot keeps away from, which is kept with the map: every obstacle grown by a
/// margin [m], with sharp corners (`grown_outline`). One that the robot is nearer to grows by as
/// many quarters of the margin as leave the robot a quarter more, or nothing, so that it may always
/// drive on along the obstacle, and away. The parts that count at walls are in the body frame;
/// `size` is the circumscribed radius of the robot [m].
std::shared_ptr<const StaticMap> keep_out(const std::shared_ptr<const StaticMap>& map,
                                          Polygons wall_parts, double size, const Pose& pose,
                                          double margin);

}  // namespace pushplan
