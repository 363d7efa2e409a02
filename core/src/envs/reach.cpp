#include "pushplan/envs/reach.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pushplan/geometry/convex.hpp"

namespace pushplan {
namespace {

constexpr int kAdvances = 64;  // looks at the gap at most

double distance(const Pose& a, const Pose& b) { return std::hypot(a.x - b.x, a.y - b.y); }

}  // namespace

Pose arc_pose(const Pose& start, const ArcMotion& motion, double time) {
  const double half = 0.5 * motion.angular * time;
  double chord = motion.linear * time;
  double middle = motion.course;
  if (!motion.holds) {
    middle += half;
    if (half != 0.0) chord *= std::sin(half) / half;
  }
  return {start.x + chord * std::cos(middle), start.y + chord * std::sin(middle),
          start.theta + 2.0 * half};
}

Reach::Reach(const ReachShapes& shapes)
    : shapes_(shapes),
      robot_(shapes.robot.vertices.size()),
      corners_(shapes.objects.vertices.size()),
      moving_(shapes.objects.vertices.size()),
      near_(shapes.radii.size()) {
  for (const Vec2 corner : shapes.robot.vertices) {
    size_ = std::max(size_, std::hypot(corner.x, corner.y));
  }
  close_objects_.reserve(shapes.radii.size());
}

std::span<Vec2> Reach::outline(Index k) {
  const auto& offsets = shapes_.objects.offsets;
  return std::span(corners_).subspan(at(offsets[at(k)]), at(offsets[at(k) + 1] - offsets[at(k)]));
}

/// Works out the corners of object k in the world frame.
void Reach::place(Index k, const Pose& pose) {
  transform(pose, shapes_.objects[k], outline(k).data());
}

void Reach::within(const Pose& robot, double reach, std::span<const Pose> objects,
                   std::span<const double> speeds, std::span<bool> found) {
  const auto& radii = shapes_.radii;
  transform(robot, shapes_.robot.vertices, robot_.data());
  const Polygons parts{robot_, shapes_.robot.offsets};
  for (std::size_t k = 0; k < objects.size(); ++k) {
    found[k] = false;
    near_[k] = speeds[k] > 0.0;
    if (near_[k] || distance(objects[k], robot) - size_ - radii[k] > reach + speeds[k]) continue;
    const auto number = static_cast<Index>(k);
    place(number, objects[k]);
    for (Index part = 0; part < parts.count() && !near_[k]; ++part) {
      near_[k] = convex_distance(parts[part], outline(number)) <= reach;
    }
  }
  for (std::size_t k = 0; k < objects.size(); ++k) {
    if (!near_[k]) continue;
    found[k] = true;
    for (std::size_t other = 0; other < objects.size(); ++other) {
      if (found[other] || near_[other]) continue;
      const double gap = distance(objects[k], objects[other]) - radii[k] - radii[other];
      found[other] = gap <= 0.5 * reach + speeds[k];
    }
  }
}

double Reach::clear_time(const Pose& robot, const ArcMotion& motion, double limit, double margin,
                         std::span<const Pose> objects, const Obstacles& obstacles) {
  const auto& radii = shapes_.radii;
  const double speed = std::abs(motion.linear) + std::abs(motion.angular) * size_;
  const double reach = speed * limit + margin;
  close_objects_.clear();
  for (std::size_t k = 0; k < objects.size(); ++k) {
    if (distance(objects[k], robot) - size_ - radii[k] > reach) continue;
    place(static_cast<Index>(k), objects[k]);
    close_objects_.push_back(static_cast<Index>(k));
  }
  close_walls_.clear();
  for (Index k = 0; k < obstacles.cores.count(); ++k) {
    const double gap = core_distance({robot.x, robot.y}, obstacles.cores[k]);
    if (gap - obstacles.radii[at(k)] - size_ <= reach) close_walls_.push_back(k);
  }
  if (close_objects_.empty() && close_walls_.empty()) return limit;
  const Polygons parts{robot_, shapes_.robot.offsets};
  double time = 0.0;
  for (int i = 0; i < kAdvances; ++i) {
    const Pose here = arc_pose(robot, motion, time);
    transform(here, shapes_.robot.vertices, robot_.data());
    double least = std::numeric_limits<double>::infinity();
    const auto look = [&](Polygon shape, double radius, double gap) {
      if (gap - size_ >= least) return;
      for (Index part = 0; part < parts.count(); ++part) {
        least = std::min(least, convex_distance(parts[part], shape) - radius);
      }
    };
    for (const Index k : close_objects_) {
      look(outline(k), 0.0, distance(objects[at(k)], here) - radii[at(k)]);
    }
    for (const Index k : close_walls_) {
      const Polygon core = obstacles.cores[k];
      const double radius = obstacles.radii[at(k)];
      look(core, radius, core_distance({here.x, here.y}, core) - radius);
    }
    if (least <= margin) break;
    if (speed == 0.0) return limit;
    time += (least - 0.5 * margin) / speed;
    if (time >= limit) return limit;
  }
  return time;
}

void Reach::struck(std::span<const bool> loaded, ArrayView<const Pose, 2> paths,
                   std::span<const Pose> before, std::span<bool> found) {
  const auto& radii = shapes_.radii;
  const Index steps = paths.extent(0);
  const auto count = static_cast<Index>(before.size());
  std::fill(found.begin(), found.end(), false);
  for (Index k = 0; k < count; ++k) {
    if (!loaded[at(k)]) continue;
    const Pose last = paths(steps - 1, k);
    if (last == before[at(k)]) continue;
    const double way = distance(last, before[at(k)]);
    const Polygon body = shapes_.objects[k];
    const Polygon here(moving_.data(), body.size());
    for (Index other = 0; other < count; ++other) {
      if (loaded[at(other)] || found[at(other)]) continue;
      if (distance(before[at(other)], last) - radii[at(other)] - radii[at(k)] > way) continue;
      place(other, before[at(other)]);
      for (Index t = 0; t < steps && !found[at(other)]; ++t) {
        transform(paths(t, k), body, moving_.data());
        found[at(other)] = convex_overlap(here, outline(other));
      }
    }
  }
}

}  // namespace pushplan
