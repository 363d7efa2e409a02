// Shortest paths of a disc to a goal among static obstacles: by a search, or from all bends.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "pushplan/geometry/distance_field.hpp"
#include "pushplan/geometry/grown_map.hpp"
#include "pushplan/motion/goal_region.hpp"

namespace pushplan {

/// Regions that own their arrays.
struct OwnRegions {
  Regions view() const { return {discs, half_planes, polygons.polygons()}; }

  std::vector<Disc> discs{};
  std::vector<HalfPlane> half_planes{};
  OwnPolygons polygons{};
};

OwnRegions regions_of(const GoalRegion& goal);

/// A polygonal path.
struct Route {
  double length = std::numeric_limits<double>::infinity();  // [m]; infinite without a path
  std::vector<Vec2> points{};                               // from the start to the goal [m]
};

/// When a search is guided by estimates of the way: its path is at most some percent longer then.
enum class Estimates {
  kWhenSlow,  // after some time without a path, among more than `kSomeCorners` corners
  kNever,
  kAlways,
};

/// A search that can be taken up again. The map has to outlive it.
class ShortestPath {
 public:
  static constexpr std::size_t kSomeCorners = 400;

  /// From a start that is too close to an obstacle but not inside, the path first leaves by the
  /// shortest way; `clearance` is in m.
  ShortestPath(const StaticMap& map, double clearance, Vec2 start, OwnRegions goal,
               Estimates estimates = Estimates::kWhenSlow);
  ShortestPath(const ShortestPath&) = delete;
  ShortestPath& operator=(const ShortestPath&) = delete;

  /// Goes on for about half a millisecond; true when the search has ended.
  bool run();

  const GrownMap& map() const { return *map_; }
  double length() const { return route_.length; }                 // [m]; infinite without a path
  std::span<const Vec2> points() const { return route_.points; }  // [m]

 private:
  enum class Step { kBegin, kSearch, kEstimate, kDone };

  void begin();
  void search();
  void finish();

  std::shared_ptr<GrownMap> map_;
  Vec2 start_;
  Vec2 free_;  // where the start leads to if it is too close to an obstacle
  OwnRegions goal_;
  GoalScene scene_;
  Step step_ = Step::kBegin;
  int patience_;              // pieces of the search until estimates are made, negative for never
  std::vector<Vec2> places_;  // of the corners, then ends on rims [m]
  std::optional<GoalEstimate> estimate_;
  std::optional<VisibilitySearch> search_;
  Route route_;
};

/// Shortest distances from every bend of a map to one goal. The map has to outlive it.
class GoalDistances {
 public:
  GoalDistances(const StaticMap& map, double clearance, OwnRegions goal);

  Route path_from(Vec2 start) const;
  /// Writes the distance [m] from the centre of each cell; infinite where there is no way.
  void fill(ArrayView<double, 2> out, const Cells& cells) const;

 private:
  Nodes nodes() const { return {{places_, incoming_, outgoing_}, distances_}; }

  std::shared_ptr<GrownMap> map_;
  OwnRegions goal_;
  GoalScene scene_;
  // of bends and of ends on rims, by distance
  std::vector<Vec2> places_;  // [m]
  std::vector<Vec2> incoming_;
  std::vector<Vec2> outgoing_;
  std::vector<Vec2> exits_;        // where the leg to the goal ends, if that is the next [m]
  std::vector<double> distances_;  // [m]
  std::vector<Index> parents_;     // the next towards the goal, or kGoalLeg
};

}  // namespace pushplan
