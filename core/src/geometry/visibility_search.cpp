#include "pushplan/geometry/visibility_search.hpp"

#include <algorithm>
#include <cmath>

namespace pushplan {
namespace {

constexpr Index kLineWork = 8;  // of a line tested or an expansion begun [corners looked at]

}  // namespace

VisibilitySearch::VisibilitySearch(Vec2 start, const Corners& corners, const GoalScene& scene,
                                   const ObstacleGrid& grid, double sliver,
                                   const GoalEstimate* estimate)
    : start_(start),
      corners_(corners),
      scene_(scene),
      cell_(grid.cell()),
      sliver_(sliver),
      estimate_(estimate),
      sight_(grid),
      bounds_(corners.middles.size()),
      lengths_(corners.points.size(), kInfinity),
      parents_(corners.points.size(), kStart) {
  heap_.reserve(8 * corners.points.size() + 64);
}

/// Bounds the way from any corner of the next obstacle; returns how much work that was.
Index VisibilitySearch::bound_next() {
  const std::size_t k = bounded_++;
  const double half = std::hypot(corners_.halves[k].x, corners_.halves[k].y);
  bounds_[k] = region_distance(corners_.middles[k], scene_.regions) - half;
  if (estimate_ == nullptr) return 0;
  double least = kInfinity;
  for (std::size_t j = at(corners_.first[k]); j < at(corners_.first[k + 1]); ++j) {
    least = std::min(least, estimate_->from(corners_.points[j]));
  }
  bounds_[k] = std::max(bounds_[k], least);
  return corners_.first[k + 1] - corners_.first[k];
}

Vec2 VisibilitySearch::place(Index node) const {
  return node == kStart ? start_ : corners_.points[at(node)];
}

/// The estimate of what is left of a path at `p` [m].
double VisibilitySearch::left(Vec2 p) const {
  const double straight = region_distance(p, scene_.regions);
  return estimate_ == nullptr ? straight : std::max(straight, estimate_->from(p));
}

/// Puts a way of getting to a node into the heap.
void VisibilitySearch::offer(Index node, double length, double bound, Index before, double limit) {
  heap_.push_back({length + bound, entries_++, length, limit, node, before});
  std::push_heap(heap_.begin(), heap_.end());
}

/// Offers the goal and corners that a common tangent leads to from a node. Only corners through
/// which the goal is farther than `low` [m], -infinity at first, and not much farther; an entry
/// stands for the rest.
void VisibilitySearch::expand(Index node, double length, double low) {
  const bool from_start = node == kStart;
  const double gap = scene_.gap;
  const Bends bends = corners_.bends();
  const Vec2 p = place(node);
  const Index own = from_start ? -1 : corners_.owner[at(node)];
  const Vec2 in = from_start ? Vec2{0.0, 0.0} : corners_.incoming[at(node)];
  const Vec2 out = from_start ? Vec2{0.0, 0.0} : corners_.outgoing[at(node)];
  const double near = left(p);
  double high = near + 2.0 * (low - near);
  bool rest = false;
  if (low == -kInfinity) {
    high = near + cell_;
    double leg = kInfinity;
    for (Index k = 0; k < scene_.regions.count(); ++k) {
      const Vec2 q = nearest_in_region(k, p, scene_.regions);
      const double away = std::hypot(q.x - p.x, q.y - p.y);
      if (away < leg && scene_.box.contains(q, gap) && sight_.sees(p, q, gap)) leg = away;
    }
    if (leg < kInfinity) offer(goal_node(), length + leg, 0.0, node);
    for (std::size_t j = corners_.owner.size(); j < corners_.points.size(); ++j) {
      const double dx = corners_.points[j].x - p.x;
      const double dy = corners_.points[j].y - p.y;
      if (from_start || bends.tangent({dx, dy}, at(node), gap)) {
        offer(static_cast<Index>(j), length + std::hypot(dx, dy), 0.0, node);
      }
    }
  }
  const Obstacles& obstacles = scene_.obstacles;
  for (std::size_t k = 0; k < corners_.middles.size(); ++k) {
    if (bounds_[k] == kInfinity) continue;  // no way leads from there
    const double mx = corners_.middles[k].x - p.x;
    const double my = corners_.middles[k].y - p.y;
    const Vec2 half = corners_.halves[k];
    const double ax = std::max(std::abs(mx) - half.x, 0.0);
    const double ay = std::max(std::abs(my) - half.y, 0.0);
    const double away =
        high - bounds_[k];  // farther than that the goal is too far from its corners
    if (away < 0.0 || ax * ax + ay * ay > away * away) {
      rest = true;
      continue;
    }
    bool every = static_cast<Index>(k) == own;
    if (from_start) {
      const Polygon core = obstacles.cores[static_cast<Index>(k)];
      every = core_distance(p, core) - obstacles.radii[k] <= sliver_;
    } else if (!every) {
      // the box around it must reach into where tangents at this corner lead
      const double before = in.x * my - in.y * mx;
      const double after = out.x * my - out.y * mx;
      const double b = std::abs(in.x) * half.y + std::abs(in.y) * half.x + gap;
      const double a = std::abs(out.x) * half.y + std::abs(out.y) * half.x + gap;
      if (!((before >= -b && after <= a) || (before <= b && after >= -a))) continue;
    }
    for (std::size_t j = at(corners_.first[k]); j < at(corners_.first[k + 1]); ++j) {
      if (length >= lengths_[j]) continue;
      const Vec2 q = corners_.points[j];
      if (!scene_.box.contains(q, gap)) continue;
      const double dx = q.x - p.x;
      const double dy = q.y - p.y;
      if (!every && !bends.tangent({-dx, -dy}, j, gap)) continue;
      if (!from_start && !bends.tangent({dx, dy}, at(node), gap)) continue;
      const double step = std::hypot(dx, dy);
      if (length + step >= lengths_[j]) continue;
      const double far = left(q);
      if (step + far > high) {
        rest = rest || far < kInfinity;
      } else if (step + far > low) {
        if (std::isinf(lengths_[j]) && !sight_.sees(q, q, gap)) {
          lengths_[j] = 0.0;  // inside of another obstacle: never to be reached
          continue;
        }
        offer(static_cast<Index>(j), length + step, far, node);
      }
    }
  }
  if (rest) offer(rest_node(), length, high, node, high);
}

VisibilitySearch::Outcome VisibilitySearch::run(Index budget) {
  const auto expansion = static_cast<Index>(corners_.middles.size()) + kLineWork;
  while (bounded_ < bounds_.size() && budget > 0) budget -= bound_next();
  if (budget <= 0) return Outcome::kPaused;
  if (!begun_) {
    begun_ = true;
    const bool leads_there = estimate_ == nullptr || !std::isinf(estimate_->from(start_));
    if (leads_there) expand(kStart, 0.0, -kInfinity);
  }
  while (budget > 0) {
    if (heap_.empty()) return Outcome::kExhausted;
    std::pop_heap(heap_.begin(), heap_.end());
    const Entry entry = heap_.back();
    heap_.pop_back();
    --budget;
    if (entry.node == goal_node()) {  // its line has been tested
      end_ = entry.before;
      return Outcome::kFound;
    }
    if (entry.node == rest_node()) {
      expand(entry.before, entry.length, entry.limit);
      budget -= expansion;
      continue;
    }
    const std::size_t node = at(entry.node);
    if (entry.length >= lengths_[node]) continue;
    budget -= kLineWork;
    if (!sight_.sees(place(entry.before), corners_.points[node], scene_.gap)) continue;
    lengths_[node] = entry.length;
    parents_[node] = entry.before;
    if (node >= corners_.owner.size()) {
      end_ = entry.node;
      return Outcome::kFound;
    }
    expand(entry.node, entry.length, -kInfinity);
    budget -= expansion;
  }
  return Outcome::kPaused;
}

std::vector<Index> VisibilitySearch::path() {
  std::vector<Index> nodes;
  for (Index node = end_; node != kStart; node = parents_[at(node)]) nodes.push_back(node);
  nodes.push_back(kStart);
  std::reverse(nodes.begin(), nodes.end());
  for (std::size_t i = 1; estimate_ != nullptr && i + 1 < nodes.size();) {
    if (sight_.sees(place(nodes[i - 1]), place(nodes[i + 1]), scene_.gap)) {
      nodes.erase(nodes.begin() + static_cast<std::ptrdiff_t>(i));
      i = std::max<std::size_t>(i - 1, 1);
    } else {
      ++i;
    }
  }
  nodes.erase(nodes.begin());
  return nodes;
}

}  // namespace pushplan
