// A coarse shortest path that trades length against pushing: where sampling is worth while.
#pragma once

#include <memory>
#include <span>

#include "pushplan/geometry/static_map.hpp"
#include "pushplan/motion/goal_region.hpp"

namespace pushplan {

/// What a coarse path knows of a robot.
struct CoarseRobot {
  double inscribed;      // radius [m]
  double circumscribed;  // radius [m]
};

class CellSearch;

/// A search for the cheapest path of the robot's centre over a grid. The map has to outlive it.
class CoarsePath {
 public:
  CoarsePath(const StaticMap& map,  // with the margin to keep
             const CoarseRobot& robot, Vec2 start, const GoalRegion& goal,
             const Polygons& objects,           // convex parts in the world frame, copied
             std::span<const double> weights);  // extra cost per metre in each part, infinite for
                                                // an obstacle

  /// Goes on for about half a millisecond; true when done.
  bool run();
  /// Points about one cell apart [m]; none where there is no path, or the search is not done.
  std::span<const Vec2> points() const;

 private:
  std::shared_ptr<CellSearch> search_;
};

/// A search for whether the robot's inscribed disc may get from a start to a goal around walls. The
/// map has to outlive it.
class Reachable {
 public:
  Reachable(const StaticMap& map, const CoarseRobot& robot, Vec2 start, const GoalRegion& goal);

  /// Goes on for about half a millisecond; true when done.
  bool run();
  /// True if it certainly does not get there; known when the search is done.
  bool is_sealed() const;

 private:
  std::shared_ptr<CellSearch> search_;  // none where cells are too coarse to tell
};

}  // namespace pushplan
