#include "pushplan/interaction/model.hpp"

#include <cmath>
#include <limits>

namespace pushplan {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

}  // namespace

IceInteraction::IceInteraction(const IceBodies& bodies, const IceSettings& settings)
    : contacts_(bodies, settings), known_(bodies.radii.size(), {kUnknown, kUnknown, kUnknown}) {
  inverse_masses_.reserve(bodies.masses.size());
  for (const double mass : bodies.masses) inverse_masses_.push_back(1.0 / mass);
}

bool IceInteraction::advance(const Pose& from, const Pose& to, std::span<Pose> poses,
                             std::span<double> lengths) {
  for (std::size_t k = 0; k < poses.size(); ++k) {
    if (poses[k] == known_[k]) continue;
    known_[k] = poses[k];
    contacts_.place(static_cast<Index>(k), poses[k]);
  }
  const auto [work, steps] = contacts_.drive(from, to, poses, 0.0);
  tests_ += steps;
  if (!(work > 0.0)) return true;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const double dx = poses[k].x - known_[k].x;
    const double dy = poses[k].y - known_[k].y;
    if (dx == 0.0 && dy == 0.0 && poses[k].theta == known_[k].theta) continue;
    lengths[k] += std::sqrt(dx * dx + dy * dy);
    known_[k] = poses[k];
  }
  return true;
}

}  // namespace pushplan
