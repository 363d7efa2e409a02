#include "pushplan/envs/momentum.hpp"

#include <cmath>

namespace pushplan {
namespace {

/// Fraction of the speed that is left after `h` [s].
double kept(double speed, const Drag& drag, double h) {
  const double b = drag.linear;
  const double decay = std::exp(-b * h);
  // (1 - exp(-b h)) / b, which tends to h
  const double reach = b * h > 1e-12 ? -std::expm1(-b * h) / b : h;
  return decay / (1.0 + drag.quadratic * speed * reach);
}

}  // namespace

void slow_down(std::span<const Twist> velocities, std::span<const double> keeps,
               std::span<const BodyDrag> drag, double h, std::span<Twist> out) {
  for (std::size_t i = 0; i < velocities.size(); ++i) {
    out[i] = {0.0, 0.0, 0.0};
    if (keeps[i] == 0.0) continue;
    const Twist v = velocities[i];
    const double fraction = kept(std::hypot(v.vx, v.vy), drag[i].translation, h);
    out[i] = {fraction * v.vx, fraction * v.vy,
              v.omega * kept(std::abs(v.omega), drag[i].rotation, h)};
  }
}

}  // namespace pushplan
