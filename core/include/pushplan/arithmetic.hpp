// Constants, and rounding to whole numbers. Division rounds down: remainders are never negative.
#pragma once

#include <cmath>
#include <limits>
#include <numbers>

#include "pushplan/array.hpp"

namespace pushplan {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kTurn = 2.0 * std::numbers::pi;  // [rad]

/// The remainder of `a` by a positive `b`, in [0, b).
inline double floor_mod(double a, double b) {
  if (a >= 0.0 && a < b) return a + 0.0;  // no negative zero
  const double rest = std::fmod(a, b);
  if (rest == 0.0) return 0.0;
  return rest < 0.0 ? rest + b : rest;
}

/// The same of whole numbers, in [0, b).
constexpr Index floor_mod(Index a, Index b) {
  const Index rest = a % b;
  return rest < 0 ? rest + b : rest;
}

// Without the calls that std::floor and std::ceil are on old processors.

/// The greatest index that is not above `x`.
inline Index floor_index(double x) {
  const auto truncated = static_cast<Index>(x);
  return truncated - (static_cast<double>(truncated) > x ? 1 : 0);
}

/// The least index that is not below `x`.
inline Index ceil_index(double x) {
  const auto truncated = static_cast<Index>(x);
  return truncated + (static_cast<double>(truncated) < x ? 1 : 0);
}

}  // namespace pushplan
