// A binary heap of nodes whose keys can be changed.
#pragma once

#include <cstddef>
#include <vector>

#include "pushplan/array.hpp"

namespace pushplan {

/// A heap that tells each node where it is. Equal keys are taken in the order of the nodes'
/// numbers: the same search on every machine.
///
/// The places are kept by whoever keeps the nodes: `place(node)` is a reference to an `Index`,
/// `kNowhere` for a node that is not in the heap.
class NodeHeap {
 public:
  static constexpr Index kNowhere = -1;

  NodeHeap() = default;
  /// With room for so many nodes before it allocates.
  explicit NodeHeap(Index room) { entries_.reserve(static_cast<std::size_t>(room)); }

  bool empty() const { return entries_.empty(); }
  Index size() const { return static_cast<Index>(entries_.size()); }
  /// The node of the least key; the heap must not be empty.
  Index least() const { return entries_.front().node; }
  /// All nodes, the least first and the others in the order of the heap.
  std::vector<Index> nodes() const {
    std::vector<Index> all;
    all.reserve(entries_.size());
    for (const Entry& entry : entries_) all.push_back(entry.node);
    return all;
  }

  /// Forgets all nodes, but not their places.
  void clear() { entries_.clear(); }

  /// Puts a node into the heap, or changes its key if it is there.
  template <class Place>
  void push_or_change(Index node, double key, const Place& place) {
    const Index known = place(node);
    const Entry entry{key, node};
    if (known < 0) {
      entries_.push_back(entry);
      lift(entries_.size() - 1, entry, place);
    } else if (key > entries_[static_cast<std::size_t>(known)].key) {
      sink(static_cast<std::size_t>(known), entry, place);
    } else {
      lift(static_cast<std::size_t>(known), entry, place);
    }
  }

  /// Takes out the node of the least key; the heap must not be empty.
  template <class Place>
  Index pop(const Place& place) {
    const Index least = entries_.front().node;
    place(least) = kNowhere;
    const Entry last = entries_.back();
    entries_.pop_back();
    if (!entries_.empty()) sink(0, last, place);
    return least;
  }

 private:
  struct Entry {
    double key;
    Index node;

    bool operator<(const Entry& other) const {
      return key < other.key || (key == other.key && node < other.node);
    }
  };

  template <class Place>
  void put(std::size_t at, const Entry& entry, const Place& place) {
    entries_[at] = entry;
    place(entry.node) = static_cast<Index>(at);
  }

  /// Puts a node at its place at or above `at`.
  template <class Place>
  void lift(std::size_t at, const Entry& entry, const Place& place) {
    while (at > 0) {
      const std::size_t above = (at - 1) >> 1;
      if (!(entry < entries_[above])) break;
      put(at, entries_[above], place);
      at = above;
    }
    put(at, entry, place);
  }

  /// Puts a node at its place at or below `at`.
  template <class Place>
  void sink(std::size_t at, const Entry& entry, const Place& place) {
    const std::size_t size = entries_.size();
    while (true) {
      std::size_t below = 2 * at + 1;
      if (below >= size) break;
      const std::size_t right = below + 1;
      if (right < size && entries_[right] < entries_[below]) below = right;
      if (!(entries_[below] < entry)) break;
      put(at, entries_[below], place);
      at = below;
    }
    put(at, entry, place);
  }

  std::vector<Entry> entries_;
};

}  // namespace pushplan
