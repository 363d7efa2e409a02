// Graph search, which Python sees through its lattices only.
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "check.hpp"
#include "pushplan/arithmetic.hpp"
#include "pushplan/random.hpp"
#include "pushplan/search/astar.hpp"
#include "pushplan/search/grid_dijkstra.hpp"

namespace pushplan {
namespace {

constexpr Index kStart = 0;
constexpr Index kGoal = 7;

/// A directed graph with bounds of the costs to the goal.
struct Graph {
  struct Edge {
    Index from;
    Index to;
    double cost;
  };

  Graph(Index nodes, Index count, Xorshift64Star& random) : bounds(at(nodes), 0.0) {
    for (Index e = 0; e < count; ++e) {
      edges.push_back({random.below(nodes), random.below(nodes), random.uniform() + 0.01});
    }
  }

  /// Least costs from each node to the goal, by relaxing all edges until nothing changes.
  std::vector<double> costs_to_goal() const {
    std::vector<double> costs(bounds.size(), kInfinity);
    costs[at(kGoal)] = 0.0;
    for (bool changed = true; changed;) {
      changed = false;
      for (const Edge& edge : edges) {
        const double cost = edge.cost + costs[at(edge.to)];
        if (cost < costs[at(edge.from)]) {
          costs[at(edge.from)] = cost;
          changed = true;
        }
      }
    }
    return costs;
  }

  template <class Visit>
  void expand(Index node, Visit&& visit) const {
    for (std::size_t e = 0; e < edges.size(); ++e) {
      if (edges[e].from == node) visit(edges[e].to, edges[e].cost, static_cast<Index>(e));
    }
  }
  double estimate(Index node) const { return bounds[at(node)]; }
  bool is_goal(Index node) const { return node == kGoal; }

