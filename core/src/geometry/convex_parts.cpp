#include "pushplan/geometry/convex_parts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "pushplan/geometry/polygon.hpp"

namespace pushplan {
namespace {

constexpr double kRounding = 1e-12;  // fraction of the area of all pieces that counts as none
constexpr std::size_t kFew = 8;      // corners up to which a part counts as small

struct Part {
  std::vector<Vec2> corners;
  double area;  // of its pieces, and of what mergers have added [m^2]
  std::set<Index> neighbours;
};

struct Merger {
  double gain;  // area of the hull beyond those of the two [m^2]
  Index first;
  Index second;

  bool operator<(const Merger& other) const {
    return std::tuple(gain, first, second) < std::tuple(other.gain, other.first, other.second);
  }
};

/// Corners of the convex hull of two sets of points, by Andrew's monotone chain.
std::vector<Vec2> hull_of(std::vector<Vec2> points, const std::vector<Vec2>& others) {
  points.insert(points.end(), others.begin(), others.end());
  std::ranges::sort(points, {}, [](Vec2 p) { return std::pair(p.x, p.y); });
  std::vector<Vec2> hull;
  const auto add = [&](Vec2 p, std::size_t least) {
    while (hull.size() > least) {
      const Vec2 a = hull[hull.size() - 2];
      const Vec2 b = hull.back();
      if ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) > 0.0) break;
      hull.pop_back();
    }
    hull.push_back(p);
  };
  for (const Vec2 p : points) add(p, 1);
  const std::size_t lower = hull.size();
  for (std::size_t i = points.size() - 1; i-- > 0;) add(points[i], lower);
  hull.pop_back();
  return hull;
}

/// Area that the hull of a convex polygon and a point has beyond the polygon [m^2].
double area_beyond(const std::vector<Vec2>& corners, Vec2 p) {
  double doubled = 0.0;
  Vec2 a = corners.back();
  for (const Vec2 b : corners) {
    doubled += std::max(0.0, (b.y - a.y) * (p.x - a.x) - (b.x - a.x) * (p.y - a.y));
    a = b;
  }
  return 0.5 * doubled;
}

/// The pieces, each with the numbers of those that share an edge with it.
std::vector<Part> with_neighbours(const Polygons& pieces) {
  std::vector<Part> parts;
  std::map<std::array<double, 4>, std::vector<Index>> owners;
  for (Index i = 0; i < pieces.count(); ++i) {
    const Polygon piece = pieces[i];
    parts.push_back({{piece.begin(), piece.end()}, std::abs(polygon_area(piece)), {}});
    for (std::size_t k = 0; k < piece.size(); ++k) {
      Vec2 a = piece[k];
      Vec2 b = piece[next_corner(piece, k)];
      if (std::pair(b.x, b.y) < std::pair(a.x, a.y)) std::swap(a, b);
      owners[{a.x, a.y, b.x, b.y}].push_back(i);
    }
  }
  for (const auto& [edge, sharing] : owners) {
    for (const Index i : sharing) {
      for (const Index j : sharing) {
        if (i != j) parts[at(i)].neighbours.insert(j);
      }
    }
  }
  return parts;
}

}  // namespace

std::vector<Index> merge_pieces(const Polygons& pieces, double budget) {
  std::vector<Part> parts = with_neighbours(pieces);
  std::vector<Index> merged_into(parts.size(), -1);
  double total = 0.0;
  for (const Part& part : parts) total += part.area;
  std::set<Merger> mergers;
  const auto offer = [&](Index i, Index j) {
    const Part& a = parts[at(i)];
    const Part& b = parts[at(j)];
    const auto& [small, large] = std::minmax(a, b, [](const Part& one, const Part& other) {
      return one.corners.size() < other.corners.size();
    });
    // a large part may have many small neighbours, and few of them can be merged with it
    if (small.corners.size() <= kFew && large.corners.size() > kFew) {
      const double most = small.area + budget + kRounding * total;
      for (const Vec2 p : small.corners) {
        if (area_beyond(large.corners, p) > most) return;
      }
    }
    const double gain = polygon_area(hull_of(a.corners, b.corners)) - a.area - b.area;
    mergers.insert({gain < kRounding * total ? 0.0 : gain, i, j});
  };
  for (Index i = 0; i < pieces.count(); ++i) {
    for (const Index j : parts[at(i)].neighbours) {
      if (i < j) offer(i, j);
    }
  }
  while (!mergers.empty() && mergers.begin()->gain <= budget) {
    const auto [gain, first, second] = *mergers.begin();
    mergers.erase(mergers.begin());
    if (merged_into[at(first)] >= 0 || merged_into[at(second)] >= 0) continue;
    budget -= gain;
    const auto merged = static_cast<Index>(parts.size());
    Part part{hull_of(parts[at(first)].corners, parts[at(second)].corners), 0.0, {}};
    part.area = parts[at(first)].area + parts[at(second)].area + gain;
    for (const Index i : {first, second}) {
      merged_into[at(i)] = merged;
      for (const Index k : parts[at(i)].neighbours) {
        parts[at(k)].neighbours.erase(i);
        if (k == first || k == second) continue;
        part.neighbours.insert(k);
        parts[at(k)].neighbours.insert(merged);
      }
    }
    parts.push_back(std::move(part));
    merged_into.push_back(-1);
    for (const Index k : parts.back().neighbours) offer(k, merged);
  }
  // a part is merged into one with a greater number, so the last ones are known first
  std::vector<Index> owners(parts.size());
  Index left = 0;
  for (const Index into : merged_into) left += into < 0 ? 1 : 0;
  for (std::size_t i = parts.size(); i-- > 0;) {
    owners[i] = merged_into[i] < 0 ? --left : owners[at(merged_into[i])];
  }
  owners.resize(at(pieces.count()));
  return owners;
}

}  // namespace pushplan
