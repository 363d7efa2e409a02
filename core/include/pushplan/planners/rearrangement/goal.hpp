// The goal of the objects, and the test of objects against it.
#pragma once

#include <span>
#include <vector>

#include "pushplan/geometry/pose.hpp"

namespace pushplan::rearrangement {

/// Coordinate of an object that a receptacle has taken [m].
inline constexpr double kRemoved = 1e7;

/// A point lies within an edge where `normal . point <= offset`.
struct GoalEdge {
  Vec2 normal;    // unit, outwards
  double offset;  // [m]
};

struct ObjectGoal {
  Polygon polygon;                  // the area that objects have to leave, or get into [m]
  std::span<const GoalEdge> edges;  // within which a delivered object lies
  bool is_receptacle;               // objects have to get into the polygon, and are removed there
  double slack;  // by how much an object has to be clear of the polygon's edge [m]
};

/// The test of objects against their goal, with memory for one thread: all parts of an object have
/// to be where it belongs. The shapes and the goal have to outlive it.
class GoalTest {
 public:
  GoalTest(const Compounds& shapes, const ObjectGoal& goal);

  const ObjectGoal& goal() const { return goal_; }

  /// True if object `k` is where it belongs.
  bool is_done(Index k, const Pose& pose);

  /// The same of each object.
  void all_done(std::span<const Pose> poses, std::span<bool> done);

 private:
  bool may_be_done(Vec2 middle) const;
  bool is_clear(Polygon part) const;

  Compounds shapes_;
  ObjectGoal goal_;
  std::vector<Vec2> part_;  // of one object in the world frame
};

}  // namespace pushplan::rearrangement
