// Visibility graph around static obstacles, and the distance to a goal along it.
#pragma once

#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "pushplan/geometry/obstacles.hpp"
#include "pushplan/geometry/regions.hpp"

namespace pushplan {

inline constexpr Index kNoLeg = -2;    // node of a place from which nothing can be seen
inline constexpr Index kGoalLeg = -1;  // node of a place from which the goal is the next stop

/// Places where a shortest path may bend, on outlines around obstacles. V of them.
struct Bends {
  std::span<const Vec2> points;    // [m]
  std::span<const Vec2> incoming;  // unit direction of the outline towards each, 0 if no corner
  std::span<const Vec2> outgoing;  // and away from it

  Index count() const { return static_cast<Index>(points.size()); }

  /// True if a leg of displacement `leg`, to or from bend `k`, is tangent to it, as those of
  /// shortest paths are.
  bool tangent(Vec2 leg, std::size_t k, double gap) const {
    const double before = incoming[k].x * leg.y - incoming[k].y * leg.x;
    const double after = outgoing[k].x * leg.y - outgoing[k].y * leg.x;
    return (before >= -gap && after <= gap) || (before <= gap && after >= -gap);
  }
};

/// Bends and ends of paths, sorted by their distance to the goal.
struct Nodes {
  Bends places;
  std::span<const double> distances;  // (V,) shortest distance to the goal [m]
};

/// A goal among obstacles.
struct GoalScene {
  Regions regions;  // ends of paths
  Obstacles obstacles;
  Box box;     // where paths may lead [m]
  double gap;  // distance of paths to obstacles [m]
};

/// The bends of a map that paths can reach, and the lines between those that see each other along a
/// common tangent.
class BendGraph {
 public:
  /// Of all bends those are left out that lie in an obstacle or out of the box.
  BendGraph(const Bends& every, const Obstacles& obstacles, const Box& box, double gap);

  Bends bends() const { return {points_, incoming_, outgoing_}; }
  /// Dijkstra's algorithm (1959) from given first distances (B,) [m], in place, without a heap.
  /// `parents`, (B,), receives the bend before each whose distance is lowered.
  void relax(std::span<double> distances, std::span<Index> parents) const;
  /// (B, B) shortest distances between the bends [m].
  std::vector<double> distances() const;

 private:
  std::vector<Vec2> points_;
  std::vector<Vec2> incoming_;
  std::vector<Vec2> outgoing_;
  struct Line {
    Index to;
    double length;  // [m]
  };
  std::vector<std::vector<Line>> lines_;  // from each bend
};

/// The straight way to the nearest region that can be seen.
struct GoalLeg {
  double length;  // [m], infinite without any
  Vec2 end;
};

GoalLeg goal_leg(Vec2 p, const GoalScene& scene);

/// The node to walk to.
struct NodeLeg {
  double distance;  // to the goal over it [m]
  Index node;       // kNoLeg if none offers less than what is known
};

/// Finds the best node to walk to from a place.
NodeLeg node_leg(Vec2 p,
                 double limit,       // a distance that is already known [m]
                 Index hint,         // node to try first, a neighbour's; negative for none
                 bool tangent_only,  // skip nodes that no shortest path can touch from a place off
                                     // the outlines
                 const Nodes& nodes, const Obstacles& obstacles, double gap);

}  // namespace pushplan
