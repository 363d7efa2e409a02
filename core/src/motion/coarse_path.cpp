#include "pushplan/motion/coarse_path.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "pushplan/geometry/distance_field.hpp"
#include "pushplan/geometry/obstacles.hpp"
#include "pushplan/search/grid_dijkstra.hpp"

namespace pushplan {
namespace {

constexpr double kUsualCells = 96.0;  // along a map, if they resolve the robot's own width
constexpr double kMostCells = 400.0;  // along a map
// Work in one piece, half a millisecond at most
constexpr double kDistances = 30'000.0;  // to edges of polygons
constexpr Index kSettled = 2'000;        // cells that Dijkstra's algorithm settles
// Walls cost more than open space up to so far away [circumscribed radii]: the footprint beyond the
// inscribed disc is a matter of heading
constexpr double kNearWall = 1.3;
constexpr double kNearWallWeight = 2.0;

/// Side of a cell [m]: narrower than the robot, as far as the size of the map allows.
double cell_for(const Box& bounds, const CoarseRobot& robot) {
  const double extent = std::max(bounds.x_max - bounds.x_min, bounds.y_max - bounds.y_min);
  const double width = robot.inscribed > 0.0 ? robot.inscribed : kInfinity;
  return std::max(std::min(extent / kUsualCells, width), extent / kMostCells);
}

/// A whole number of cells, from a first one to a last.
Index clamped(double cells, Index first, Index last) {
  return static_cast<Index>(
      std::max(static_cast<double>(first), std::min(static_cast<double>(last), cells)));
}

}  // namespace

/// What polygons add to the cost of the cells around them.
struct Surcharge {
  double reach;   // distance at which it has faded to 0 [m]
  double weight;  // extra cost per metre at the polygon
};

/// Extra costs per metre of the cells around polygons, made in pieces.
struct CellWeights {
  CellWeights(const Box& bounds, double cell, std::vector<Surcharge> added)
      : cells{{bounds.x_min, bounds.y_min}, cell},
        rows(count((bounds.y_max - bounds.y_min) / cell)),
        columns(count((bounds.x_max - bounds.x_min) / cell)),
        values(static_cast<std::size_t>(rows * columns), 0.0),
        surcharges(std::move(added)),
        reach(std::ranges::max(surcharges, {}, &Surcharge::reach).reach) {}

  /// Goes on with the same polygons; true when all is done. `factors` scale what each one adds.
  bool run(const Polygons& polygons, std::span<const double> factors) {
    for (double left = kDistances; polygon < polygons.count();) {
      if (left <= 0.0) return false;
      const Polygon shape = polygons[polygon];
      const Box box = box_around(shape);
      const auto [first, last] = reached(box.y_min, box.y_max, cells.origin.y, rows);
      const auto [from, to] = reached(box.x_min, box.x_max, cells.origin.x, columns);
      const double factor = factors.empty() ? 1.0 : factors[static_cast<std::size_t>(polygon)];
      row = std::max(row, first);
      for (Index column = from; column <= to && row <= last; ++column) {
        const double gap = std::max(core_distance(cells.centre(row, column), shape), 0.0);
        double& value = values[static_cast<std::size_t>(row * columns + column)];
        for (const auto& [away, weight] : surcharges) {
          if (gap < away) value += factor * weight * (1.0 - gap / away);
        }
      }
      left -= static_cast<double>(shape.size()) * static_cast<double>(to - from + 2);
      if (++row <= last) continue;
      row = 0;
      ++polygon;
    }
    return true;
  }

  /// So many rows or columns, and one more where rounding adds it at most.
  static Index count(double cells) {
    return clamped(std::ceil(cells), 1, static_cast<Index>(kMostCells) + 1);
  }

  /// The first and the last row or column, of `count`, within reach of an interval [m].
  std::pair<Index, Index> reached(double low, double high, double origin, Index count) const {
    return {clamped((low - reach - origin) / cells.step, 0, count),
            clamped((high + reach - origin) / cells.step, -1, count - 1)};
  }

  /// The cell nearest to a point.
  Index cell_of(Vec2 p) const {
    return clamped((p.y - cells.origin.y) / cells.step, 0, rows - 1) * columns +
           clamped((p.x - cells.origin.x) / cells.step, 0, columns - 1);
  }

  Vec2 centre(Index cell) const { return cells.centre(cell / columns, cell % columns); }

