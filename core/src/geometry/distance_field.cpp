#include "pushplan/geometry/distance_field.hpp"

#include <algorithm>
#include <vector>

namespace pushplan {
namespace {

constexpr double kSteepest = 1.5;  // difference of four neighbouring cells without a wall [steps]

/// A marked cell seen from a line of cells.
struct Seen {
  Index along;   // cell of the line that is nearest to it
  Index square;  // of its distance to that one [cells²]
  Index row;

  Index square_from(Index at) const { return square + (at - along) * (at - along); }
};

/// Appends one that lies further along the line, and drops those that no cell of the line is
/// nearest to any more.
void append_seen(std::vector<Seen>& line, const Seen& next) {
  while (line.size() >= 2) {
    const Seen& first = line[line.size() - 2];
    const Seen& middle = line.back();
    const Index a = middle.along - first.along;
    const Index b = next.along - middle.along;
    const Index hidden =
        (a + b) * middle.square - b * first.square - a * next.square - a * b * (a + b);
    if (hidden <= 0) break;
    line.pop_back();
  }
  line.push_back(next);
}

/// Calls `write` with each cell of a line and the one seen that is nearest to it.
template <class Write>
void visit_nearest(const std::vector<Seen>& line, Index length, Write write) {
  if (line.empty()) return;
  std::size_t best = 0;
  for (Index at = 0; at < length; ++at) {
    while (best + 1 < line.size() && line[best + 1].square_from(at) < line[best].square_from(at)) {
      ++best;
    }
    write(at, line[best]);
  }
}

}  // namespace

void fill_clearance(ArrayView<double, 2> out, Index first, Index last, const Cells& cells,
                    const Obstacles& obstacles) {
  const Index cols = out.extent(1);
  for (Index at = first; at < last; ++at) {
    out.data()[at] = obstacle_distance(cells.centre(at / cols, at % cols), obstacles);
  }
}

void fill_distances(ArrayView<double, 2> out, const Cells& cells, const Nodes& nodes,
                    const GoalScene& scene, double sliver) {
  const Box& box = scene.box;
  const double gap = scene.gap;
  for (Index i = 0; i < out.extent(0); ++i) {
    Index hint = kNoLeg;
    for (Index j = 0; j < out.extent(1); ++j) {
      const Vec2 p = cells.centre(i, j);
      out(i, j) = kInfinity;
      if (p.x > box.x_max + gap || p.y > box.y_max + gap) continue;
      const double clearance = obstacle_distance(p, scene.obstacles);
      if (clearance < gap) continue;
      const double straight = goal_leg(p, scene).length;
      const NodeLeg leg =
          node_leg(p, straight, hint, clearance > sliver, nodes, scene.obstacles, gap);
      hint = leg.node;
      out(i, j) = leg.distance;
    }
  }
}

double sample(ArrayView<const double, 2> values, const Cells& cells, Vec2 p) {
  const Index rows = values.extent(0);
  const Index cols = values.extent(1);
  // of NaN and 0 this order keeps the 0
  double u =
      std::min(std::max(0.0, (p.x - cells.origin.x) / cells.step), static_cast<double>(cols));
  double v =
      std::min(std::max(0.0, (p.y - cells.origin.y) / cells.step), static_cast<double>(rows));
  const double own =
      values(std::min(static_cast<Index>(v), rows - 1), std::min(static_cast<Index>(u), cols - 1));
  u = std::max(u - 0.5, 0.0);
  v = std::max(v - 0.5, 0.0);
  const Index j0 = std::min(static_cast<Index>(u), cols - 1);
  const Index i0 = std::min(static_cast<Index>(v), rows - 1);
  const Index j1 = std::min(j0 + 1, cols - 1);
  const Index i1 = std::min(i0 + 1, rows - 1);
  const double a = values(i0, j0);
  const double b = values(i0, j1);
  const double c = values(i1, j0);
  const double d = values(i1, j1);
  const double low = std::min(std::min(a, b), std::min(c, d));
  const double high = std::max(std::max(a, b), std::max(c, d));
  if (high - low <= kSteepest * cells.step) {  // false if one is infinite
    const double fu = u - static_cast<double>(j0);
    const double fv = v - static_cast<double>(i0);
    return (a * (1.0 - fu) + b * fu) * (1.0 - fv) + (c * (1.0 - fu) + d * fu) * fv;
  }
  return own < kInfinity ? own : low;
}

void sample(ArrayView<const double, 2> values, const Cells& cells, std::span<const Vec2> points,
            std::span<double> out) {
  for (std::size_t n = 0; n < points.size(); ++n) out[n] = sample(values, cells, points[n]);
}

void find_nearest_marked(ArrayView<const bool, 2> marked, ArrayView<Index, 2> rows,
                         ArrayView<Index, 2> cols) {
  std::fill_n(rows.data(), rows.size(), Index{-1});
  std::fill_n(cols.data(), cols.size(), Index{-1});
  std::vector<Seen> line;
  for (Index j = 0; j < marked.extent(1); ++j) {
    line.clear();
    for (Index i = 0; i < marked.extent(0); ++i) {
      if (marked(i, j)) line.push_back({i, 0, i});
    }
    visit_nearest(line, marked.extent(0),
                  [&](Index i, const Seen& seen) { rows(i, j) = seen.row; });
  }
  for (Index i = 0; i < marked.extent(0); ++i) {
    line.clear();
    for (Index j = 0; j < marked.extent(1); ++j) {
      const Index row = rows(i, j);
      if (row >= 0) append_seen(line, {j, (row - i) * (row - i), row});
    }
    visit_nearest(line, marked.extent(1), [&](Index j, const Seen& seen) {
      rows(i, j) = seen.row;
      cols(i, j) = seen.along;
    });
  }
}

}  // namespace pushplan
