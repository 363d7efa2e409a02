// Search for a path on which a robot gets away from where it stands, or out of a tight place.
#pragma once

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

/// The moves of a robot besides arcs ahead.
struct ExtraMoves {
  bool reverses;
  bool turns_on_spot;
};

/// Moves that an exploration tries, and conditions that end it.
struct RoomRules {
  std::vector<Arc> moves;  // to try from each pose; the last is straight ahead
  double reach;            // distance at which the robot has got away [m]
  double clearance;        // of places to turn about that are looked for, 0 for none [m]
  bool breadth;            // fewest moves first; else the last move from the last pose
  Index most;              // poses that are looked at
};

/// An exploration that runs in pieces, by one set of rules after the other until one of them gives
/// the answer. What the room refers to has to outlive it.
class RoomExploration {
 public:
  RoomExploration(const Room& room, std::vector<RoomRules> rules, const Pose& start);

  /// Goes on for about half a millisecond. True when it is done.
  bool run();

  /// True if the robot gets away, over `arcs`.
  bool away() const { return away_ != kNowhere; }
  /// True if nothing leads away; neither is true before it is done, or after too many poses.
  bool closed() const { return done_ && !away() && exhausted(); }

  /// The arcs from the start to the pose that is away.
  std::vector<Arc> arcs() const;

 private:
  struct Node {
    Pose pose;
    Index before;
    Index move;  // that has led to it
  };
  /// Boxes of poses of which one is looked at each.
  struct Boxes {
    double side;  // [m]
    double turn;  // [rad]
    Index half;   // boxes on each side of that of the start
    Index headings;
    Index width() const { return 2 * half + 1; }
  };

  static constexpr Index kNowhere = -1;

  const RoomRules& rules() const { return tries_[try_]; }
  bool exhausted() const { return taken_ == open_.size(); }
  void begin();
  void look_at_poses(Index upto);
  Index take();
  bool drive(const Pose& from, const Arc& move, Pose& end);
  Index box_of(const Pose& pose) const;
  bool is_away(const Pose& pose) const;

  Room room_;
  std::vector<RoomRules> tries_;
  std::size_t try_ = 0;
  bool done_;
  Pose start_;
  Boxes boxes_{};
  CollisionChecker checker_;
  std::vector<Node> nodes_;
  std::vector<Index> open_;  // nodes to go on from; a queue has taken the first `taken_` of them
  std::size_t taken_ = 0;
  Index looked_at_ = 0;
  Index away_ = kNowhere;
  ZeroedArray<bool> seen_{0};
};

/// Finds out whether forward arcs lead from a pose to the goal or three robot sizes away: steps
/// straight ahead, taken up first, and of the least turning radius. `size` is the robot's
/// circumscribed radius [m].
RoomExploration explore_ahead(const Room& room, const Pose& start, double size, double radius);

/// Finds out whether anything that a robot can do gets it there. Where it seems closed, shorter
/// steps are tried too.
RoomExploration explore_around(const ExtraMoves& extra, const Room& room, const Pose& start,
                               double size, double radius);

/// Finds the drive with the fewest moves to where a differential drive can turn about, or far away.
/// There is none where it can turn about at the start.
RoomExploration explore_to_turn(const ExtraMoves& extra, const Room& room, const Pose& start,
                                double size);

}  // namespace pushplan
