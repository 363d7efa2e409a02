// Random shapes, and shapes that own their corners.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "pushplan/geometry/pose.hpp"
#include "pushplan/random.hpp"

namespace pushplan::tests {

inline bool near_to(double a, double b, double tolerance = 1e-9) {
  return std::abs(a - b) <= tolerance;
}

inline double between(Xorshift64Star& random, double low, double high) {
  return low + (high - low) * random.uniform();
}

inline Pose random_pose(Xorshift64Star& random, double reach) {
  return {between(random, -reach, reach), between(random, -reach, reach),
          between(random, -std::numbers::pi, std::numbers::pi)};
}

inline std::vector<Vec2> rectangle(double x_min, double y_min, double x_max, double y_max) {
  return {{x_min, y_min}, {x_max, y_min}, {x_max, y_max}, {x_min, y_max}};
}

/// Corners on an ellipse about a point whose greater half axis is `size`.
inline std::vector<Vec2> convex_shape(Xorshift64Star& random, Vec2 centre, double size) {
  const Index count = 3 + random.below(6);
  const double flatness = between(random, 0.3, 1.0);
  const double turn = between(random, 0.0, 2.0 * std::numbers::pi);
  std::vector<Vec2> corners;
  for (Index i = 0; i < count; ++i) {
    const double part =
        (static_cast<double>(i) + between(random, 0.0, 0.8)) / static_cast<double>(count);
    const double angle = 2.0 * std::numbers::pi * part;
    corners.push_back({size * std::cos(angle), flatness * size * std::sin(angle)});
  }
  transform({centre.x, centre.y, turn}, corners, corners.data());
  return corners;
}

inline double radius_of(Polygon polygon) {
  double radius = 0.0;
  for (const Vec2 corner : polygon) radius = std::max(radius, std::hypot(corner.x, corner.y));
  return radius;
}

/// Polygons with their radii about the origin and the boxes around them.
struct Shapes {
  std::vector<Vec2> vertices;
  std::vector<Index> offsets{0};
  std::vector<double> radii;
  std::vector<Box> boxes;

  Shapes() = default;
  explicit Shapes(const std::vector<std::vector<Vec2>>& polygons) {
    for (const auto& polygon : polygons) add(polygon);
  }

  void add(Polygon polygon) {
    vertices.insert(vertices.end(), polygon.begin(), polygon.end());
    offsets.push_back(static_cast<Index>(vertices.size()));
    radii.push_back(radius_of(polygon));
    boxes.push_back(box_around(polygon));
  }

  Polygons polygons() const { return {vertices, offsets}; }
};

inline std::vector<Vec2> placed(const Pose& pose, Polygon polygon) {
  std::vector<Vec2> corners(polygon.size());
  transform(pose, polygon, corners.data());
  return corners;
}

}  // namespace pushplan::tests
