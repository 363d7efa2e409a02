// Search for a path on which a robot gets away from where it stands, or out of a tight place.
#pragma once

#include <span>
#include <vector>

#include "pushplan/motion/collision.hpp"
#include "pushplan/motion/dubins.hpp"
#include "pushplan/motion/goal_region.hpp"
#include "pushplan/zeroed_array.hpp"

namespace pushplan {

/// Free space of a robot. Objects do not count, as they may be pushed.
struct Room {
  Footprint footprint;
  ConvexObstacles walls;
  GoalRegion goal;
  double spacing;  // greatest distance between two poses of a path [m]
};

/// Moves that an exploration tries, and conditions that end it.
struct RoomRules {
  std::span<const Arc> moves;  // to try from each pose
  double reach;                // distance at which the robot has got away [m]
  double clearance;            // of places to turn about that are looked for, 0 for none [m]
  bool breadth;                // fewest moves first; else the last move from the last pose
};

/// Boxes of poses of which one is looked at each.
struct PoseBoxes {
  double side;  // [m]
  double turn;  // [rad]
  Index half;   // boxes on each side of that of the start
  Index headings;
};

/// An exploration that runs in batches; what the room and the rules refer to has to outlive it.
class RoomExploration {
 public:
  enum class Outcome { kAway, kClosed, kPaused };

  RoomExploration(const Room& room, const RoomRules& rules, const Pose& start,
                  const PoseBoxes& boxes, Index capacity);  // poses that are kept at most

  /// Goes on until so many poses are looked at in all.
  Outcome run(Index upto);

  /// The arcs from the start to the pose that is away.
  std::vector<Arc> arcs() const;

 private:
  struct Node {
    Pose pose;
    Index before;
    Index move;  // that has led to it
  };

  static constexpr Index kNowhere = -1;

  Index take();
  bool drive(const Pose& from, const Arc& move, Pose& end);
  Index box_of(const Pose& pose) const;
  bool is_away(const Pose& pose) const;

  Room room_;
  RoomRules rules_;
  PoseBoxes boxes_;
  CollisionChecker checker_;
  std::vector<Node> nodes_;
  std::vector<Index> open_;  // nodes to go on from; a queue has taken the first `taken_` of them
  std::size_t taken_ = 0;
  std::size_t capacity_;
  Index looked_at_ = 0;
  Index away_ = kNowhere;
  ZeroedArray<bool> seen_;
};

}  // namespace pushplan
