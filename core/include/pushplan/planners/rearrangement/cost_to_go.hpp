// The cheapest order of pushes that delivers everything, exactly, for few objects.
#pragma once

#include <span>

#include "pushplan/array.hpp"

namespace pushplan::rearrangement {

/// Number of objects that a set in one machine word can hold.
inline constexpr Index kMaxObjects = 62;
/// Up to so many objects every completion is computed exactly.
inline constexpr Index kMaxExact = 11;

/// For each set of delivered objects (a row) and each last push (a column; the last one before any
/// push), the cost of delivering the rest and the push to follow, -1 where nothing helps. Both are
/// of shape (2^objects, N + 1).
struct CostToGo {
  ArrayView<double, 2> costs;
  ArrayView<Index, 2> following;
};

/// Fills the table by backward dynamic programming over sets (Held and Karp 1962), with pushes in
/// the place of cities and sets that may grow by several objects at once.
void fill_cost_to_go(ArrayView<const double, 2> costs,  // (N + 1, N) of each push after each other
                                                        // one, the last row after the start
                     std::span<const Index> delivers,   // (N,) objects of each push, one bit each
                     Index objects,                     // at most `kMaxExact`
                     const CostToGo& table);

}  // namespace pushplan::rearrangement
