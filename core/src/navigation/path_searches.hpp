// Searches over poses and pushed objects, each below the best cost so far.
#pragma once

#include "tree_paths.hpp"

namespace pushplan {

/// The cost of a plan over that of its path without objects, where none is known.
inline constexpr double kUnsolvedRatio = 1.3;

/// Best-first searches over a table of lengths to the goal.
class PathSearches {
 public:
  explicit PathSearches(PathImprover& improver)
      : improver_(improver), session_(improver.session()) {}

  /// Makes the table of lengths to the goal without objects, the same for every call on this map
  /// at a turning radius; false if it is of no use, or not wanted.
  Task<bool> make_table();
  /// One search, and shortcutting of what it finds: with the usual settings, and at an inflation of
  /// at least this much, ...
  Task<void> search(double least_inflation = 0.0);
  /// ... or with other edges, another inflation and other costs: what one search misses another
  /// finds.
  Task<void> search_at_random();

 private:
  struct Table;
  struct Variant {  // settings in which one search differs from another
    double arc;
    int turns;  // curvatures to each side
    double inflation;
    std::vector<double> masses;
  };

  double cost_ratio() const;
  Task<void> run(Variant variant);
  Index batch() const;
  Task<void> try_arcs(std::vector<Arc> arcs);

  PathImprover& improver_;
  Session& session_;
  std::shared_ptr<Table> table_{};
  std::optional<PushTree> nodes_{};
  double patience_ = 1'000.0;  // arcs driven in a search at most; more after each that took them all
};

}  // namespace pushplan
