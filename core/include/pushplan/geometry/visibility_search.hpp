// Lazy A* over the visibility graph: edges are tested when they are about to be used.
//
// A node is a corner of an outline around an obstacle. When one is reached, its successors are the
// corners that a common tangent leads to; they are put into the heap untested, and whether nothing
// lies between is found out for the cheapest entry only (Dellin and Srinivasa 2016, "A unifying
// formalism for shortest path problems with expensive edge evaluations"). Nor are all successors
// put there at once: those through which the way to the goal would be much longer wait until it is
// their turn (Yoshizumi, Miura and Ishida 2000, "A* with partial expansion for large branching
// factor problems"). Most of the graph is never made.
#pragma once

#include <span>
#include <vector>

#include "pushplan/geometry/goal_estimate.hpp"
#include "pushplan/geometry/obstacle_grid.hpp"
#include "pushplan/geometry/visibility.hpp"

namespace pushplan {

/// V corners by obstacle, then E points where the goal's rim leaves an obstacle.
struct Corners {
  std::span<const Vec2> points;    // (V + E,) [m]
  std::span<const Vec2> incoming;  // (V,) unit direction of the outline towards each corner
  std::span<const Vec2> outgoing;  // (V,) and away from it
  std::span<const Index> owner;    // (V,) its obstacle
  std::span<const Index> first;    // (C + 1,) where the corners of each obstacle start
  std::span<const Vec2> middles;   // (C,) of the boxes around the outlines [m]
  std::span<const Vec2> halves;    // (C,) half their sides [m]

  Bends bends() const { return {points, incoming, outgoing}; }
};

/// A search from one start to one goal, which can be taken up again. What it is given has to
/// outlive it.
class VisibilitySearch {
 public:
  enum class Outcome { kFound, kExhausted, kPaused };

  static constexpr Index kStart = -1;  // number of the start among the nodes

  VisibilitySearch(Vec2 start, const Corners& corners, const GoalScene& scene,
                   const ObstacleGrid& grid,
                   double sliver,  // a place this close to an obstacle may be inside of
                                   // the outline around it [m]
                   const GoalEstimate* estimate);  // null for straight distances, with which the
                                                   // path found is the shortest

  /// Goes on for about `budget` corners looked at, or lines tested.
  Outcome run(Index budget);

  /// The nodes of the path found, without the start. Where estimates were used, those are left out
  /// whose neighbours see each other.
  std::vector<Index> path();

 private:
  /// A way of getting to a node, in most cases not tested yet.
  struct Entry {
    double key;     // length plus bound [m]
    Index number;   // entries of the same key are taken in the order in which they were made
    double length;  // of the path to the node [m]
    double limit;   // of the rest of an expansion: the least that is left to offer [m]
    Index node;
    Index before;

    bool operator<(const Entry& other) const {  // the heap has its greatest element on top
      return key > other.key || (key == other.key && number > other.number);
    }
  };

  Index goal_node() const { return static_cast<Index>(corners_.points.size()); }
  Index rest_node() const { return goal_node() + 1; }  // stands for the rest of an expansion
  Vec2 place(Index node) const;
  void offer(Index node, double length, double bound, Index before, double limit = 0.0);
  void expand(Index node, double length, double low);
  double left(Vec2 p) const;
  Index bound_next();

  Vec2 start_;
  Corners corners_;
  const GoalScene& scene_;
  double cell_;
  double sliver_;
  const GoalEstimate* estimate_;
  GridSight sight_;
  std::vector<double>
      bounds_;  // (C,) from any corner of an obstacle at least as far to the goal [m]
  std::size_t bounded_ = 0;
  bool begun_ = false;
  std::vector<double> lengths_;  // (V + E,) of the shortest path found to each node [m]
  std::vector<Index> parents_;
  std::vector<Entry> heap_;
  Index entries_ = 0;
  Index end_ = kStart;
};

}  // namespace pushplan
