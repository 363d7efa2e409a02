// A static map as a disc sees it: everything grown by the clearance that its path keeps, with
// polygons drawn just outside, around which shortest paths bend.
#pragma once

#include <array>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "pushplan/geometry/static_map.hpp"
#include "pushplan/geometry/visibility_search.hpp"

namespace pushplan {

/// What searches for shortest paths need of a map at one clearance. Thread-safe. The map has to
/// outlive it.
class GrownMap {
 public:
  /// That of a map at a clearance [m], kept for the next call.
  static std::shared_ptr<GrownMap> of(const StaticMap& map, double clearance);

  GrownMap(const StaticMap& map, double clearance);

  /// Polygons, then lines, as cores with radii.
  Obstacles obstacles() const { return {map_.cores(), radii_, boxes_}; }
  /// True if speed counts for more than the last percent of length.
  bool has_many_corners() const { return map_.cores().vertices.size() > kManyCorners; }
  /// Fraction by which shortest paths may come out too long, as they bend around polygons.
  double excess() const;
  /// Distance of paths to the obstacles [m]; two obstacles that are closer leave no passage.
  double gap() const { return gap_; }
  /// Greatest distance [m] of a drawn polygon from the outline that it is drawn around.
  double standoff() const { return standoff_; }

  /// True if a place is off all obstacles.
  bool keeps_clearance(Vec2 p) const;

  /// Draws some thousand corners or makes the grid, in about half a millisecond; true when all is
  /// there. All that follows needs it.
  bool run();
  /// Makes all of it at once.
  void make() {
    while (!run()) {
    }
  }
  /// Polygons around the obstacles: nowhere inside of them, and tangent to their arcs.
  Corners corners() const {
    return {points_, incoming_, outgoing_, owner_, first_, middles_, halves_};
  }
  Polygons outlines() const { return {points_, first_}; }  // the same
  const ObstacleGrid& grid() const { return *grid_; }
  const CoveredSides& covered_sides();  // cells of estimates; made at the first call
  const BendGraph& bend_graph();        // made at the first call, which may take long

  /// The nearest place that keeps the clearance, straight ahead; none from inside of an obstacle.
  /// A robot that touches a wall has its centre a little too close to it.
  std::optional<Vec2> way_out(Vec2 p) const;
  /// Where a path may end at the rim of what covers a part of a goal [m].
  std::vector<Vec2> rim_ends(const Regions& goal) const;

 private:
  static constexpr std::size_t kManyCorners = 2'200;

  void draw(Index k);
  bool is_free(Vec2 p) const;
  void add_sides(Index k, std::vector<Segment>& sides) const;
  std::array<Segment, 4> sides_of_bounds() const;
  std::vector<Vec2> crossings(std::span<const Index> near) const;
  Vec2 pushed_out(Vec2 p, Index k) const;

  const StaticMap& map_;
  double clearance_;
  double gap_;
  double standoff_;
  std::vector<double> radii_;
  std::vector<Box> boxes_;
  std::mutex mutex_;  // of what follows, until it is made
  std::vector<Vec2> points_;
  std::vector<Vec2> incoming_;
  std::vector<Vec2> outgoing_;
  std::vector<Index> owner_;
  std::vector<Index> first_{0};
  std::vector<Vec2> middles_;
  std::vector<Vec2> halves_;
  std::optional<ObstacleGrid> grid_;
  std::optional<CoveredSides> covered_sides_;
  std::optional<BendGraph> bend_graph_;
};

}  // namespace pushplan
