// What never moves, with all that searches make of it, kept for the next call on the same map.
#pragma once

#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <typeindex>
#include <utility>
#include <vector>

#include "pushplan/geometry/obstacles.hpp"

namespace pushplan {

/// Corners of a convex polygon [m].
using Outline = std::vector<Vec2>;

/// Polygons one after the other that own their corners.
struct OwnPolygons {
  void add(Polygon outline) {
    vertices.insert(vertices.end(), outline.begin(), outline.end());
    offsets.push_back(static_cast<Index>(vertices.size()));
  }
  Polygons polygons() const { return {vertices, offsets}; }

  std::vector<Vec2> vertices{};
  std::vector<Index> offsets{0};
};

inline OwnPolygons copy_of(const Polygons& polygons) {
  OwnPolygons own;
  for (Index k = 0; k < polygons.count(); ++k) own.add(polygons[k]);
  return own;
}

/// Convex polygons in groups of neighbours, which own their arrays.
class OwnObstacles {
 public:
  OwnObstacles(Polygons polygons, const Box& bounds);

  ConvexObstacles view() const { return {shapes_.polygons(), boxes_, groups_, bounds_}; }

 private:
  OwnPolygons shapes_;
  std::vector<Box> boxes_;
  std::vector<Box> groups_;
  Box bounds_;
};

/// A thick line: everything within a radius of a segment.
struct Wall {
  Segment line;
  double radius = 0.0;  // [m]
};

/// A polygon around a thick line, at most 1.6 % of the radius too large at its ends.
Outline capsule(const Wall& wall);

/// Convex polygons and thick lines, in the world frame. Thread-safe.
class StaticMap {
 public:
  StaticMap(OwnPolygons polygons,  // convex, counter-clockwise
            std::vector<Wall> lines,
            const Box& bounds);  // where paths may lead

  const Box& bounds() const { return bounds_; }
  Polygons polygons() const {
    return {cores_.vertices, std::span(cores_.offsets).first(polygon_count_ + 1)};
  }
  std::span<const Wall> lines() const { return lines_; }
  /// The polygons, then lines of two corners each, without their radii.
  Polygons cores() const { return cores_.polygons(); }
  /// Everything as convex polygons: lines become a `capsule`; one of radius 0 becomes a millionth of
  /// the map thick.
  Polygons parts() const { return parts_.polygons(); }
  std::span<const Box> boxes() const { return boxes_; }  // around the parts
  /// The parts, sorted for collision checks.
  ConvexObstacles walls() const { return walls_.view(); }

  /// What has been made of the map, or else is made now; of each kind of thing the last few by
  /// their keys, which hold all that it depends on.
  template <class T, class Make>
  std::shared_ptr<T> kept(std::vector<double> key, Make make, std::size_t most = 16) const {
    return std::static_pointer_cast<T>(kept_as(
        typeid(T), std::move(key), [&]() -> std::shared_ptr<void> { return make(); }, most));
  }

 private:
  struct Kept {
    std::type_index kind;
    std::vector<double> key;
    std::shared_ptr<void> made;
  };

  static OwnPolygons parts_of(const OwnPolygons& polygons, std::span<const Wall> lines,
                              const Box& bounds);
  std::shared_ptr<void> kept_as(std::type_index kind, std::vector<double> key,
                                const std::function<std::shared_ptr<void>()>& make,
                                std::size_t most) const;

  OwnPolygons cores_;
  std::size_t polygon_count_;
  std::vector<Wall> lines_;
  Box bounds_;
  OwnPolygons parts_;
  std::vector<Box> boxes_;
  OwnObstacles walls_;
  mutable std::mutex mutex_;
  mutable std::list<Kept> kept_;  // the last used first
};

}  // namespace pushplan
