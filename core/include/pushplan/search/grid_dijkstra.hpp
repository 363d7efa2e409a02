// Dijkstra's algorithm over the cells of a grid with eight neighbours each.
#pragma once

#include <span>
#include <vector>

#include "pushplan/search/heap.hpp"

namespace pushplan {

/// A search from some cells, which are counted row by row. It runs in batches; the weights have to
/// outlive it.
class GridDijkstra {
 public:
  GridDijkstra(ArrayView<const double, 2> weights,  // cost per metre of a move into each cell,
                                                    // infinite where it is closed
               double cell,                         // side of a cell [m]
               std::span<const Index> starts);

  /// Goes on until so many cells are settled in all. False when a goal or all cells are settled.
  bool settle(ArrayView<const bool, 2> goals, Index upto);

  /// (rows, columns), infinite where no path is known.
  ArrayView<const double, 2> costs() const { return {costs_.data(), weights_.shape()}; }
  /// The cell before each one, -1 if there is none.
  std::span<const Index> parents() const { return parents_; }
  /// The settled cells in order.
  std::span<const Index> order() const { return order_; }

 private:
  ArrayView<const double, 2> weights_;
  double cell_;
  std::vector<double> costs_;
  std::vector<Index> parents_;
  std::vector<Index> places_;
  std::vector<Index> order_;
  NodeHeap heap_;
};

}  // namespace pushplan
