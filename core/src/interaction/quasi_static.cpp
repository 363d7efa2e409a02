#include "pushplan/interaction/quasi_static.hpp"

#include <algorithm>
#include <cmath>

#include "separation.hpp"

namespace pushplan {
namespace {

constexpr double kNearby = 3.0;  // reach beyond the robot's within which objects are nearby [radii]

/// Whether the square around a disc overlaps a box.
bool reaches(const Box& box, double x, double y, double r) {
  return x + r > box.x_min && x - r < box.x_max && y + r > box.y_min && y - r < box.y_max;
}

/// The deeper overlap of up to two contact points.
double depth_of(const Contacts& found) {
  const double first = -found.points[0].gap;
  return found.count == 1 ? first : std::max(first, -found.points[1].gap);
}

}  // namespace

QuasiStatic::QuasiStatic(const Bodies& bodies, const QuasiStaticSettings& settings)
    : bodies_(bodies), settings_(settings) {
  const std::size_t count = bodies.radii.size();
  robot_.resize(bodies.robot.vertices.size());
  corners_.resize(bodies.shapes.parts.vertices.size());
  active_.resize(count);
  before_.resize(count);
  saved_.resize(count);
  near_.reserve(count);
  unused_.resize(count);
}

/// Works out the corners of object k in the world frame.
void QuasiStatic::place(Index k, std::span<const Pose> poses) {
  const auto [first, count] = bodies_.shapes.corners(k);
  transform(poses[at(k)], bodies_.shapes.parts.vertices.subspan(first, count),
            corners_.data() + first);
}

/// Makes every object nearby whose disc comes within `reach` of a point.
void QuasiStatic::gather(Vec2 centre, double reach, std::span<const Pose> poses) {
  near_.clear();
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const double dx = poses[k].x - centre.x;
    const double dy = poses[k].y - centre.y;
    const double far = reach + bodies_.radii[k];
    if (dx * dx + dy * dy < far * far) near_.push_back(static_cast<Index>(k));
  }
  near_centre_ = centre;
  near_reach_ = reach;
}

/// Marks nearby objects within `reach` of a point as active. Returns their number.
Index QuasiStatic::touching(Vec2 centre, double reach, std::span<const Pose> poses) {
  count_ = 0;
  for (const Index k : near_) {
    const double dx = poses[at(k)].x - centre.x;
    const double dy = poses[at(k)].y - centre.y;
    const double far = reach + bodies_.radii[at(k)];
    if (dx * dx + dy * dy < far * far) active_[at(count_++)] = k;
  }
  return count_;
}

/// Makes every object nearby where object k may touch one that is not. Only active objects have
/// moved since the small step began.
void QuasiStatic::widen(Index k, std::span<const Pose> poses) {
  const double dx = poses[at(k)].x - near_centre_.x;
  const double dy = poses[at(k)].y - near_centre_.y;
  const double room = near_reach_ - bodies_.radii[at(k)];
  if (room > 0.0 && dx * dx + dy * dy < room * room) return;
  gather(near_centre_, kInfinity, poses);
  for (std::size_t other = 0; other < poses.size(); ++other) {
    const auto end = active_.begin() + count_;
    if (std::find(active_.begin(), end, static_cast<Index>(other)) == end) {
      saved_[other] = poses[other];
    }
  }
}

/// Moves object k out of a piece of the robot or of a wall. Returns the deepest overlap found.
double QuasiStatic::push_out(const Push& push, Index k, std::span<Pose> poses) {
  double deepest = 0.0;
  for (Index p = bodies_.shapes.begin(k); p < bodies_.shapes.end(k); ++p) {
    const Contacts found = contacts(push.piece, part(p));
    if (found.count == 0) continue;
    Pose fixed{0.0, 0.0, 0.0};
    const MovedBody body{poses[at(k)], 1.0, bodies_.inverse_gyration[at(k)]};
    const double pushed = separate(found, {fixed, 0.0, 0.0}, body);
    if (push.friction > 0.0) {
      drag_along(found, push.friction * pushed, push.from, push.to, before_[at(k)], body);
    }
    place(k, poses);
    deepest = std::max(deepest, depth_of(found));
  }
  return deepest;
}

double QuasiStatic::against_robot(Index k, const Pose& from, const Pose& to,
                                  std::span<Pose> poses) {
  double deepest = 0.0;
  place(k, poses);
  const Polygons parts{robot_, bodies_.robot.offsets};
  for (Index part = 0; part < parts.count(); ++part) {
    deepest = std::max(deepest, push_out({parts[part], from, to, settings_.friction}, k, poses));
  }
  return deepest;
}

double QuasiStatic::against_walls(Index k, std::span<Pose> poses) {
  double deepest = 0.0;
  const Pose still{0.0, 0.0, 0.0};
  const Pose pose = poses[at(k)];
  const double r = bodies_.radii[at(k)];
  place(k, poses);
  for (Index part = 0; part < bodies_.walls.count(); ++part) {
    if (!reaches(bodies_.wall_boxes[at(part)], pose.x, pose.y, r)) continue;
    const Push push{bodies_.walls[part], still, still, settings_.static_friction};
    deepest = std::max(deepest, push_out(push, k, poses));
  }
  return deepest;
}

