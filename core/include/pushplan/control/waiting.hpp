// How far a robot that has nothing to drive yet can go on.
#pragma once

#include "pushplan/motion/collision.hpp"

namespace pushplan {

/// The number of steps, of `most`, that a robot can go before it touches a wall: straight before
/// step `first`, with a turn [rad] in each later one.
inline Index clear_steps(CollisionChecker& checker, Pose at, double step, double turn, Index first,
                         Index most) {
  for (Index done = 0; done < most; ++done) {
    at = arc_step(at, step, done >= first ? turn : 0.0);
    if (!checker.is_free(at)) return done;
  }
  return most;
}

}  // namespace pushplan
