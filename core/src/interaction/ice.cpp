#include "pushplan/interaction/ice.hpp"

#include <algorithm>
#include <cmath>

namespace pushplan {
IceContacts::IceContacts(const IceBodies& bodies, const IceSettings& settings)
    : bodies_(bodies), settings_(settings), most_points_(24 * at(bodies.floes.parts.count()) + 64) {
  hull_.resize(bodies.hull.vertices.size());
  corners_.resize(bodies.floes.parts.vertices.size());
  moves_.resize(bodies.radii.size());
  state_.resize(bodies.radii.size());
  points_.reserve(most_points_);
  if (bodies.floes.parts.count() > bodies.floes.count()) {
    boxes_.resize(at(bodies.floes.parts.count()));
    hull_boxes_.resize(at(bodies.hull.count()));
  }
}

void IceContacts::place(Index k, const Pose& pose) {
  const auto [first, count] = bodies_.floes.corners(k);
  transform(pose, bodies_.floes.parts.vertices.subspan(first, count), corners_.data() + first);
  if (boxes_.empty()) return;
  for (Index p = bodies_.floes.begin(k); p < bodies_.floes.end(k); ++p) {
    boxes_[at(p)] = box_around(part(p));
  }
}

void IceContacts::place(std::span<const Pose> poses) {
  for (std::size_t k = 0; k < poses.size(); ++k) place(static_cast<Index>(k), poses[k]);
}

/// Adds the contact points between a body whose centre is given and floe b.
void IceContacts::add(Index a, Index b, const Contacts& found, Vec2 centre_a,
                      std::span<const Pose> poses) {
  for (int i = 0; i < found.count; ++i) {
    if (points_.size() >= most_points_) return;
    const Contact& contact = found.points[static_cast<std::size_t>(i)];
    const Vec2 n = contact.normal;
    const Vec2 arm_a{contact.point.x - centre_a.x, contact.point.y - centre_a.y};
    const Vec2 arm_b{contact.point.x - poses[at(b)].x, contact.point.y - poses[at(b)].y};
    const auto squared = [](double x) { return x * x; };
    double base = 1.0 / bodies_.masses[at(b)];
    const double turn_b = base * bodies_.inverse_gyration[at(b)];
    double along = base + turn_b * squared(arm_b.x * n.y - arm_b.y * n.x);
    double across = base + turn_b * squared(arm_b.x * n.x + arm_b.y * n.y);
    if (a != kHull) {
      base = 1.0 / bodies_.masses[at(a)];
      const double turn_a = base * bodies_.inverse_gyration[at(a)];
      along += base + turn_a * squared(arm_a.x * n.y - arm_a.y * n.x);
      across += base + turn_a * squared(arm_a.x * n.x + arm_a.y * n.y);
    }
    points_.push_back({a, b, n, arm_a, arm_b, contact.gap, along, across, 0.0, 0.0});
  }
}

/// Adds the contacts of a part of a body with a floe. Returns true if there are any.
bool IceContacts::meet(Index a, Polygon piece, const Box* box, Index b, Vec2 centre_a,
                       std::span<const Pose> poses) {
  bool met = false;
  for (Index q = bodies_.floes.begin(b); q < bodies_.floes.end(b); ++q) {
    if (box != nullptr && box->apart(boxes_[at(q)], settings_.step)) continue;
    const Contacts found = near_contacts(piece, part(q), settings_.step);
    if (found.count == 0) continue;
    add(a, b, found, centre_a, poses);
    met = true;
  }
  return met;
}

/// Adds the contacts of a floe that has begun to move with all that are near and not yet met.
void IceContacts::meet_neighbours(Index k, std::span<const Pose> poses) {
  state_[at(k)] = State::kNeighboursKnown;
  const Vec2 centre{poses[at(k)].x, poses[at(k)].y};
  for (std::size_t j = 0; j < poses.size(); ++j) {
    if (j == at(k) || state_[j] == State::kNeighboursKnown) continue;
    const double dx = poses[j].x - centre.x;
    const double dy = poses[j].y - centre.y;
    const double reach = bodies_.radii[j] + bodies_.radii[at(k)] + settings_.step;
    if (dx * dx + dy * dy >= reach * reach) continue;
    const Index other = static_cast<Index>(j);
    for (Index p = bodies_.floes.begin(k); p < bodies_.floes.end(k); ++p) {
      const Box* box = boxes_.empty() ? nullptr : &boxes_[at(p)];
      if (meet(k, part(p), box, other, centre, poses) && state_[j] == State::kResting) {
        state_[j] = State::kTouched;
      }
    }
  }
}

/// Finds the contacts of the hull with the floes.
void IceContacts::meet_hull(const Pose& here, std::span<const Pose> poses) {
  transform(here, bodies_.hull.vertices, hull_.data());
  std::fill(state_.begin(), state_.end(), State::kResting);
  points_.clear();
  const Polygons pieces{hull_, bodies_.hull.offsets};
  for (std::size_t i = 0; i < hull_boxes_.size(); ++i) {
    hull_boxes_[i] = box_around(pieces[static_cast<Index>(i)]);
  }
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const double dx = poses[k].x - here.x;
    const double dy = poses[k].y - here.y;
    const double reach = bodies_.hull_radius + bodies_.radii[k] + settings_.step;
    if (dx * dx + dy * dy >= reach * reach) continue;
    const Index floe = static_cast<Index>(k);
    for (Index piece = 0; piece < pieces.count(); ++piece) {
      const Box* box = boxes_.empty() ? nullptr : &hull_boxes_[at(piece)];
      if (meet(kHull, pieces[piece], box, floe, {here.x, here.y}, poses)) {
        state_[k] = State::kTouched;
      }
    }
  }
}

