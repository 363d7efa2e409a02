#include "pushplan/motion/collision.hpp"

#include <algorithm>

#include "pushplan/geometry/convex.hpp"
#include "pushplan/geometry/obstacles.hpp"

namespace pushplan {
namespace {

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

bool CollisionChecker::is_free(const Pose& pose) {
  if (!obstacles_.bounds.contains({pose.x, pose.y}, 0.0)) return false;
  bool placed = false;
  Index first = 0;
  for (const Box& group : obstacles_.groups) {
    const Index end = std::min(first + ConvexObstacles::kGroup, obstacles_.count());
    if (reaches(group, pose, footprint_.radius)) {
      for (Index s = first; s < end; ++s) {
        if (!reaches(obstacles_.boxes[static_cast<std::size_t>(s)], pose, footprint_.radius)) {
          continue;
        }
        if (!placed) {
          transform(pose, footprint_.parts.vertices, corners_.data());
          placed = true;
        }
        if (overlaps(obstacles_.polygons[s])) return false;
      }
    }
    first += ConvexObstacles::kGroup;
  }
  return true;
}

Index CollisionChecker::first_blocked(std::span<const Pose> poses) {
  const auto blocked =
      std::find_if(poses.begin(), poses.end(), [&](const Pose& pose) { return !is_free(pose); });
  return blocked - poses.begin();
}

double CollisionChecker::depth(const Pose& pose) {
  double deepest = 0.0;
  if (is_free(pose)) return deepest;
  transform(pose, footprint_.parts.vertices, corners_.data());
  const Polygons placed{corners_, footprint_.parts.offsets};
  for (Index s = 0; s < obstacles_.count(); ++s) {
    for (Index part = 0; part < placed.count(); ++part) {
      deepest = std::max(deepest, convex_penetration(placed[part], obstacles_.polygons[s]).depth);
    }
  }
  return deepest;
}

}  // namespace pushplan
