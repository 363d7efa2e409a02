#include "pushplan/envs/planar_drive.hpp"

#include <algorithm>
#include <cmath>

namespace pushplan {
namespace {

constexpr Twist kStill{0.0, 0.0, 0.0};

}  // namespace

PlanarDrive::PlanarDrive(ChipmunkScene& scene, double radius, double tolerance)
    : scene_(scene), radius_(radius), tolerance_(tolerance) {}

void PlanarDrive::run(const DriveStep& step, std::span<const Index> active,
                      std::span<const BodyState> start, std::span<BodyState> states) {
  // A way back is kept only where something static is touched already, which is enough nearly
  // always; where it was missing, the step begins again, with one from every substep.
  if (!try_run(step, active, start, false, states)) try_run(step, active, start, true, states);
}

/// Returns false if a substep without a way back went too far.
bool PlanarDrive::try_run(const DriveStep& step, std::span<const Index> active,
                          std::span<const BodyState> start, bool careful,
                          std::span<BodyState> states) {
  count_ = start.size();
  const double w = step.angular;
  const double h = step.duration / static_cast<double>(step.samples * step.each);
  const double half = 0.5 * w * h;
  // the chord of an arc is shorter than the arc by sin(x) / x
  const bool bends = half != 0.0 && !step.holds;
  const double chord = step.linear * (bends ? std::sin(half) / half : 1.0);
  scene_.load(active, start);
  held_ = false;
  double heading = start[0].pose.theta;
  for (Index i = 0; i < step.samples; ++i) {
    const auto sample = states.subspan(static_cast<std::size_t>(i) * count_, count_);
    double advancing = chord;  // a robot that is held tries again after the next sample
    for (Index j = 0; j < step.each; ++j) {
      const bool is_first = i == 0 && j == 0;
      const double middle = step.holds ? step.course : heading + half + step.bearing;
      const Twist robot{advancing * std::cos(middle), advancing * std::sin(middle), w};
      if (!is_first && !careful && !scene_.touches_static()) {  // a jam needs something static
        scene_.advance(robot, h);
        if (!is_sound(tolerance_)) return false;
        heading += w * h;
        continue;
      }
      const Moved moved = substep(robot, h, is_first);
      if (moved == Moved::kNothing) {  // nor will it in the rest of the step
        scene_.read(sample);
        for (Index k = i + 1; k < step.samples; ++k) {
          std::ranges::copy(sample, states.begin() + k * static_cast<Index>(count_));
        }
        return true;
      }
      if (moved == Moved::kSome) {
        advancing = yielding_;
        heading = scene_.heading();
      } else {
        heading += w * h;
      }
    }
    scene_.read(sample);
  }
  return true;
}

void PlanarDrive::sweep(const Twist& robot, double h, Index count, std::span<const Index> active,
                        std::span<const BodyState> start, std::span<BodyState> end) {
  count_ = start.size();
  scene_.load(active, start);
  held_ = false;
  for (Index i = 0; i < count; ++i) {
    if (substep(robot, h, i == 0) != Moved::kAll) break;
  }
  scene_.read(end);
}

/// Moves everything by `h` [s], the robot at a velocity in the world frame.
PlanarDrive::Moved PlanarDrive::substep(const Twist& robot, double h, bool is_first) {
  before_.resize(count_);
  scene_.read(before_);
  const bool unknown = is_first || !measured_;  // how deep overlaps are that were there before
  double allowed = unknown ? tolerance_ : std::max(tolerance_, deepest_);
  if (attempt(robot, h, allowed)) return Moved::kAll;
  resting_ = before_;
  if (unknown) {  // overlaps that were deeper before are no reason to hold the robot
    for (BodyState& state : resting_) state.twist = kStill;
    scene_.write(resting_);
    scene_.advance(kStill, h);
    allowed = std::max(tolerance_, scene_.depth());
    scene_.write(before_);
    if (attempt(robot, h, allowed)) return Moved::kAll;
    resting_ = before_;
  }
  scene_.slow(resting_, h);
  held_ = true;
  const double heading = before_[0].pose.theta;
  for (const double speed : {0.0, -std::abs(robot.omega) * radius_}) {
    if (robot.omega == 0.0) break;
    scene_.write(resting_);
    const Twist turning{speed * std::cos(heading), speed * std::sin(heading), robot.omega};
    if (attempt(turning, h, allowed)) {
      yielding_ = speed;
      return Moved::kSome;
    }
  }
  scene_.write(resting_);
  const bool rolls = std::any_of(resting_.begin() + 1, resting_.end(),
                                 [](const BodyState& state) { return state.twist != kStill; });
  if (rolls && attempt(kStill, h, allowed)) {
    yielding_ = 0.0;
    return Moved::kSome;
  }
  for (BodyState& state : resting_) state.twist = kStill;
  scene_.write(resting_);
  return Moved::kNothing;
}

/// Advances by `h` [s]; returns true if no overlap beyond `allowed` [m] has come of it.
bool PlanarDrive::attempt(const Twist& robot, double h, double allowed) {
  scene_.advance(robot, h);
  return is_sound(allowed);
}

/// Returns true if the last substep caused no overlap beyond `allowed` [m].
bool PlanarDrive::is_sound(double allowed) {
  const bool measured = scene_.touches_static();
  const double depth = measured ? scene_.depth() : 0.0;
  if (depth > allowed) return false;
  deepest_ = depth;
  measured_ = measured;
  return true;
}

}  // namespace pushplan
