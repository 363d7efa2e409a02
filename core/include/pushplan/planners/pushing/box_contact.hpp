// Contact of a bumper and one box: where they touch, and how fast the box moves.
//
// All velocities are in the frame of the pushed face: n forward, into the box, t to the left. The
// ellipsoidal limit surface makes the box's velocity (v_n, v_t, omega) parallel to
// (f_n, f_t, tau / c^2) (Goyal, Ruina and Papadopoulos, Wear 143, 1991; Howe and Cutkosky, IJRR
// 15(6), 1996). A pressed line of contact is a force at its centre of pressure y within the line,
// so tau = -a f_t - y f_n (Lynch and Mason, IJRR 15(6), 1996). What would close or hold the line of
// contact within a step happens if friction and pressure allow it, else the nearest that they
// allow.
#pragma once

#include <algorithm>
#include <cmath>

#include "pushplan/control/mpc/tracking.hpp"

namespace pushplan::pushing {

using mpc::Twist;

enum class ContactMode { kFree, kStick, kSlide, kCornerStick, kCornerSlide };

/// Bumper and pushed face.
struct BoxContact {
  double front;      // x of the bumper in its middle, from the axle [m]
  double half;       // half the bumper's width [m]
  double curvature;  // of the bumper's front [1/m]; positive where its ends reach ahead
  double depth;      // a: from the pushed face to the box's centre [m]
  double low;        // right end of the face from the centre, along t [m], negative
  double high;       // left end of the face [m]
  double spread;     // c = greatest torque / greatest force of the ground [m]
  double friction;   // between bumper and box

  /// A part of the face, along t [m]; empty if low >= high.
  struct Line {
    double low;
    double high;
  };

  /// The box's centre where it touches the bumper.
  struct Standoff {
    double x;      // of the centre [m]
    double touch;  // where on the face, along t [m]
  };

  /// From the axle to the centre of a box that lies on the middle of the bumper [m].
  double reach() const { return front + depth; }

  /// The part of the face that is in front of the bumper.
  Line line(double offset) const {
    return {std::max(low, -half - offset), std::min(high, half - offset)};
  }

  /// Angle of the face against the robot's heading when it lies on the bumper [rad].
  double flush_angle(double offset) const {
    const Line touching = line(offset);
    if (curvature <= 0.0 || touching.low >= touching.high) return 0.0;
    return -curvature * (offset + 0.5 * (touching.low + touching.high)) / (1.0 - curvature * depth);
  }

  Standoff standoff(double offset, double angle) const {
    return standoff(offset, std::cos(angle), std::sin(angle));
  }

  /// The same of an angle of known cosine and sine.
  Standoff standoff(double offset, double c, double s) const;
};

/// How a box moves in one step.
struct BoxMotion {
  double normal = 0.0;    // v_n [m/s]
  double sideways = 0.0;  // v_t [m/s]
  double turn = 0.0;      // omega [rad/s]
  double pressure = 0.0;  // centre of pressure, along t [m]
  ContactMode mode = ContactMode::kFree;
  double shear = 0.0;  // over the normal force
};

/// The motion of a box that touches the bumper, and the x of its centre [m].
struct PushedBox {
  BoxMotion motion;
  double x;
};

PushedBox contact_velocity(const BoxContact& contact,
                           double offset,  // of the box's centre to the left of the robot's x axis
                           double angle,   // of the face's normal against the robot's heading
                           double c,       // cosine and sine of the angle
                           double s, const Twist& twist,
                           double dt);  // step in which an open line of contact should close [s]

}  // namespace pushplan::pushing