/// Makes one round over all contacts: impulses that keep gaps open and hinder sliding.
void IceContacts::relax(const Pose& hull_move) {
  for (ContactPoint& p : points_) {
    const Vec2 n = p.normal;
    const Pose& move_a = p.a == kHull ? hull_move : moves_[at(p.a)];
    Pose& move_b = moves_[at(p.b)];
    const double rx = move_b.x - move_b.theta * p.arm_b.y - move_a.x + move_a.theta * p.arm_a.y;
    const double ry = move_b.y + move_b.theta * p.arm_b.x - move_a.y - move_a.theta * p.arm_a.x;
    const double pushed = p.push;
    const double gap = rx * n.x + ry * n.y + p.gap;  // after the displacements so far
    if (pushed == 0.0 && gap >= 0.0) continue;       // nor does it drag; most are so
    p.push = std::max(0.0, pushed - gap / p.along);
    const double limit = (p.a == kHull ? settings_.hull_friction : settings_.friction) * p.push;
    const double dragged = p.drag;
    p.drag = std::min(std::max(dragged - (ry * n.x - rx * n.y) / p.across, -limit), limit);
    const double push = p.push - pushed;
    const double drag = p.drag - dragged;
    if (push == 0.0 && drag == 0.0) continue;
    const Vec2 impulse{push * n.x - drag * n.y, push * n.y + drag * n.x};
    const auto torque = [&](Vec2 arm) { return arm.x * impulse.y - arm.y * impulse.x; };
    double weight = 1.0 / bodies_.masses[at(p.b)];
    move_b.x += weight * impulse.x;
    move_b.y += weight * impulse.y;
    move_b.theta += weight * bodies_.inverse_gyration[at(p.b)] * torque(p.arm_b);
    if (p.a != kHull) {
      Pose& floe = moves_[at(p.a)];
      weight = 1.0 / bodies_.masses[at(p.a)];
      floe.x -= weight * impulse.x;
      floe.y -= weight * impulse.y;
      floe.theta -= weight * bodies_.inverse_gyration[at(p.a)] * torque(p.arm_a);
    }
  }
}

/// Moves the hull by one small step among the floes. Returns the work [kg m].
double IceContacts::advance(const Pose& here, const Pose& by, std::span<Pose> poses) {
  meet_hull(here, poses);
  if (points_.empty()) return 0.0;
  std::fill(moves_.begin(), moves_.end(), Pose{0.0, 0.0, 0.0});
  for (Index round = 0; round < settings_.iterations; ++round) {
    relax(by);
    for (std::size_t k = 0; k < poses.size(); ++k) {
      if (state_[k] != State::kTouched) continue;
      const double moved = std::abs(moves_[k].x) + std::abs(moves_[k].y);
      if (moved + std::abs(moves_[k].theta) * bodies_.radii[k] > settings_.still) {
        meet_neighbours(static_cast<Index>(k), poses);
      }
    }
  }
  double work = 0.0;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Pose& move = moves_[k];
    if (state_[k] == State::kResting || move == Pose{0.0, 0.0, 0.0}) continue;
    poses[k].x += move.x;
    poses[k].y += move.y;
    poses[k].theta += move.theta;
    work += bodies_.masses[k] * std::sqrt(move.x * move.x + move.y * move.y);
    place(static_cast<Index>(k), poses[k]);
  }
  return work;
}

std::pair<double, Index> IceContacts::drive(const Pose& hull_from, const Pose& hull_to,
                                            std::span<Pose> poses, double work) {
  const double turn = wrap_angle(hull_to.theta - hull_from.theta);
  const double dx = hull_to.x - hull_from.x;
  const double dy = hull_to.y - hull_from.y;
  const double motion = std::sqrt(dx * dx + dy * dy) + std::abs(turn) * bodies_.hull_radius;
  const Index steps = std::max<Index>(1, static_cast<Index>(std::ceil(motion / settings_.step)));
  const double parts = static_cast<double>(steps);
  const Pose by{dx / parts, dy / parts, turn / parts};
  for (Index step = 0; step < steps; ++step) {
    const double done = static_cast<double>(step);
    const Pose here{hull_from.x + done * by.x, hull_from.y + done * by.y,
                    hull_from.theta + done * by.theta};
    work += advance(here, by, poses);
  }
  return {work, steps};
}

double IceContacts::sweep(std::span<const Pose> path, std::span<Pose> poses,
                          ArrayView<Pose, 2> out) {
  double work = 0.0;
  place(poses);
  std::copy(poses.begin(), poses.end(), out.row(0).begin());
  for (std::size_t n = 1; n < path.size(); ++n) {
    work = drive(path[n - 1], path[n], poses, work).first;
    std::copy(poses.begin(), poses.end(), out.row(static_cast<Index>(n)).begin());
  }
  return work;
}

}  // namespace pushplan