  std::vector<Edge> edges;
  std::vector<double> bounds;
};

bool near_to(double a, double b) { return std::abs(a - b) < 1e-9; }

/// The cost is least whatever the batch and the bound, which is admissible and not consistent.
void costs_are_least() {
  Xorshift64Star random(1);
  int found = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Graph graph(120, 200 + random.below(400), random);
    const std::vector<double> exact = graph.costs_to_goal();
    for (std::size_t i = 0; i < exact.size(); ++i) graph.bounds[i] = random.uniform() * exact[i];
    const Index batch = 1 + random.below(50);
    AStar<Graph> star(graph, 120);
    for (int round = 0; round < 2; ++round) {  // the second in the memory of the first
      if (round == 1) star.restart(graph);
      star.start(kStart);
      SearchStatus status = SearchStatus::kPaused;
      while (status == SearchStatus::kPaused) status = star.run(batch);
      const double cost = exact[at(kStart)];
      if (cost == kInfinity) {
        CHECK(status == SearchStatus::kExhausted && star.goal() == -1);
        CHECK(star.cost() == kInfinity);
        continue;
      }
      ++found;
      CHECK(status == SearchStatus::kFound && star.goal() == kGoal);
      CHECK(near_to(star.cost(), cost));
      const std::vector<SearchTree::Step> path = star.tree().path(kGoal);
      CHECK(path.front().node == kStart && path.back().node == kGoal);
      double sum = 0.0;
      for (std::size_t p = 1; p < path.size(); ++p) {
        const Graph::Edge& edge = graph.edges[at(path[p].edge)];
        CHECK(edge.from == path[p - 1].node && edge.to == path[p].node);
        sum += edge.cost;
      }
      CHECK(near_to(sum, cost));
    }
  }
  CHECK(found > 100);
}

/// The better the bound, the fewer nodes are expanded.
void better_bounds_expand_fewer_nodes() {
  Xorshift64Star random(3);
  Graph graph(120, 500, random);
  const std::vector<double> exact = graph.costs_to_goal();
  CHECK(exact[at(kStart)] < kInfinity);
  Index before = 121;
  for (const double share : {0.0, 0.5, 1.0}) {
    for (std::size_t i = 0; i < exact.size(); ++i) {
      graph.bounds[i] = exact[i] < kInfinity ? share * exact[i] : kInfinity;
    }
    AStar<Graph> star(graph, 120);
    star.start(kStart);
    CHECK(star.run(10000) == SearchStatus::kFound);
    CHECK(star.tree().expanded() < before);
    before = star.tree().expanded();
  }
}

void without_a_start_there_is_no_path() {
  Xorshift64Star random(4);
  AStar<Graph> star(Graph(120, 500, random), 120);
  CHECK(star.run(10) == SearchStatus::kExhausted);
}

/// Nodes leave a heap by their keys as last changed, equal keys by the nodes' numbers.
void heaps_are_in_order() {
  Xorshift64Star random(5);
  for (int trial = 0; trial < 200; ++trial) {
    const Index count = 1 + random.below(60);
    std::vector<double> keys(at(count));
    std::vector<Index> places(at(count), NodeHeap::kNowhere);
    const auto place = [&](Index node) -> Index& { return places[at(node)]; };
    NodeHeap heap;
    for (Index change = 0; change < 3 * count; ++change) {
      const Index node = change < count ? change : random.below(count);
      keys[at(node)] = static_cast<double>(random.below(10));  // many are equal
      heap.push_or_change(node, keys[at(node)], place);
    }
    CHECK(heap.size() == count);
    std::pair<double, Index> last{-1.0, -1};
    while (!heap.empty()) {
      const Index node = heap.pop(place);
      const std::pair<double, Index> next{keys[at(node)], node};
      CHECK(last < next && places[at(node)] == NodeHeap::kNowhere);
      last = next;
    }
  }
}

/// Costs of small grids, in one batch or many, are those of relaxing all moves.
void grid_costs_are_least() {
  constexpr Index kRows = 6;
  constexpr Index kColumns = 7;
  constexpr Index kCells = kRows * kColumns;
  Xorshift64Star random(6);
  const auto no_goals = std::make_unique<bool[]>(kCells);
  for (int trial = 0; trial < 100; ++trial) {
    std::vector<double> weights(kCells);
    for (double& weight : weights) {
      weight = random.below(4) == 0 ? kInfinity : 0.5 + random.uniform();
    }
    const std::vector<Index> starts{random.below(kCells), random.below(kCells)};
    std::vector<double> exact(kCells, kInfinity);
    for (const Index start : starts) exact[at(start)] = 0.0;
    for (bool changed = true; changed;) {
      changed = false;
      for (Index cell = 0; cell < kCells * kCells; ++cell) {
        const Index from = cell / kCells;
        const Index to = cell % kCells;
        const Index down = std::abs(from / kColumns - to / kColumns);
        const Index across = std::abs(from % kColumns - to % kColumns);
        if (std::max(down, across) != 1) continue;
        const double length = 0.2 * std::sqrt(static_cast<double>(down + across));
        const double cost = exact[at(from)] + length * weights[at(to)];
        if (!(cost < exact[at(to)] - 1e-12)) continue;
        exact[at(to)] = cost;
        changed = true;
      }
    }
    GridDijkstra search({weights.data(), {kRows, kColumns}}, 0.2, starts);
    const Index batch = 1 + random.below(kCells);
    Index upto = batch;
    while (search.settle({no_goals.get(), {kRows, kColumns}}, upto)) upto += batch;
    double last = 0.0;
    for (const Index cell : search.order()) {
      const double cost = search.costs().data()[cell];
      CHECK(near_to(cost, exact[at(cell)]) && cost >= last);
      last = cost;
    }
    for (Index cell = 0; cell < kCells; ++cell) {
      CHECK((search.costs().data()[cell] == kInfinity) == (exact[at(cell)] == kInfinity));
    }
  }
}

}  // namespace
}  // namespace pushplan

int main() {
  pushplan::costs_are_least();
  pushplan::better_bounds_expand_fewer_nodes();
  pushplan::without_a_start_there_is_no_path();
  pushplan::heaps_are_in_order();
  pushplan::grid_costs_are_least();
  return pushplan::tests::finish();
}
