// Random numbers that are the same on every machine.
#pragma once

#include <cstdint>

#include "pushplan/array.hpp"

namespace pushplan {

/// The generator xorshift64* (Vigna 2016, "An experimental exploration of Marsaglia's xorshift
/// generators, scrambled"). The state must not be 0.
class Xorshift64Star {
 public:
  explicit Xorshift64Star(std::uint64_t state) : state_(state) {}

  std::uint64_t state() const { return state_; }

  /// A number in [0, 1), one of the 2^53 multiples of 2^-53.
  double uniform() {
    state_ ^= state_ >> 12;
    state_ ^= state_ << 25;
    state_ ^= state_ >> 27;
    const std::uint64_t high = (state_ * 2685821657736338717ULL) >> 11;
    return static_cast<double>(high) * (1.0 / 9007199254740992.0);
  }

  /// A whole number from 0 to `count - 1`.
  Index below(Index count) { return static_cast<Index>(uniform() * static_cast<double>(count)); }

 private:
  std::uint64_t state_;
};

}  // namespace pushplan
