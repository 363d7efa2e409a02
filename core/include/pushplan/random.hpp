// Random numbers that are the same on every machine.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

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

/// Random numbers from a seed that may be any number, 0 and small ones too.
class Random : public Xorshift64Star {
 public:
  explicit Random(std::uint64_t seed) : Xorshift64Star(spread(seed)) {}

  /// A normal deviate (Box and Muller 1958): the same from every standard library.
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  /// A state unlike those of near seeds (the finalizer of SplitMix64, Steele, Lea and Flood 2014);
  /// odd, as it must not be 0.
  static std::uint64_t spread(std::uint64_t seed) {
    seed += 0x9e3779b97f4a7c15ULL;
    seed = (seed ^ (seed >> 30)) * 0xbf58476d1ce4e5b9ULL;
    seed = (seed ^ (seed >> 27)) * 0x94d049bb133111ebULL;
    return (seed ^ (seed >> 31)) | 1;
  }
};

}  // namespace pushplan
