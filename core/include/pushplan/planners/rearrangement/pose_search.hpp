// Search of the cheapest paths over a `PoseGrid`.
//
// What is static forbids poses; an object that the footprint overlaps costs as far as it is carried
// along, until the overlap gets less again.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "pushplan/planners/rearrangement/pose_grid.hpp"

namespace pushplan::rearrangement {

/// Objects in the way, as `add_layers` finds them, and costs.
struct PoseSearchProblem {
  PoseGrid grid;
  ArrayView<const double, 3> depths;  // (16, rows, columns) depth in the objects [m]
  ArrayView<const double, 3> touch;   // (16, rows, columns) weights of the objects
  double turn_cost;                   // of a turn [m/rad]
  double arm;                         // distance by which a turn carries an object along [m/rad]
};

/// Poses from which paths begin, and what it costs to be there [m].
struct PoseStarts {
  std::span<const Index> nodes;
  std::span<const double> costs;
};

/// A search by buckets of about equal costs (Dial 1969; delta-stepping, Meyer and Sanders 2003).
/// Poses are expanded bucket by bucket, and again where they get cheaper; what lies beyond the last
/// bucket waits for another round.
class PoseSearch {
 public:
  /// Memory for one search. `costs` and `before`, an element for each pose, receive the cost of
  /// each pose [m] and the pose before it.
  PoseSearch(const PoseSearchProblem& problem, std::span<double> costs, std::span<Index> before);

  /// Searches until all targets are reached, or to the end if there are none.
  void run(const PoseStarts& starts, std::span<const Index> targets);

 private:
  static constexpr Index kBuckets = 1024;  // of poses of a search in one round; the next one waits
  static constexpr Index kNone = -1;

  struct Links {
    Index before;  // the node before; -2 - b for the first of bucket b; `kNone` in no bucket
    Index after;
  };

  void link(Index node, Index bucket);
  void unlink(Index node);
  double deal();
  Index bucket_of(double cost, double base) const;
  void expand(Index node, double base);
  void reach(Index node, Index other, double step, double motion, double base);

  PoseSearchProblem problem_;
  std::span<double> costs_;
  std::span<Index> before_;
  double width_;  // costs that one bucket spans [m]
  std::vector<Links> links_;
  std::array<Index, kBuckets + 1> heads_;
};

/// Poses from which some places are reached, one place after the other.
struct Arrivals {
  std::span<const Index> nodes;
  std::span<const double> extra;  // cost of the rest of the path [m]
  std::span<const Index> ends;    // (N,) where the poses of each place end
};

/// Writes the cost of getting to each place [m], from the costs of the poses.
void least_costs(std::span<const double> costs, const Arrivals& arrivals, std::span<double> out);

}  // namespace pushplan::rearrangement
