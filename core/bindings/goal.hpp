// A goal as Python gives it.
#pragma once

#include "arrays.hpp"
#include "pushplan/motion/goal_region.hpp"

namespace pushplan::bindings {

/// A goal as `goal_numbers` of Python gives it; 2 is a disc whose heading a path curves into, 3 one
/// where it turns to it.
inline GoalRegion goal_region(const Numbers<5>& numbers) {
  const double* n = numbers.data();
  if (n[0] >= 2.0) {
    return {GoalRegion::Kind::kDisc, {n[1], n[2]}, {0.0, 0.0}, n[3], n[4], n[0] == 3.0};
  }
  if (n[0] == 0.0) return {GoalRegion::Kind::kDisc, {n[1], n[2]}, {0.0, 0.0}, n[3]};
  return {GoalRegion::Kind::kLine, {n[1], n[2]}, {n[3], n[4]}, 0.0};
}

}  // namespace pushplan::bindings
