#include "pushplan/envs/momentum.hpp"

#include <algorithm>
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

Twist Momentum::after(Index i, const Twist& v, double h) const {
  const auto body = static_cast<std::size_t>(i);
  if (keeps[body] == 0.0) return {0.0, 0.0, 0.0};
  const double fraction = kept(std::hypot(v.vx, v.vy), drag[body].translation, h);
  return {fraction * v.vx, fraction * v.vy,
          v.omega * kept(std::abs(v.omega), drag[body].rotation, h)};
}

double Momentum::decay(Index i, const Twist& v) const {
  const auto body = static_cast<std::size_t>(i);
  if (keeps[body] == 0.0 || v == Twist{0.0, 0.0, 0.0}) return 0.0;
  const auto& [translation, rotation] = drag[body];
  return std::max(translation.linear + translation.quadratic * std::hypot(v.vx, v.vy),
                  rotation.linear + rotation.quadratic * std::abs(v.omega));
}

}  // namespace pushplan
