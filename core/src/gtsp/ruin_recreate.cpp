#include "pushplan/gtsp/ruin_recreate.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "layers.hpp"
#include "segment_swap.hpp"

namespace pushplan::gtsp {
namespace {

constexpr Index kFreshRounds = 500;  // values are computed anew this often: rounding adds up

}  // namespace

/// What a round needs besides the tour; nothing is allocated while rounds run.
struct RuinRecreate::Workspace {
  Workspace(const Problem& problem, const RuinRecreateOptions& options, Index root,
            Xorshift64Star& random)
      : problem(problem),
        options(options),
        random(random),
        layers(problem, root),
        reach(std::min(options.reach, problem.near.extent(1))),
        rows(at(problem.clusters() * (problem.width() + kSpare))),
        order(at(problem.clusters())),
        nodes(at(problem.clusters())),
        gone(at(problem.clusters()), 0),
        seen(at(problem.clusters()), 0) {
    removed.reserve(at(problem.clusters()));
  }

  ArrayView<double, 2> row_view() {
    return {rows.data(), {problem.clusters(), problem.width() + kSpare}};
  }

  /// Takes out strings of clusters near a random one. Returns the change of cost.
  double ruin(Index target, double tolerance) {
    const Index longest = 1 + random.below(target);
    const Index seed = random.below(problem.clusters());
    const Index root = layers.root();
    double change = 0.0;
    removed.clear();
    for (Index index = 0; index < problem.near.extent(1) + 1; ++index) {
      Index c = index == 0 ? seed : problem.near(seed, index - 1);
      const Index found = static_cast<Index>(removed.size());
      if (found >= target) break;
      if (gone[at(c)] || c == root) continue;
      const Index length = std::min(1 + random.below(longest), target - found);
      for (Index back = random.below(length); back > 0; --back) {
        if (layers.before(c) != root) c = layers.before(c);
      }
      const Index a = layers.before(c);
      double carried = 0.0;
      for (Index left = length; left > 0 && c != root; --left) {
        layers.keep(c);
        carried += layers.carry(c);
        gone[at(c)] = 1;
        removed.push_back(c);
        c = layers.after(c);
      }
      change += layers.close_gap(a, c, carried, tolerance);
    }
    for (Index i = static_cast<Index>(removed.size()) - 1; i > 0; --i) {
      std::swap(removed[at(i)], removed[at(random.below(i + 1))]);
    }
    return change;
  }

  /// Puts the removed cluster that is farthest from the tour, or nearest to it, next in turn.
  void bring_forward(std::size_t low, bool farthest) {
    double best = -1.0;
    std::size_t pick = low;
    for (std::size_t i = low; i < removed.size(); ++i) {
      double away = kInfinity;
      for (Index index = 0; index < problem.near.extent(1); ++index) {
        if (!gone[at(problem.near(removed[i], index))]) {
          away = problem.between(removed[i], index);
          break;
        }
      }
      if (best < 0.0 || (farthest ? away > best : away < best)) {
        best = away;
        pick = i;
      }
    }
    std::swap(removed[low], removed[pick]);
  }

  /// Behind which cluster c is cheapest, next to one of its neighbours; a few are overlooked.
  Index cheapest_place(Index c) {
    double lowest = kInfinity;
    Index place = layers.root();
    const Index interval = options.blink > 0.0 ? static_cast<Index>(2.0 / options.blink) : 0;
    Index skip = interval > 0 ? random.below(interval) : -1;
    ++stamp;
    for (Index index = 0; index < 2 * problem.near.extent(1); ++index) {
      const Index d = problem.near(c, index / 2);
      if (gone[at(d)]) continue;
      const Index a = index % 2 == 1 ? d : layers.before(d);
      if (seen[at(a)] == stamp) continue;
      seen[at(a)] = stamp;
      if (skip == 0) {
        skip = random.below(interval);
        continue;
      }
      --skip;
      const double cost = layers.insertion_cost(c, a, layers.after(a), lowest);
      if (cost < lowest) {
        lowest = cost;
        place = a;
      }
    }
    return place;
  }

  /// Puts the removed clusters back one after the other. Returns the change of cost, that of the
  /// ruin included: one sum, since rounding depends on the order.
  double recreate(double change, double tolerance) {
    const Index turn = random.below(4);
    for (std::size_t i = 0; i < removed.size(); ++i) {
      if (turn >= 2) bring_forward(i, turn == 2);
      const Index c = removed[i];
      const Index place = cheapest_place(c);
      gone[at(c)] = 0;
      change += layers.link_in(c, place, tolerance);
    }
    return change;
  }

