// A* over any lattice: a lattice knows its kinematics, the search does not.
//
// Hart, Nilsson and Raphael (1968). Nodes are opened again where the estimate is not consistent, so
// the cost found is optimal whenever the estimate is admissible.
#pragma once

#include <concepts>
#include <limits>
#include <utility>
#include <vector>

#include "pushplan/search/search_tree.hpp"

namespace pushplan {

/// What a search wants of a graph. `expand(node, visit)` calls `visit(successor, cost, edge)` for
/// each successor, with the cost of the edge, not negative, and a label from which a path is put
/// together later. `estimate` bounds the cost from a node to the goal from below.
template <class T>
concept Lattice = requires(T& lattice, Index node, void (*visit)(Index, double, Index)) {
  lattice.expand(node, visit);
  { lattice.estimate(node) } -> std::convertible_to<double>;
  { lattice.is_goal(node) } -> std::convertible_to<bool>;
};

enum class SearchStatus {
  kExhausted,  // no path exists
  kFound,      // the cheapest open node is a goal
  kPaused      // the budget was used up
};

/// A search that runs in batches and can be taken up again.
template <Lattice L>
class AStar {
 public:
  AStar(L lattice, Index size) : lattice_(std::move(lattice)), tree_(size) {}

  /// Opens a node from which paths may begin.
  void start(Index node, double cost = 0.0, double bound = 0.0, Index edge = -1) {
    tree_.offer(node, cost, bound, SearchTree::kNone, edge);
  }

  /// Expands up to `budget` nodes.
  SearchStatus run(Index budget) {
    for (Index i = 0; i < budget; ++i) {
      if (tree_.exhausted()) return SearchStatus::kExhausted;
      if (lattice_.is_goal(tree_.next())) {
        goal_ = tree_.next();
        return SearchStatus::kFound;
      }
      const Index node = tree_.take();
      const double here = tree_.cost(node);
      lattice_.expand(node, [&](Index successor, double edge_cost, Index edge) {
        const double cost = here + edge_cost;
        if (!tree_.known(successor) || cost < tree_.cost(successor)) {
          tree_.offer(successor, cost, lattice_.estimate(successor), node, edge);
        }
      });
    }
    return SearchStatus::kPaused;
  }

  /// Begins a new search over another lattice of no more nodes, in the same memory.
  void restart(L lattice) {
    lattice_ = std::move(lattice);
    tree_.clear();
    goal_ = -1;
  }

  L& lattice() { return lattice_; }
  SearchTree& tree() { return tree_; }
  const SearchTree& tree() const { return tree_; }
  /// The goal that was reached, -1 before.
  Index goal() const { return goal_; }
  /// Cost of the path to the goal, infinite before it is reached.
  double cost() const {
    return goal_ >= 0 ? tree_.cost(goal_) : std::numeric_limits<double>::infinity();
  }

 private:
  L lattice_;
  SearchTree tree_;
  Index goal_ = -1;
};

}  // namespace pushplan
