// The best path of a search from one place to a goal, and how paths get better.
#pragma once

#include <optional>
#include <vector>

#include "pushplan/motion/footprint.hpp"
#include "pushplan/motion/goal_approach.hpp"
#include "pushplan/motion/room_ahead.hpp"
#include "pushplan/navigation/pushing.hpp"
#include "pushplan/navigation/task.hpp"
#include "pushplan/random.hpp"
#include "scene.hpp"

namespace pushplan {

inline constexpr double kInset = 0.05;      // depth in the goal at which a plan ends [R]
inline constexpr double kEdge = 1.6;        // longest edge of a tree [R]
inline constexpr double kTightest = 0.1;    // least turning radius that plans ever use [R]

/// What all searches of one planning call share.
struct Session {
  const Scene& scene;
  Pushing& pushing;
  Random random;
  Pauses pauses{};
  PlannerCounts counts{};

  void count(Index iterations) {
    counts.iterations += iterations;
    pauses.change();
  }
};

/// Where a search begins and ends: the scene, or a window of it.
struct Problem {
  std::shared_ptr<const StaticMap> map;  // of what the robot keeps out of
  Pose start;
  std::vector<Pose> objects;  // (K,)
  GoalRegion goal;
};

/// Motion with which every path of a search begins, before the search itself.
struct Lead {
  std::vector<Arc> arcs;  // a turn on the spot has an infinite curvature
  Pose pose;              // where the search begins
  std::vector<Pose> objects;  // (K,) by then
};

/// A path that is being shortcut, in place; it may be the best one.
struct Candidate {
  std::shared_ptr<SweptPath> path;
  SweptPath trial;
  double cost;
};

class PathImprover {
 public:
  PathImprover(Session& session, Problem problem, double radius);
  /// The same search with another prediction of what is pushed.
  PathImprover(const PathImprover& other, Pushing& pushing) : PathImprover(other) {
    pushing_ = &pushing;
  }

  /// Finds the margin that can be kept; a status where the search ends here already.
  std::optional<PlanStatus> begin();
  /// Begins all paths with some motion from now on; none begins at the start.
  void begin_with(std::optional<Lead> lead) { lead_ = lead ? std::move(*lead) : no_lead(); }
  /// Allows tighter turns from the second time on, and less margin from the fourth. That helps
  /// where the robot starts in a tight place or has to turn round first. The margin comes last:
  /// who drives without it may touch a wall.
  void relax();

  PathProblem path_problem() const;
  Room room() const;
  CollisionChecker checker() const { return {footprint_.view(), problem_.map->walls()}; }
  double jam_cost() const { return jam_length_ * robot().mass; }
  bool solved() const { return best_cost_ < jam_cost(); }
  double plan_cost() const { return solved() ? best_cost_ : kInfinity; }
  /// True if the search is over: in a window with the first plan, or after so many iterations.
  bool over() const { return session_.counts.iterations >= last_ || (is_window_ && solved()); }
  void make_window(Index iterations) {
    is_window_ = true;
    last_ = session_.counts.iterations + iterations;
  }

  /// The path along some arcs from the end of the lead on, with the objects that it moves; none
  /// where it costs as much as `limit`, or cannot take the heading of the goal there.
  Task<std::optional<Candidate>> candidate(std::vector<Arc> arcs, double limit);
  /// Keeps the path along some arcs where it touches no wall, jams nothing and arrives.
  Task<bool> drives(std::vector<Arc> arcs);
  /// Keeps the straight way from place to place likewise, turning at an even rate: at the goal's
  /// heading, or the robot's own, at last. Where it touches a wall, the turn is made away from both
  /// ends, which may lie in a slot.
  Task<bool> slides(std::vector<Vec2> places);
  /// Lays poses along arcs, with room for as many again `spare - 1` times.
  SweptPath laid_out(const Pose& start, std::span<const Arc> arcs, double spare) const;
  /// The same path with the heading of the goal at its end, if that asks for one; none where there
  /// is no such end.
  std::optional<SweptPath> ended(SweptPath path) const;
  /// The cost of a path whose objects are known up to `known` poses [kg m]; infinite where it
  /// reaches the limit.
  Task<double> sweep(SweptPath& path, Index count, double limit, Index known = 1);
  Index first_blocked(const SweptPath& path, Index known = 0) const;

  /// True if a robot at a pose is at the goal of whole paths.
  bool reached_by(const Pose& pose) const;
  /// Tries a round of shortcuts.
  Task<void> shortcut(Candidate& candidate);
  /// Shortcuts a path for as long as that pays, and it may still become the best.
  Task<void> work_out(Candidate& candidate);
  Task<void> work_out_best();
  /// Keeps a swept path if it is the best so far.
  void keep(const std::shared_ptr<SweptPath>& path, double cost);

  const Robot& robot() const { return session_.scene.robot(); }
  double size() const { return session_.scene.size; }
  Session& session() const { return session_; }
  const Problem& problem() const { return problem_; }
  const Lead& lead() const { return lead_; }
  const GoalRegion& goal() const { return goal_; }  // that searches lead to
  bool has_pose_goal() const { return problem_.goal.has_heading(); }
  double turning_radius() const { return turning_radius_; }
  int relaxed() const { return relaxed_; }
  double best_cost() const { return best_cost_; }
  /// It may get better while somebody works on it.
  const std::shared_ptr<SweptPath>& best() const { return best_; }
  bool tight() const { return tight_; }

 private:
  Lead no_lead() const { return {{}, problem_.start, problem_.objects}; }
  void set_goal();
  void set_margin(double margin);
  EndTurns end_turns() const;
  SweptPath along(const std::vector<Arc>& arcs, double spare) const;
  Task<bool> arrives(SweptPath swept);

  Session& session_;
  Pushing* pushing_;
  Problem problem_;
  GoalRegion goal_;       // without its heading, where that is to be taken at the end
  GoalRegion path_goal_;  // entered by an inset, in which whole paths end
  bool fits_ = true;      // the robot, somewhere in the goal
  double straight_ = 0.0;  // length of a straight way into the goal's pose [m]
  Lead lead_;
  double first_radius_;
  double first_margin_ = 0.0;
  double turning_radius_;
  OwnFootprint footprint_;
  double spacing_ = 0.0;  // of poses [m]
  double margin_ = 0.0;   // kept from walls [m]
  double jam_length_;
  int relaxed_ = 0;
  Index last_ = std::numeric_limits<Index>::max();
  bool is_window_ = false;
  std::shared_ptr<SweptPath> best_{};
  double best_cost_ = kInfinity;
  bool tight_ = false;
};

}  // namespace pushplan