  /// Reads the order of the tour.
  void read_order() {
    Index c = layers.root();
    for (Index& place : order) {
      place = c;
      c = layers.after(c);
    }
  }

  const Problem& problem;
  const RuinRecreateOptions& options;
  Xorshift64Star& random;
  Layers layers;
  Index reach;
  SegmentSwaps swaps;
  std::vector<double> rows;    // (m, K + kSpare) of `best_nodes`
  std::vector<Index> order;    // (m,)
  std::vector<Index> nodes;    // (m,)
  std::vector<Index> removed;  // clusters that are taken out
  std::vector<char> gone;      // (m,) whether each cluster is
  std::vector<Index> seen;     // (m,) the last stamp of each place
  Index stamp = 0;
};

RuinRecreate::RuinRecreate(const Problem& problem, const RuinRecreateOptions& options,
                           std::vector<Index> order, std::uint64_t seed)
    : options_(options), random_(seed) {
  std::vector<Index> nodes;
  for (const Index c : order) nodes.push_back(problem.first(c));
  current_ = {std::move(order), std::move(nodes), kInfinity};
  best_ = current_;
  use(problem);
}

RuinRecreate::~RuinRecreate() = default;

void RuinRecreate::use(const Problem& problem) {
  problem_ = problem;
  least_slack_.assign(at(problem.nodes()), kInfinity);
  total_slack_.assign(at(problem.nodes()), 0.0);
  work_ = std::make_unique<Workspace>(problem_, options_, current_.order[0], random_);
}

void RuinRecreate::start(std::span<const Index> order) {
  current_.order.assign(order.begin(), order.end());
  current_.cost = best_nodes(problem_.costs, problem_.offsets, current_.order, current_.nodes,
                             work_->row_view());
  if (current_.cost < best_.cost) best_ = current_;
}

void RuinRecreate::start_from_best() { current_ = best_; }

void RuinRecreate::narrow(const Problem& problem, std::span<const Index> kept) {
  for (ClusterTour* tour : {&current_, &best_}) {
    for (Index& node : tour->nodes) {
      node = std::lower_bound(kept.begin(), kept.end(), node) - kept.begin();
    }
  }
  use(problem);
}

void RuinRecreate::run(double temperature, double tolerance, Index rounds) {
  Workspace& work = *work_;
  Layers& layers = work.layers;
  current_.cost = layers.build(current_.order, current_.nodes[0]);
  for (Index now = 0; now < rounds; ++now) {
    layers.begin_round();
    const Index target = 1 + random_.below(options_.max_removed);
    const double change = work.recreate(work.ruin(target, tolerance), tolerance);
    if (change >= -temperature * std::log(1.0 - random_.uniform())) {
      layers.undo();
    } else {
      current_.cost += change;
    }
    const bool fresh = now + 1 == rounds || (now + 1) % kFreshRounds == 0;
    if (current_.cost >= best_.cost - tolerance && !fresh) continue;
    work.read_order();
    note_best(tolerance);
    current_.order = work.order;
    current_.nodes = work.nodes;
    current_.cost = layers.build(current_.order, current_.nodes[0]);
  }
  layers.note_slack(least_slack_, total_slack_);
}

/// Chooses nodes for the order in the workspace, improves a new best tour and keeps it.
void RuinRecreate::note_best(double tolerance) {
  Workspace& work = *work_;
  const auto choose = [&] {
    return best_nodes(problem_.costs, problem_.offsets, work.order, work.nodes, work.row_view());
  };
  double cost = choose();
  if (cost < best_.cost - tolerance) {
    const double gain = work.swaps.improve(problem_.costs, problem_.near, work.reach, work.order,
                                           work.nodes, problem_.symmetric, tolerance);
    if (gain != 0.0) {
      std::rotate(work.order.begin(),
                  std::find(work.order.begin(), work.order.end(), work.layers.root()),
                  work.order.end());
      cost = choose();
    }
  }
  if (!(cost < best_.cost - tolerance)) return;
  best_.order = work.order;
  best_.nodes = work.nodes;
  best_.cost = cost;
}

}  // namespace pushplan::gtsp
