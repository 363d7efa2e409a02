// Poses of the robot behind an object.
#pragma once

#include <span>

#include "pushplan/geometry/pose.hpp"
#include "pushplan/motion/collision.hpp"

namespace pushplan::rearrangement {

/// The pose of a robot that touches an object from behind and faces along a heading [rad].
Pose pose_behind(const Pose& object, Polygon outline,  // in the object's frame [m]
                 double heading,
                 double shift,      // of the robot's middle to the left [m]
                 double distance);  // of the robot's middle from the outline [m]

/// Writes whether the robot fits behind an object in each cell to push it along each heading of
/// `PoseGrid`.
void pushable_moves(ArrayView<const Vec2, 2> middles,  // (rows, columns) of the cells [m]
                    ArrayView<const bool, 2> is_open,  // where an object may be
                    std::span<const double> shifts,    // of the robot to the left of the object [m]
                    double distance,  // of the robot's middle behind the object's [m]
                    CollisionChecker& checker,
                    ArrayView<bool, 3> out);  // (16, rows, columns), false before

/// Writes the cost of the cheapest path of an object from each cell to one of `goals`, which are
/// counted row by row; infinite where there is none.
void fill_push_costs(ArrayView<const bool, 2> is_open, ArrayView<const bool, 3> pushable,
                     std::span<const Index> goals,
                     double step,       // side of a cell [m]
                     double drag_cost,  // of a metre of a move that is not pushable
                     ArrayView<double, 2> costs);

}  // namespace pushplan::rearrangement
