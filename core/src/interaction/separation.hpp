// Moving overlapping bodies apart by the least total motion.
#pragma once

#include <algorithm>

#include "pushplan/interaction/contact.hpp"

namespace pushplan {

/// A body that a contact may move.
struct MovedBody {
  Pose& pose;
  double inverse_mass;      // 0 if it cannot move
  double inverse_gyration;  // 1 / c^2

  double arm(Vec2 point, Vec2 normal) const {
    return (point.x - pose.x) * normal.y - (point.y - pose.y) * normal.x;
  }

  /// Moves the body by a displacement applied at a point of the world.
  void nudge(Vec2 point, Vec2 by) const {
    const double turn = (point.x - pose.x) * by.y - (point.y - pose.y) * by.x;
    pose.x += by.x;
    pose.y += by.y;
    pose.theta += turn * inverse_gyration;
  }
};

/// Moves two bodies apart. Returns the sum of the impulses.
inline double separate(const Contacts& contacts, const MovedBody& a, const MovedBody& b) {
  const Contact& first = contacts.points[0];
  const Contact& second = contacts.points[1];
  const Vec2 n = first.normal;
  const double depth0 = -first.gap;
  const double arm_a = a.arm(first.point, n);
  const double arm_b = b.arm(first.point, n);
  const double base = a.inverse_mass + b.inverse_mass;
  const double turn_a = a.inverse_mass * a.inverse_gyration;
  const double turn_b = b.inverse_mass * b.inverse_gyration;
  const double k00 = base + turn_a * (arm_a * arm_a) + turn_b * (arm_b * arm_b);
  double impulse0 = depth0 / k00;
  double impulse1 = 0.0;
  if (contacts.count == 2) {
    // the exact solution of the 2 x 2 complementarity problem: both points, or only one
    const double depth1 = -second.gap;
    const double other_a = a.arm(second.point, n);
    const double other_b = b.arm(second.point, n);
    const double k11 = base + turn_a * (other_a * other_a) + turn_b * (other_b * other_b);
    const double k01 = base + turn_a * arm_a * other_a + turn_b * arm_b * other_b;
    const double det = k00 * k11 - k01 * k01;
    if (det > 1e-12 * k00 * k11) {
      impulse0 = (k11 * depth0 - k01 * depth1) / det;
      impulse1 = (k00 * depth1 - k01 * depth0) / det;
      if (impulse0 < 0.0) {
        impulse0 = 0.0;
        impulse1 = depth1 / k11;
      } else if (impulse1 < 0.0) {
        impulse0 = depth0 / k00;
        impulse1 = 0.0;
      }
    }
  }
  const auto nudge_both = [&](Vec2 point, double impulse) {
    const double of_a = -impulse * a.inverse_mass;
    const double of_b = impulse * b.inverse_mass;
    a.nudge(point, {of_a * n.x, of_a * n.y});
    b.nudge(point, {of_b * n.x, of_b * n.y});
  };
  nudge_both(first.point, impulse0);
  if (contacts.count == 2) nudge_both(second.point, impulse1);
  return impulse0 + impulse1;
}

/// Coulomb friction: carries the contact of a body sideways with what it touches, which has moved
/// `from` `to`, up to `limit` [m], which is friction times what the body was moved along the
/// normal.
inline void drag_along(const Contacts& contacts, double limit, const Pose& from, const Pose& to,
                       const Pose& before, const MovedBody& body) {
  Vec2 p = contacts.points[0].point;
  const Vec2 n = contacts.points[0].normal;
  if (contacts.count == 2) {
    p = {0.5 * (p.x + contacts.points[1].point.x), 0.5 * (p.y + contacts.points[1].point.y)};
  }
  const Vec2 t{-n.y, n.x};
  const auto slide = [&](const Pose& was, const Pose& is) {
    const double turn = is.theta - was.theta;
    double along = (is.x - was.x - turn * (p.y - is.y)) * t.x;
    along += (is.y - was.y + turn * (p.x - is.x)) * t.y;
    return along;
  };
  const double wanted = slide(from, to) - slide(before, body.pose);
  const double arm = body.arm(p, t);
  const double by =
      std::min(std::max(wanted / (1.0 + arm * arm * body.inverse_gyration), -limit), limit);
  body.nudge(p, {by * t.x, by * t.y});
}

}  // namespace pushplan
