#include "pushplan/motion/state_lattice/swaths.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pushplan/motion/state_lattice/cost_map.hpp"

namespace pushplan {
namespace {

constexpr double kRounding = 1e-9;   // a cell counts whose centre is this far outside [cells]
constexpr double kTurnOfPose = 0.1;  // less than the greatest turn between two poses [rad]

/// Cells around the one of the start, set or not.
class Window {
 public:
  Window(Index middle, const Polygons& footprint)
      : middle_(middle),
        side_(2 * middle + 1),
        footprint_(footprint),
        outline_(footprint.vertices.size()),
        cells_(static_cast<std::size_t>(side_ * side_), 0) {}

  /// Sets the cells whose centres the footprint covers.
  void stamp(const Pose& pose, bool value) {
    const double c = std::cos(pose.theta);
    const double s = std::sin(pose.theta);
    const auto middle = static_cast<double>(middle_);
    for (Index part = 0; part < footprint_.count(); ++part) {
      const Polygon body = footprint_[part];
      double low = std::numeric_limits<double>::infinity();
      double high = -low;
      for (std::size_t i = 0; i < body.size(); ++i) {
        const Vec2 p = body[i];
        outline_[i] = {pose.x + c * p.x - s * p.y + middle, pose.y + s * p.x + c * p.y + middle};
        low = std::min(low, outline_[i].x);
        high = std::max(high, outline_[i].x);
      }
      const Polygon outline(outline_.data(), body.size());
      const Index top = first_cell(low);
      const Index bottom = last_cell(high);
      for (Index row = top; row <= bottom; ++row) {
        const CellSpan columns = row_span(outline, static_cast<double>(row));
        if (columns.low > columns.high) continue;
        const Index first = first_cell(columns.low);
        const Index last = last_cell(columns.high);
        if (first > last) continue;
        std::fill_n(cells_.begin() + row * side_ + first, last - first + 1, value);
      }
    }
  }

  std::vector<ColumnRun> runs() const {
    std::vector<ColumnRun> found;
    for (Index column = 0; column < side_; ++column) {
      for (Index row = 0; row < side_; ++row) {
        if (!is_set(row, column)) continue;
        const Index begin = row;
        while (row < side_ && is_set(row, column)) ++row;
        found.push_back({column - middle_, begin - middle_, row - middle_});
      }
    }
    return found;
  }

 private:
  bool is_set(Index row, Index column) const {
    return cells_[static_cast<std::size_t>(row * side_ + column)] != 0;
  }
  Index first_cell(double low) const {
    return std::max(static_cast<Index>(std::ceil(low - kRounding)), Index{0});
  }
  Index last_cell(double high) const {
    return std::min(static_cast<Index>(std::floor(high + kRounding)), side_ - 1);
  }

  Index middle_;
  Index side_;
  const Polygons& footprint_;
  std::vector<Vec2> outline_;  // of one part, on the window
  std::vector<char> cells_;
};

}  // namespace

std::vector<ColumnRun> sweep_cells(double heading, std::span<const Arc> arcs,
                                   const Polygons& footprint, double reach, double spacing) {
  double length = 0.0;
  double turn = 0.0;
  for (const Arc& arc : arcs) {
    length += arc.length;
    turn += std::abs(arc.length * arc.curvature);
  }
  const Index room = static_cast<Index>(length / spacing + turn / kTurnOfPose) +
                     4 * static_cast<Index>(arcs.size()) + 8;
  std::vector<Pose> poses(static_cast<std::size_t>(room));
  std::vector<double> curvatures(static_cast<std::size_t>(room));
  const Pose start{0.0, 0.0, heading};
  const Index count = sample_arcs(start, arcs, spacing, {poses, curvatures});
  Window window(static_cast<Index>(std::ceil(length + reach)) + 2, footprint);
  for (Index i = 0; i < count; ++i) window.stamp(poses[static_cast<std::size_t>(i)], true);
  window.stamp(start, false);
  return window.runs();
}

}  // namespace pushplan