/// Moves an active object and its neighbours apart; neighbours that move become active.
double QuasiStatic::against_objects(Index i, std::span<Pose> poses) {
  double deepest = 0.0;
  const Index k = active_[at(i)];
  place(k, poses);
  widen(k, poses);
  const auto body = [&](Index n) {
    return MovedBody{poses[at(n)], bodies_.inverse_masses[at(n)], bodies_.inverse_gyration[at(n)]};
  };
  for (const Index other : near_) {
    const double dx = poses[at(other)].x - poses[at(k)].x;
    const double dy = poses[at(other)].y - poses[at(k)].y;
    const double reach = bodies_.radii[at(other)] + bodies_.radii[at(k)];
    if (other == k || dx * dx + dy * dy >= reach * reach) continue;
    ++tests_;
    place(other, poses);
    const auto& shapes = bodies_.shapes;
    for (Index p = shapes.begin(k); p < shapes.end(k); ++p) {
      for (Index q = shapes.begin(other); q < shapes.end(other); ++q) {
        const Contacts found = contacts(part(p), part(q));
        if (found.count == 0) continue;
        const double depth = depth_of(found);
        if (depth <= settings_.tolerance) continue;
        const auto end = active_.begin() + count_;
        if (std::find(active_.begin(), end, other) == end) {
          before_[at(other)] = poses[at(other)];
          active_[at(count_++)] = other;
        }
        deepest = std::max(deepest, depth);
        separate(found, body(k), body(other));
        place(k, poses);
        place(other, poses);
      }
    }
  }
  return deepest;
}

/// Moves the objects out of the way of one small robot step. Returns the overlap that is left.
double QuasiStatic::resolve(const Pose& from, const Pose& to, std::span<Pose> poses) {
  transform(to, bodies_.robot.vertices, robot_.data());
  const Index touched = touching({to.x, to.y}, bodies_.robot_radius, poses);
  for (Index i = 0; i < count_; ++i) before_[at(active_[at(i)])] = poses[at(active_[at(i)])];
  double left = 0.0;
  for (Index round = 0; round < settings_.iterations; ++round) {
    left = 0.0;
    for (Index i = 0; i < count_; ++i) {
      const Index k = active_[at(i)];
      if (i < touched) left = std::max(left, against_robot(k, from, to, poses));
      if (!(poses[at(k)] == before_[at(k)])) {
        left = std::max(left, against_objects(i, poses));
        left = std::max(left, against_walls(k, poses));
      }
    }
    if (left <= settings_.tolerance) break;
  }
  return left;
}

bool QuasiStatic::advance(const Pose& robot_from, const Pose& robot_to, std::span<Pose> poses,
                          std::span<double> lengths) {
  const double dx = robot_to.x - robot_from.x;
  const double dy = robot_to.y - robot_from.y;
  double turn = robot_to.theta - robot_from.theta;
  turn -= kTurn * std::rint(turn / kTurn);  // the short way
  const double distance = std::sqrt(dx * dx + dy * dy);
  const double motion = distance + std::abs(turn) * bodies_.robot_radius;
  const Vec2 middle{robot_from.x + 0.5 * dx, robot_from.y + 0.5 * dy};
  const double reach = bodies_.robot_radius + 0.5 * distance;
  gather(middle, reach + kNearby * bodies_.robot_radius, poses);
  if (touching(middle, reach, poses) == 0) return true;
  const Index steps =
      std::max<Index>(1, static_cast<Index>(std::ceil(motion / settings_.max_step)));
  Pose here = robot_from;
  for (Index step = 1; step <= steps; ++step) {
    const double part = static_cast<double>(step) / static_cast<double>(steps);
    const Pose there{robot_from.x + part * dx, robot_from.y + part * dy,
                     robot_from.theta + part * turn};
    for (const Index k : near_) saved_[at(k)] = poses[at(k)];
    const double left = resolve(here, there, poses);
    const bool jams = left > settings_.jam_depth;
    for (const Index k : near_) {
      Pose& pose = poses[at(k)];
      const Pose& saved = saved_[at(k)];
      if (jams) {
        pose = saved;
      } else if (pose.x != saved.x || pose.y != saved.y) {
        const double gx = pose.x - saved.x;
        const double gy = pose.y - saved.y;
        lengths[at(k)] += std::sqrt(gx * gx + gy * gy);
      }
    }
    if (jams) return false;
    here = there;
  }
  return true;
}

bool QuasiStatic::robot_held(const Pose& pose) {
  bool placed = false;
  for (Index part = 0; part < bodies_.walls.count(); ++part) {
    if (!reaches(bodies_.wall_boxes[at(part)], pose.x, pose.y, bodies_.robot_radius)) continue;
    if (!placed) {
      transform(pose, bodies_.robot.vertices, robot_.data());
      placed = true;
    }
    const Polygon wall = bodies_.walls[part];
    const Polygons pieces{robot_, bodies_.robot.offsets};
    for (Index piece = 0; piece < bodies_.wall_parts; ++piece) {
      const double gap = std::max(least_overlap(wall, pieces[piece]).first,
                                  least_overlap(pieces[piece], wall).first);
      if (gap < -settings_.jam_depth) return true;
    }
  }
  return false;
}

Index QuasiStatic::sweep(std::span<const Pose> path, std::span<Pose> poses,
                         ArrayView<Pose, 2> out) {
  Index jammed = -1;
  std::copy(poses.begin(), poses.end(), out.row(0).begin());
  for (std::size_t n = 1; n < path.size(); ++n) {
    if (jammed < 0 && (robot_held(path[n]) || !advance(path[n - 1], path[n], poses, unused_))) {
      jammed = static_cast<Index>(n);
    }
    std::copy(poses.begin(), poses.end(), out.row(static_cast<Index>(n)).begin());
  }
  return jammed;
}

}  // namespace pushplan
