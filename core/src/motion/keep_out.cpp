#include "pushplan/motion/keep_out.hpp"

#include <algorithm>

#include "pushplan/geometry/convex.hpp"
#include "pushplan/geometry/polygon.hpp"

namespace pushplan {
namespace {

constexpr std::size_t kGrownMaps = 4;  // that are kept with a map, each with all that is made of it
constexpr int kLevels = 4;  // fractions of the margin that an obstacle near the robot may keep

/// Part `k` of a map as planners see it when it has grown.
Outline grown_part(const StaticMap& map, Index k, double margin) {
  const Index line = k - map.polygons().count();
  if (line < 0) return grown_outline(map.polygons()[k], margin);
  const Wall& wall = map.lines()[static_cast<std::size_t>(line)];
  return capsule({wall.line, wall.radius + margin});
}

/// How far part `k` of a map grows [m] near the robot, which is given in the world frame.
double part_margin(const StaticMap& map, Index k, double margin, Polygons robot) {
  for (int level = kLevels; level > 0; --level) {
    const Outline grown = grown_part(map, k, margin * level / kLevels);
    bool free = true;
    for (Index i = 0; i < robot.count(); ++i) free = free && !convex_overlap(grown, robot[i]);
    if (free) return level == kLevels ? margin : margin * (level - 1) / kLevels;
  }
  return 0.0;
}

/// The map with each part grown by its own margin.
std::shared_ptr<StaticMap> grown_map(const StaticMap& map, std::span<const double> margins) {
  OwnPolygons polygons;
  std::vector<Wall> lines(map.lines().begin(), map.lines().end());
  auto margin = margins.begin();
  for (Index k = 0; k < map.polygons().count(); ++k) polygons.add(grown_part(map, k, *margin++));
  for (Wall& line : lines) line.radius += *margin++;
  return std::make_shared<StaticMap>(std::move(polygons), std::move(lines), map.bounds());
}

}  // namespace

std::shared_ptr<const StaticMap> keep_out(const std::shared_ptr<const StaticMap>& map,
                                          Polygons wall_parts, double size, const Pose& pose,
                                          double margin) {
  if (margin == 0.0) return map;
  std::vector<Vec2> corners(wall_parts.vertices.size());
  transform(pose, wall_parts.vertices, corners.data());
  const Box at{pose.x, pose.y, pose.x, pose.y};
  std::vector<double> margins(map->boxes().size(), margin);
  for (std::size_t k = 0; k < margins.size(); ++k) {
    if (map->boxes()[k].apart(at, size + 2.0 * margin)) continue;
    margins[k] = part_margin(*map, static_cast<Index>(k), margin, {corners, wall_parts.offsets});
  }
  return map->kept<StaticMap>(margins, [&] { return grown_map(*map, margins); }, kGrownMaps);
}

}  // namespace pushplan
