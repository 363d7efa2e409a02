// What a graph search has found out so far.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <limits>
#include <memory>
#include <new>
#include <vector>

#include "pushplan/search/heap.hpp"

namespace pushplan {

/// Cheapest paths known to the nodes 0 to `size` - 1, and the open nodes, in the order of cost plus
/// bound. Its memory is taken from the system where it is first used, and `clear` takes the same
/// time for every size: a large graph costs what is looked at.
class SearchTree {
 public:
  static constexpr Index kNone = -1;  // the parent of a start

  struct Step {
    Index node;
    Index edge;  // label of the edge that leads to the node
  };

  explicit SearchTree(Index size)
      : nodes_(static_cast<Node*>(
            std::calloc(static_cast<std::size_t>(size > 0 ? size : 1), sizeof(Node)))),
        size_(size) {
    if (!nodes_) throw std::bad_alloc();
  }

  /// Forgets everything that has been found.
  void clear() {
    if (++round_ == 0) {  // after 2^32 searches
      for (Index node = 0; node < size_; ++node) nodes_[node].round = 0;
      round_ = 1;
    }
    open_.clear();
    expanded_ = 0;
  }

  /// Takes note of a path to a node, which is opened if none as cheap was known. `bound` is a lower
  /// bound of the cost from there to the goal; nothing happens where the sum is infinite.
  void offer(Index node, double cost, double bound, Index parent, Index edge) {
    Node& here = nodes_[node];
    const bool is_new = here.round != round_;
    if (!(cost + bound < std::numeric_limits<double>::infinity())) return;
    if (!is_new && cost >= here.cost) return;
    if (is_new) {
      here.round = round_;
      here.place = NodeHeap::kNowhere;
    }
    here.cost = cost;
    here.parent = parent;
    here.edge = edge;
    here.closed = false;
    open_.push_or_change(node, cost + bound, place());
  }

  /// The open node of least cost plus bound, now closed; `kNone` if none is open.
  Index take() {
    if (open_.empty()) return kNone;
    const Index node = open_.pop(place());
    nodes_[node].closed = true;
    ++expanded_;
    return node;
  }

  Index size() const { return size_; }
  bool exhausted() const { return open_.empty(); }
  /// Number of open nodes.
  Index open_count() const { return open_.size(); }
  /// The open nodes, the one that `take` would return first.
  std::vector<Index> open_nodes() const { return open_.nodes(); }
  /// The node that `take` would return; one must be open.
  Index next() const { return open_.least(); }
  /// Number of nodes taken so far; a node may be taken again at a lower cost.
  Index expanded() const { return expanded_; }

  /// True if a path to the node has been found. The others tell about such nodes only.
  bool known(Index node) const { return nodes_[node].round == round_; }
  /// True if the node has been taken at its present cost.
  bool closed(Index node) const { return nodes_[node].closed; }
  double cost(Index node) const { return nodes_[node].cost; }
  Index parent(Index node) const { return nodes_[node].parent; }
  Index edge(Index node) const { return nodes_[node].edge; }

  /// The path from a start to a node.
  std::vector<Step> path(Index node) const {
    std::vector<Step> steps;
    for (Index at = node; at >= 0; at = parent(at)) steps.push_back({at, edge(at)});
    return {steps.rbegin(), steps.rend()};
  }

 private:
  struct Node {
    double cost;
    Index parent;
    Index edge;
    Index place;          // in the heap
    std::uint32_t round;  // the search that has found a path to it
    bool closed;
  };

  struct Free {
    void operator()(Node* nodes) const { std::free(nodes); }
  };

  /// Where in the heap a node is.
  struct Places {
    Node* nodes;
    Index& operator()(Index node) const { return nodes[node].place; }
  };

  Places place() { return {nodes_.get()}; }

  std::unique_ptr<Node[], Free> nodes_;
  Index size_;
  std::uint32_t round_ = 1;
  NodeHeap open_;
  Index expanded_ = 0;
};

}  // namespace pushplan
