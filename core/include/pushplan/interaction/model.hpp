// Interaction models as searches over paths use them: one small step of the robot at a time.
#pragma once

#include <concepts>
#include <span>
#include <vector>

#include "pushplan/geometry/pose.hpp"
#include "pushplan/interaction/ice.hpp"
#include "pushplan/interaction/quasi_static.hpp"

namespace pushplan {

/// A model of what the robot does to K objects. `advance` drives the robot to a near pose along a
/// straight line, changes the objects' poses and adds to the lengths of their paths [m]; it returns
/// false where the robot jams. `tests` counts its work: a measure of time without a clock.
template <class M>
concept InteractionModel =
    requires(M& model, const Pose& pose, std::span<Pose> poses, std::span<double> lengths) {
      { model.advance(pose, pose, poses, lengths) } -> std::same_as<bool>;
      { model.radii() } -> std::same_as<std::span<const double>>;           // (K,) [m]
      { model.inverse_masses() } -> std::same_as<std::span<const double>>;  // (K,) [1/kg]
      { model.tests() } -> std::same_as<Index>;
      model.reset_tests();
    };

/// Floes that push floes; nothing holds the hull. It remembers for which poses it has worked out
/// the corners of the floes.
class IceInteraction {
 public:
  IceInteraction(const IceBodies& bodies, const IceSettings& settings);

  bool advance(const Pose& from, const Pose& to, std::span<Pose> poses, std::span<double> lengths);

  std::span<const double> radii() const { return contacts_.bodies().radii; }
  std::span<const double> inverse_masses() const { return inverse_masses_; }
  /// Steps of the hull so far.
  Index tests() const { return tests_; }
  void reset_tests() { tests_ = 0; }

 private:
  IceContacts contacts_;
  std::vector<double> inverse_masses_;
  std::vector<Pose> known_;  // poses for which the corners are worked out
  Index tests_ = 0;
};

/// Any other model, behind a function.
class CalledInteraction {
 public:
  /// As `advance` of a model, over arrays of `count` objects. Where it returns false, it has
  /// changed neither of them.
  using Advance = bool (*)(void* context, Index count, const Pose* from, const Pose* to,
                           Pose* poses, double* lengths);

  CalledInteraction(Advance advance, void* context, std::span<const double> radii,
                    std::span<const double> inverse_masses)
      : advance_(advance), context_(context), radii_(radii), inverse_masses_(inverse_masses) {}

  bool advance(const Pose& from, const Pose& to, std::span<Pose> poses, std::span<double> lengths) {
    ++tests_;
    return advance_(context_, static_cast<Index>(poses.size()), &from, &to, poses.data(),
                    lengths.data());
  }

  std::span<const double> radii() const { return radii_; }
  std::span<const double> inverse_masses() const { return inverse_masses_; }
  /// Calls so far.
  Index tests() const { return tests_; }
  void reset_tests() { tests_ = 0; }

 private:
  Advance advance_;
  void* context_;
  std::span<const double> radii_;
  std::span<const double> inverse_masses_;
  Index tests_ = 0;
};

static_assert(InteractionModel<QuasiStatic>);
static_assert(InteractionModel<IceInteraction>);
static_assert(InteractionModel<CalledInteraction>);

}  // namespace pushplan
