// The controllers of a robot with their usual settings. R is its circumscribed radius.
#pragma once

#include "pushplan/control/mpc/tracker.hpp"
#include "pushplan/control/pure_pursuit.hpp"
#include "pushplan/world.hpp"

namespace pushplan {

/// Pure pursuit of a point R ahead, for a robot that `plan` accepts.
PurePursuit make_pure_pursuit(const Robot& robot, const mpc::Twist& before = {0.0, 0.0});

/// The predictive tracker over 20 steps, which reach 3 R at full speed, for such a robot. `delay`:
/// between a command and its effect [s].
mpc::Tracker make_tracker(const Robot& robot, double delay = 0.0,
                          const mpc::Twist& before = {0.0, 0.0});

}  // namespace pushplan
