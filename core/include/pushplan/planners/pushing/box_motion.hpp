// Quasi-static motion of one box in front of a bumper, and its pose in the robot's frame.
//
// Robot and box move by time stepping: the robot along an arc, the box with the velocity of
// `contact_velocity`, in substeps that are short against the distance between them.
#pragma once

#include <span>

#include "pushplan/planners/pushing/box_contact.hpp"

namespace pushplan::pushing {

/// Robot and box.
struct PushState {
  Pose robot;
  double offset;  // of the box's centre to the left of the robot's x axis [m]
  double angle;   // of the face's normal against the robot's heading [rad]
  double gap;     // between bumper and box [m]
};

/// Moves the box on in the robot's frame alone: offset, angle and gap. Returns its motion in the
/// last substep, of mode `kFree` without contact.
BoxMotion advance_box(const BoxContact& contact, PushState& state, const Twist& twist, double dt);

/// Moves robot and box on by `dt` [s] under one command.
BoxMotion advance(const BoxContact& contact, PushState& state, const Twist& twist, double dt);

/// Fills N + 1 states and N motions under twists held for N steps [s].
void roll_out(const BoxContact& contact, const PushState& start, std::span<const Twist> twists,
              std::span<const double> steps, std::span<PushState> states,
              std::span<BoxMotion> motions);

/// The state of poses of robot and box; `normal` [rad] is the direction of the pushed face in the
/// box's frame. The gap is negative in overlap.
PushState observe(const BoxContact& contact, double normal, const Pose& robot, const Pose& box);

/// The box's centre, and the direction of the pushed face's normal, in the world.
Pose box_pose(const BoxContact& contact, const PushState& state);

}  // namespace pushplan::pushing
