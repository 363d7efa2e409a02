// The nodes of a search tree whose arcs are driven with the objects carried along.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "pushplan/motion/arc_rollout.hpp"

namespace pushplan {

/// A search tree, in memory that is made once. A node that moves nothing shares the objects of its
/// parent.
class PushTree {
 public:
  static constexpr Index kNone = -1;  // parent of the root, and row of an arc not driven yet

  struct Node {
    Pose pose;
    double cost;      // m0 l0 + w sum(mi li) so far [kg m]
    double estimate;  // the same for the whole path through the node
    Index parent;
    Arc arc;    // that leads to the node
    Index row;  // of its objects
  };

  /// Shape of the cells for which the least cost of a node is kept.
  struct CellShape {
    Index rows = 1;
    Index columns = 1;
    Index headings = 1;

    Index count() const { return rows * columns * headings; }
  };

  PushTree(Index nodes,    // at most
           Index objects,  // K
           double memory,  // for their poses [MiB]
           const CellShape& cells)
      : capacity_(nodes),
        objects_(objects),
        rows_(std::max(Index{2}, std::min(rows_in(memory, objects), nodes))),
        nodes_(std::make_unique_for_overwrite<Node[]>(static_cast<std::size_t>(nodes))),
        poses_(std::make_unique_for_overwrite<Pose[]>(static_cast<std::size_t>(rows_ * objects))) {
    set_cells(cells);
  }

  /// Changes the shape of the cells; a search has to begin after that.
  void set_cells(const CellShape& cells) {
    cells_ = cells;
    best_ = std::make_unique_for_overwrite<double[]>(static_cast<std::size_t>(cells.count()));
  }

  /// Begins a search at a pose, with the objects at some poses.
  void plant(const Pose& pose, std::span<const Pose> objects, double estimate) {
    std::fill_n(best_.get(), cells_.count(), std::numeric_limits<double>::infinity());
    nodes_[0] = {pose, 0.0, estimate, kNone, {0.0, 0.0}, 0};
    std::copy(objects.begin(), objects.end(), poses_.get());
    count_ = 1;
    rows_used_ = 1;
    full = false;
    driven = 0;
  }

  Index count() const { return count_; }
  /// Number of nodes for which there is memory.
  Index capacity() const { return capacity_; }
  /// Whether there is room for so many more nodes, and whether for more objects.
  bool has_room(Index nodes) const { return count_ + nodes <= capacity_; }
  bool has_room_for_objects() const { return rows_used_ < rows_; }

  Node& operator[](Index node) { return nodes_[static_cast<std::size_t>(node)]; }
  const Node& operator[](Index node) const { return nodes_[static_cast<std::size_t>(node)]; }
  /// The first node that is not in use, as it is before `keep`.
  Node& spare() { return (*this)[count_]; }
  /// Takes the spare node into the tree. Returns its number.
  Index keep() { return count_++; }

  /// Poses of the objects in a row.
  std::span<const Pose> objects(Index row) const {
    return {poses_.get() + row * objects_, static_cast<std::size_t>(objects_)};
  }
  /// Keeps poses of objects in a row of their own. Returns its number.
  Index add_objects(std::span<const Pose> poses) {
    std::copy(poses.begin(), poses.end(), poses_.get() + rows_used_ * objects_);
    return rows_used_++;
  }

  const CellShape& cells() const { return cells_; }
  /// Least cost of a node in a cell [kg m].
  double& best(Index cell) { return best_[static_cast<std::size_t>(cell)]; }

  /// Drives the arc to a node. Returns the length driven [m], as `ArcRollout` does.
  template <InteractionModel M>
  double drive(Node& node, ArcRollout<M>& rollout) {
    const Node& parent = (*this)[node.parent];
    const double length = rollout.roll(parent.pose, objects(parent.row), node.arc);
    const Pose& end = rollout.end();
    if (length > 0.0 && rollout.problem().goal.contains({end.x, end.y})) {
      node.pose = end;  // it may come in before the end of the arc
    }
    return length;
  }

  /// The arcs from the root to a node.
  std::vector<Arc> arcs_to(Index node) const {
    std::vector<Arc> arcs;
    for (Index at = node; (*this)[at].parent >= 0; at = (*this)[at].parent) {
      arcs.push_back((*this)[at].arc);
    }
    std::reverse(arcs.begin(), arcs.end());
    return arcs;
  }

  bool full = false;  // memory was too small for a node
  Index driven = 0;   // arcs that a search wanted to drive

 private:
  static Index rows_in(double memory, Index objects) {
    return static_cast<Index>(memory * 1048576.0 /
                              static_cast<double>(24 * std::max(objects, Index{1})));
  }

  Index capacity_;
  Index objects_;
  Index rows_;
  std::unique_ptr<Node[]> nodes_;
  std::unique_ptr<Pose[]> poses_;
  CellShape cells_;
  std::unique_ptr<double[]> best_;
  Index count_ = 0;
  Index rows_used_ = 0;
};

}  // namespace pushplan
