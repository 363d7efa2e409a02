#include "pushplan/planners/rearrangement/pose_search.hpp"

#include <algorithm>

namespace pushplan::rearrangement {
namespace {

constexpr double kBucketWidth = 0.1;  // [cells]

}  // namespace

PoseSearch::PoseSearch(const PoseSearchProblem& problem, std::span<double> costs,
                       std::span<Index> before)
    : problem_(problem),
      costs_(costs),
      before_(before),
      width_(kBucketWidth * problem.grid.step),
      links_(costs.size(), {kNone, kNone}) {
  std::ranges::fill(costs_, kInfinity);
  std::ranges::fill(before_, kNone);
  heads_.fill(kNone);
}

/// Takes a node out of its bucket.
inline void PoseSearch::unlink(Index node) {
  Links& links = links_[at(node)];
  if (links.before >= 0) {
    links_[at(links.before)].after = links.after;
  } else {
    heads_[at(-2 - links.before)] = links.after;
  }
  if (links.after >= 0) links_[at(links.after)].before = links.before;
  links.before = kNone;
}

/// Puts a node that is in no bucket into one.
inline void PoseSearch::link(Index node, Index bucket) {
  const Index head = heads_[at(bucket)];
  links_[at(node)] = {-2 - bucket, head};
  if (head >= 0) links_[at(head)].before = node;
  heads_[at(bucket)] = node;
}

inline Index PoseSearch::bucket_of(double cost, double base) const {
  return static_cast<Index>(std::min((cost - base) / width_, static_cast<double>(kBuckets)));
}

/// Puts the poses that wait where they belong. Returns the least cost of them.
double PoseSearch::deal() {
  double base = kInfinity;
  const Index first = heads_[kBuckets];
  for (Index node = first; node >= 0; node = links_[at(node)].after) {
    base = std::min(base, costs_[at(node)]);
  }
  heads_[kBuckets] = kNone;
  for (Index node = first; node >= 0;) {
    const Index following = links_[at(node)].after;
    link(node, bucket_of(costs_[at(node)], base));
    node = following;
  }
  return base;
}

/// Goes from a node to another one at the cost of the step, and that of an object in the way.
inline void PoseSearch::reach(Index node, Index other, double step, double motion, double base) {
  const double touched = problem_.touch.data()[other];
  const double* depths = problem_.depths.data();
  if (touched > 0.0 && depths[other] >= depths[node]) step += motion * touched;
  const double cost = costs_[at(node)] + step;
  if (!(cost < costs_[at(other)])) return;
  if (links_[at(other)].before != kNone) unlink(other);
  costs_[at(other)] = cost;
  before_[at(other)] = node;
  link(other, bucket_of(cost, base));
}

/// Goes on from a pose: ahead, back, to the next heading and to the one before.
void PoseSearch::expand(Index node, double base) {
  const PoseGrid& grid = problem_.grid;
  const Index rows = grid.rows();
  const Index columns = grid.columns();
  const Index layer = rows * columns;  // poses of one heading
  constexpr Index kLast = static_cast<Index>(kHeadingCount) - 1;
  const Index row = node / columns;
  const Index t = row / rows;
  const Index i = row - t * rows;
  const Index j = node - row * columns;
  const bool* blocked = grid.blocked.data();
  const bool* ahead_blocked = grid.blocked_moves.row(0).data();
  const bool* turn_blocked = grid.blocked_moves.row(1).data();
  const double distance = kLengths[at(t)] * grid.step;
  const auto [dx, dy] = kMoves[at(t)];
  for (const Index sign : {Index{1}, Index{-1}}) {
    const Index to_row = i + sign * dy;
    const Index to_column = j + sign * dx;
    if (to_row < 0 || to_column < 0 || to_row >= rows || to_column >= columns) continue;
    const Index other = (t * rows + to_row) * columns + to_column;
    if (blocked[other] || ahead_blocked[sign > 0 ? node : other]) continue;
    reach(node, other, distance, distance, base);
  }
  const Index next = t == kLast ? node - kLast * layer : node + layer;
  if (!blocked[next] && !turn_blocked[node]) {
    const double turn = kTurns[at(t)];
    reach(node, next, turn * problem_.turn_cost, turn * problem_.arm, base);
  }
  const Index last = t == 0 ? node + kLast * layer : node - layer;
  if (!blocked[last] && !turn_blocked[last]) {
    const double turn = kTurns[at(t == 0 ? kLast : t - 1)];
    reach(node, last, turn * problem_.turn_cost, turn * problem_.arm, base);
  }
}

void PoseSearch::run(const PoseStarts& starts, std::span<const Index> targets) {
  for (std::size_t s = 0; s < starts.nodes.size(); ++s) {
    const Index node = starts.nodes[s];
    if (!(starts.costs[s] < costs_[at(node)])) continue;
    if (links_[at(node)].before == kNone) link(node, kBuckets);
    costs_[at(node)] = starts.costs[s];
  }
  std::size_t met = 0;
  while (heads_[kBuckets] >= 0) {
    const double base = deal();
    for (Index bucket = 0; bucket < kBuckets; ++bucket) {
      const double cheapest = base + static_cast<double>(bucket) * width_;
      while (met < targets.size() && costs_[at(targets[met])] < cheapest) ++met;
      if (!targets.empty() && met == targets.size()) return;
      while (heads_[at(bucket)] >= 0) {
        const Index node = heads_[at(bucket)];
        unlink(node);
        expand(node, base);
      }
    }
  }
}

void least_costs(std::span<const double> costs, const Arrivals& arrivals, std::span<double> out) {
  std::size_t next = 0;
  for (std::size_t n = 0; n < arrivals.ends.size(); ++n) {
    out[n] = kInfinity;
    for (; static_cast<Index>(next) < arrivals.ends[n]; ++next) {
      out[n] = std::min(out[n], costs[at(arrivals.nodes[next])] + arrivals.extra[next]);
    }
  }
}

}  // namespace pushplan::rearrangement