  Cells cells;
  Index rows;
  Index columns;
  std::vector<double> values;  // row by row
  std::vector<Surcharge> surcharges;
  double reach;       // the greatest of them [m]
  Index polygon = 0;  // the next one
  Index row = 0;      // its next row
  std::mutex mutex{};
};

/// A search for the cheapest path over cells among walls and objects.
class CellSearch {
 public:
  CellSearch(const StaticMap& map, double cell, const std::vector<Surcharge>& at_walls, Vec2 start,
             const GoalRegion& goal, double reach, const Polygons& objects,
             std::span<const double> weights)
      : map_(map),
        start_(start),
        goal_(goal),
        weights_(weights.begin(), weights.end()),
        grid_(map.bounds(), cell, {{reach, 1.0}}) {
    for (Index k = 0; k < objects.count(); ++k) objects_.add(objects[k]);
    std::vector<double> key{cell};
    for (const auto& [away, weight] : at_walls) key.insert(key.end(), {away, weight});
    walls_ = map.kept<CellWeights>(std::move(key), [&] {
      return std::make_shared<CellWeights>(map.bounds(), cell, at_walls);
    });
  }

  bool run() {
    if (done_) return true;
    if (!search_) {
      const std::lock_guard lock(walls_->mutex);
      if (walls_->run(map_.parts(), {}) && grid_.run(objects_.polygons(), weights_)) begin();
      return false;
    }
    settled_ += kSettled;
    if (search_->settle({goals_.get(), search_->costs().shape()}, settled_)) return false;
    done_ = true;
    Index at = search_->order().back();
    if (!goals_[static_cast<std::size_t>(at)]) return true;
    for (; at >= 0; at = search_->parents()[static_cast<std::size_t>(at)]) {
      points_.push_back(grid_.centre(at));
    }
    std::ranges::reverse(points_);
    return true;
  }

  std::span<const Vec2> points() const { return points_; }

 private:
  void begin() {
    std::vector<double>& costs = grid_.values;
    goals_ = std::make_unique<bool[]>(costs.size());
    for (std::size_t i = 0; i < costs.size(); ++i) {
      costs[i] = 1.0 + (walls_->values[i] + costs[i]);
      goals_[i] = goal_.contains(grid_.centre(static_cast<Index>(i)));
    }
    if (goal_.kind == GoalRegion::Kind::kDisc) {  // it may be smaller than a cell
      goals_[static_cast<std::size_t>(grid_.cell_of(goal_.point))] = true;
    }
    const ArrayView<const double, 2> view(costs.data(), {grid_.rows, grid_.columns});
    search_.emplace(view, grid_.cells.step, std::array{grid_.cell_of(start_)});
  }

  const StaticMap& map_;
  Vec2 start_;
  GoalRegion goal_;
  OwnPolygons objects_{};
  std::vector<double> weights_;  // of the objects
  std::shared_ptr<CellWeights> walls_{};
  CellWeights grid_;  // of the objects; then of everything
  std::unique_ptr<bool[]> goals_{};
  std::optional<GridDijkstra> search_{};
  Index settled_ = 0;
  bool done_ = false;
  std::vector<Vec2> points_{};
};

CoarsePath::CoarsePath(const StaticMap& map, const CoarseRobot& robot, Vec2 start,
                       const GoalRegion& goal, const Polygons& objects,
                       std::span<const double> weights) {
  const std::vector<Surcharge> walls{{robot.inscribed, kInfinity},
                                     {kNearWall * robot.circumscribed, kNearWallWeight}};
  // passing through the middle of a box pushes it for about a robot's width
  search_ = std::make_shared<CellSearch>(map, cell_for(map.bounds(), robot), walls, start, goal,
                                         robot.circumscribed, objects, weights);
}

bool CoarsePath::run() { return search_->run(); }

std::span<const Vec2> CoarsePath::points() const { return search_->points(); }

Reachable::Reachable(const StaticMap& map, const CoarseRobot& robot, Vec2 start,
                     const GoalRegion& goal) {
  const double cell = cell_for(map.bounds(), robot);
  if (cell > robot.inscribed) return;
  GoalRegion grown = goal;  // by a cell: its rim may be reached alone
  grown.radius += cell;
  grown.point = {goal.point.x - cell * goal.normal.x, goal.point.y - cell * goal.normal.y};
  // a cell less than the disc: a narrow gap is left for the search to find out about
  const std::vector<Surcharge> walls{{robot.inscribed - cell, kInfinity}};
  const OwnPolygons nothing;
  search_ = std::make_shared<CellSearch>(map, cell, walls, start, grown, 0.0, nothing.polygons(),
                                         std::span<const double>());
}

bool Reachable::run() { return search_ == nullptr || search_->run(); }

bool Reachable::is_sealed() const { return search_ != nullptr && search_->points().empty(); }

}  // namespace pushplan
