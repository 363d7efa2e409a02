// Numbers rounded to indices, without the calls that std::floor and std::ceil are on old processors.
#pragma once

#include "pushplan/array.hpp"

namespace pushplan {

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
