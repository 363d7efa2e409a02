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

/// Bends that see each other along a common tangent.
struct VisiblePairs {
  struct Pair {
    Index from;  // less than `to`
    Index to;
  };
  std::vector<Pair> pairs;
  std::vector<double> lengths;  // [m]
};

VisiblePairs visible_pairs(const Bends& bends, const Obstacles& obstacles, double gap);

/// Arcs of a graph of V nodes, by the node that they leave.
struct Arcs {
  std::span<const Index> starts;    // (V + 1,) where the arcs of each node start
  std::span<const Index> ends;      // (E,) node that each leads to
  std::span<const double> lengths;  // (E,) [m]
};

/// Dijkstra's algorithm (1959) from given first distances (V,) [m], in place, without a heap.
/// `parents`, (V,), receives the node before each whose distance is lowered.
void relax(const Arcs& arcs, std::span<double> distances, std::span<Index> parents);

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
