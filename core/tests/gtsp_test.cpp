// Parts of the GTSP search that Python does not see.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "../src/gtsp/layers.hpp"
#include "../src/gtsp/segment_swap.hpp"
#include "check.hpp"
#include "pushplan/random.hpp"

namespace pushplan::gtsp {
namespace {

/// A problem that owns its arrays.
struct OwnedProblem {
  OwnedProblem(std::vector<Index> cluster_offsets, Xorshift64Star& random)
      : offsets(std::move(cluster_offsets)) {
    const Index n = offsets.back();
    const Index m = static_cast<Index>(offsets.size()) - 1;
    costs.assign(at(n * (n + kSpare)), 1e9);
    reverse = costs;
    into.assign(at(m * n), kInfinity);
    onto = into;
    for (Index i = 0; i < n; ++i) {
      for (Index j = 0; j < n; ++j) {
        const double cost = random.uniform();
        costs[at(i * (n + kSpare) + j)] = cost;
        reverse[at(j * (n + kSpare) + i)] = cost;
      }
    }
    for (Index c = 0; c < m; ++c) {
      for (Index i = offsets[at(c)]; i < offsets[at(c + 1)]; ++i) {
        for (Index j = 0; j < n; ++j) {
          double& cheapest_in = into[at(c * n + j)];
          double& cheapest_out = onto[at(c * n + j)];
          cheapest_in = std::min(cheapest_in, costs[at(i * (n + kSpare) + j)]);
          cheapest_out = std::min(cheapest_out, reverse[at(i * (n + kSpare) + j)]);
        }
      }
    }
    problem.costs = {costs.data(), {n, n + kSpare}};
    problem.reverse = {reverse.data(), {n, n + kSpare}};
    problem.into = {into.data(), {m, n}};
    problem.onto = {onto.data(), {m, n}};
    problem.offsets = offsets;
  }

  std::vector<Index> offsets;
  std::vector<double> costs;
  std::vector<double> reverse;
  std::vector<double> into;
  std::vector<double> onto;
  Problem problem;
};

std::vector<Index> random_offsets(Index clusters, Xorshift64Star& random) {
  std::vector<Index> offsets{0, 1};  // a root of one node
  while (static_cast<Index>(offsets.size()) <= clusters) {
    offsets.push_back(offsets.back() + 1 + random.below(5));
  }
  return offsets;
}

bool near_to(double a, double b) { return std::abs(a - b) < 1e-9; }

/// What a path costs through the next layer is the least over the nodes of the layer before.
void values_are_minima_over_nodes() {
  Xorshift64Star random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const OwnedProblem owned({0, 10, 20}, random);
    const Index from = random.below(9);
    const Index to = random.below(9);
    const Index n_from = 1 + random.below(11);
    const Index n_to = 1 + random.below(11);
    std::vector<double> values(at(n_from));
    for (double& value : values) value = random.uniform();
    std::vector<double> pushed(at(n_to + kSpare));
    std::vector<double> pulled(at(n_to));
    push_values(owned.problem.costs, values.data(), from, n_from, to, n_to, pushed.data());
    pull_values(owned.problem.reverse, values.data(), from, n_from, to, n_to, pulled.data());
    for (Index w = 0; w < n_to; ++w) {
      double least = kInfinity;
      for (Index v = 0; v < n_from; ++v) {
        least = std::min(least, values[at(v)] + owned.problem.costs(from + v, to + w));
      }
      CHECK(pushed[at(w)] == least);
      CHECK(pulled[at(w)] == least);
    }
  }
}

/// A cluster taken out and put back elsewhere costs what building that tour anew says; then undone.
void changes_cost_what_building_anew_says() {
  constexpr Index kClusters = 9;
  constexpr double kTolerance = 1e-12;
  Xorshift64Star random(2);
  for (int trial = 0; trial < 200; ++trial) {
    const OwnedProblem owned(random_offsets(kClusters, random), random);
    std::vector<Index> order(kClusters);
    std::iota(order.begin(), order.end(), Index{0});
    Layers tour(owned.problem, 0);
    double cost = tour.build(order, 0);
    tour.begin_round();
    const Index c = 1 + random.below(kClusters - 1);
    tour.keep(c);
    cost += tour.close_gap(tour.before(c), tour.after(c), tour.carry(c), kTolerance);
    order.erase(std::find(order.begin(), order.end(), c));
    const std::size_t place = at(random.below(kClusters - 1));
    const Index behind = order[place];
    const double full = tour.insertion_cost(c, behind, tour.after(behind), kInfinity);
    const double limited = tour.insertion_cost(c, behind, tour.after(behind), 0.3);
    CHECK(limited == full || (limited == kInfinity && full >= 0.3 - kTolerance));
    cost += tour.link_in(c, behind, kTolerance);
    order.insert(order.begin() + static_cast<std::ptrdiff_t>(place) + 1, c);
    Layers anew(owned.problem, 0);
    CHECK(near_to(anew.build(order, 0), cost));
    tour.undo();
    for (Index i = 0; i < kClusters; ++i) CHECK(tour.after(i) == (i + 1) % kClusters);
  }
}

double length_of(const std::vector<Index>& order, const ArrayView<const double, 2>& costs) {
  double sum = 0.0;
  for (std::size_t p = 0; p < order.size(); ++p) {
    sum += costs(order[p], order[(p + 1) % order.size()]);
  }
  return sum;
}

/// Swaps and reversals keep every cluster, and gain what they say.
void segment_swaps_gain_what_they_say() {
  Xorshift64Star random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const Index count = 3 + random.below(9);
    const bool symmetric = random.below(2) == 1;
    std::vector<Index> offsets(at(count + 1));
    std::iota(offsets.begin(), offsets.end(), Index{0});
    OwnedProblem owned(offsets, random);
    if (symmetric) {
      for (Index i = 0; i < count; ++i) {
        for (Index j = 0; j < i; ++j) {
          owned.costs[at(i * (count + kSpare) + j)] = owned.costs[at(j * (count + kSpare) + i)];
        }
      }
    }
    const auto& costs = owned.problem.costs;
    std::vector<Index> near;
    for (Index i = 0; i < count; ++i) {
      std::vector<Index> others;
      for (Index j = 0; j < count; ++j) {
        if (j != i) others.push_back(j);
      }
      std::sort(others.begin(), others.end(),
                [&](Index a, Index b) { return costs(i, a) < costs(i, b); });
      near.insert(near.end(), others.begin(), others.end());
    }
    std::vector<Index> order = offsets;
    order.pop_back();
    for (Index i = count - 1; i > 0; --i) std::swap(order[at(i)], order[at(random.below(i + 1))]);
    std::vector<Index> nodes = order;
    const double before = length_of(order, costs);
    SegmentSwaps swaps;
    const double gain = swaps.improve(costs, {near.data(), {count, count - 1}},
                                      1 + random.below(count - 1), order, nodes, symmetric, 1e-12);
    CHECK(order == nodes);
    CHECK(near_to(length_of(order, costs), before - gain));
    std::sort(order.begin(), order.end());
    for (Index i = 0; i < count; ++i) CHECK(order[at(i)] == i);
  }
}

}  // namespace
}  // namespace pushplan::gtsp

int main() {
  pushplan::gtsp::values_are_minima_over_nodes();
  pushplan::gtsp::changes_cost_what_building_anew_says();
  pushplan::gtsp::segment_swaps_gain_what_they_say();
  return pushplan::tests::finish();
}
