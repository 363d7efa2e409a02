#include "pushplan/motion/collision.hpp"

#include <algorithm>
#include <cmath>

#include "pushplan/geometry/convex.hpp"
#include "pushplan/geometry/obstacles.hpp"

namespace pushplan {
namespace {

constexpr Index kRun = 32;  // poses for which groups that are near are looked for together

/// True if the square around a disc overlaps a box.
bool reaches(const Box& box, const Pose& at, double radius) {
  return at.x + radius > box.x_min && at.x - radius < box.x_max && at.y + radius > box.y_min &&
         at.y - radius < box.y_max;
}

}  // namespace

bool disc_touches(Vec2 centre, double radius, const ConvexObstacles& obstacles) {
  for (Index s = 0; s < obstacles.count(); ++s) {
    const Box& box = obstacles.boxes[static_cast<std::size_t>(s)];
    if (centre.x + radius < box.x_min || centre.x - radius > box.x_max ||
        centre.y + radius < box.y_min || centre.y - radius > box.y_max) {
      continue;
    }
    if (core_distance(centre, obstacles.polygons[s]) < radius) return true;
  }
  return false;
}

CollisionChecker::CollisionChecker(const Footprint& footprint, const ConvexObstacles& obstacles)
    : footprint_(footprint), obstacles_(obstacles), corners_(footprint.parts.vertices.size()) {}

bool CollisionChecker::overlaps(Polygon obstacle) const {
  const Polygons placed{corners_, footprint_.parts.offsets};
  for (Index part = 0; part < placed.count(); ++part) {
    if (convex_overlap(placed[part], obstacle)) return true;
  }
  return false;
}

bool CollisionChecker::touches(const Pose& pose, Index group, bool& placed) {
  if (!reaches(obstacles_.groups[static_cast<std::size_t>(group)], pose, footprint_.radius)) {
    return false;
  }
  const Index first = group * ConvexObstacles::kGroup;
  const Index end = std::min(first + ConvexObstacles::kGroup, obstacles_.count());
  for (Index s = first; s < end; ++s) {
    if (!reaches(obstacles_.boxes[static_cast<std::size_t>(s)], pose, footprint_.radius)) continue;
    if (!placed) {
      transform(pose, footprint_.parts.vertices, corners_.data());
      placed = true;
    }
    if (overlaps(obstacles_.polygons[s])) return true;
  }
  return false;
}

bool CollisionChecker::is_free(const Pose& pose) {
  if (!obstacles_.bounds.contains({pose.x, pose.y}, 0.0)) return false;
  bool placed = false;
  for (Index group = 0; group < obstacles_.group_count(); ++group) {
    if (touches(pose, group, placed)) return false;
  }
  return true;
}

Index CollisionChecker::first_blocked(std::span<const Pose> poses) {
  const auto count = static_cast<Index>(poses.size());
  for (Index first = 0; first < count; first += kRun) {
    const Index end = std::min(first + kRun, count);
    const auto run =
        poses.subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(end - first));
    const auto [left, right] = std::ranges::minmax(run, {}, &Pose::x);
    const auto [low, high] = std::ranges::minmax(run, {}, &Pose::y);
    const Pose middle{0.5 * (left.x + right.x), 0.5 * (low.y + high.y), 0.0};
    const double half = std::max(right.x - left.x, high.y - low.y);  // twice what is needed
    near_.clear();
    for (Index group = 0; group < obstacles_.group_count(); ++group) {
      const Box& box = obstacles_.groups[static_cast<std::size_t>(group)];
      if (!std::isfinite(half) || reaches(box, middle, half + footprint_.radius)) {
        near_.push_back(group);
      }
    }
    for (Index i = first; i < end; ++i) {
      const Pose& pose = poses[static_cast<std::size_t>(i)];
      bool placed = false;
      if (!obstacles_.bounds.contains({pose.x, pose.y}, 0.0) ||
          std::ranges::any_of(near_, [&](Index k) { return touches(pose, k, placed); })) {
        return i;
      }
    }
  }
  return count;
}

double CollisionChecker::depth(const Pose& pose) {
  double deepest = 0.0;
  if (is_free(pose)) return deepest;
  transform(pose, footprint_.parts.vertices, corners_.data());
  const Polygons placed{corners_, footprint_.parts.offsets};
  for (Index s = 0; s < obstacles_.count(); ++s) {
    if (!reaches(obstacles_.boxes[static_cast<std::size_t>(s)], pose, footprint_.radius)) continue;
    for (Index part = 0; part < placed.count(); ++part) {
      deepest = std::max(deepest, convex_penetration(placed[part], obstacles_.polygons[s]).depth);
    }
  }
  return deepest;
}

}  // namespace pushplan
