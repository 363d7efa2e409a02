#include "pushplan/motion/dubins.hpp"

#include <algorithm>
#include <cmath>

#include "pushplan/arithmetic.hpp"

namespace pushplan {
namespace {

/// Squares are compared with this, since rounding may take a zero below zero.
constexpr double kLeastSquare = -1e-9;

/// Angle in [0, 2 pi); a turn that is full but for rounding is none.
double forward_turn(double angle) {
  angle = floor_mod(angle, kTurn);
  return angle > kTurn - 1e-9 ? 0.0 : angle;
}

/// Lengths of the pieces of a word, in units of the turning radius; negative if it does not exist.
struct Word {
  double first = -1.0;
  double middle = -1.0;
  double last = -1.0;

  double length() const { return first + middle + last; }
};

/// The side to which each piece of a word turns: 1 left, 0 straight, -1 right.
struct Sides {
  double first;
  double middle;
  double last;
};

constexpr std::array<Sides, 6> kSides{{{1.0, 0.0, 1.0},     // LSL
                                       {-1.0, 0.0, -1.0},   // RSR
                                       {1.0, 0.0, -1.0},    // LSR
                                       {-1.0, 0.0, 1.0},    // RSL
                                       {-1.0, 1.0, -1.0},   // RLR
                                       {1.0, -1.0, 1.0}}};  // LRL

}  // namespace

DubinsPath dubins(const Pose& start, const Pose& end, double radius) {
  const double dx = end.x - start.x;
  const double dy = end.y - start.y;
  const double d = std::sqrt(dx * dx + dy * dy) / radius;
  const double phi = std::atan2(dy, dx);
  const double a = forward_turn(start.theta - phi);
  const double b = forward_turn(end.theta - phi);
  const double sa = std::sin(a);
  const double ca = std::cos(a);
  const double sb = std::sin(b);
  const double cb = std::cos(b);
  const double cab = std::cos(a - b);

  std::array<Word, 6> words;
  if (const double square = 2.0 + d * d - 2.0 * cab + 2.0 * d * (sa - sb); square > kLeastSquare) {
    const double heading = std::atan2(cb - ca, d + sa - sb);
    words[0] = {forward_turn(heading - a), std::sqrt(std::max(square, 0.0)),
                forward_turn(b - heading)};
  }
  if (const double square = 2.0 + d * d - 2.0 * cab + 2.0 * d * (sb - sa); square > kLeastSquare) {
    const double heading = std::atan2(ca - cb, d - sa + sb);
    words[1] = {forward_turn(a - heading), std::sqrt(std::max(square, 0.0)),
                forward_turn(heading - b)};
  }
  if (const double square = d * d - 2.0 + 2.0 * cab + 2.0 * d * (sa + sb); square > kLeastSquare) {
    const double middle = std::sqrt(std::max(square, 0.0));
    const double heading = std::atan2(-ca - cb, d + sa + sb) - std::atan2(-2.0, middle);
    words[2] = {forward_turn(heading - a), middle, forward_turn(heading - b)};
  }
  if (const double square = d * d - 2.0 + 2.0 * cab - 2.0 * d * (sa + sb); square > kLeastSquare) {
    const double middle = std::sqrt(std::max(square, 0.0));
    const double heading = std::atan2(ca + cb, d - sa - sb) - std::atan2(2.0, middle);
    words[3] = {forward_turn(a - heading), middle, forward_turn(b - heading)};
  }
  if (const double cosine = (6.0 - d * d + 2.0 * cab + 2.0 * d * (sa - sb)) / 8.0;
      std::abs(cosine) <= 1.0) {
    const double middle = forward_turn(kTurn - std::acos(cosine));
    const double first = forward_turn(a - std::atan2(ca - cb, d - sa + sb) + 0.5 * middle);
    words[4] = {first, middle, forward_turn(a - b - first + middle)};
  }
  if (const double cosine = (6.0 - d * d + 2.0 * cab + -2.0 * d * (sa - sb)) / 8.0;
      std::abs(cosine) <= 1.0) {
    const double middle = forward_turn(kTurn - std::acos(cosine));
    const double first = forward_turn(-a + std::atan2(cb - ca, d + sa - sb) + 0.5 * middle);
    words[5] = {first, middle, forward_turn(b - a - first + middle)};
  }

  double best = kInfinity;
  DubinsPath path;
  const double left = 1.0 / radius;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const Word& word = words[i];
    if (word.first < 0.0 || word.middle < 0.0 || word.last < 0.0 || word.length() >= best) continue;
    best = word.length();
    const Sides& sides = kSides[i];
    path.arcs = {{{word.first * radius, sides.first * left},
                  {word.middle * radius, sides.middle * left},
                  {word.last * radius, sides.last * left}}};
  }
  path.length = best * radius;
  return path;
}

Index sample_arcs(const Pose& start, std::span<const Arc> arcs, double spacing,
                  const PathBuffer& out) {
  Index count = 0;
  Pose here = start;
  for (const Arc& arc : arcs) {
    if (std::abs(arc.length) < 1e-8 * spacing) continue;
    const auto steps =
        static_cast<Index>(std::ceil(std::abs(arc.length) / step_along(arc.curvature, spacing)));
    if (steps < 1 || steps > out.size() - count) return -1;  // less than 1: NaN, or beyond an Index
    for (Index step = 1; step <= steps; ++step) {
      const double length = arc.length * static_cast<double>(step) / static_cast<double>(steps);
      out.poses[static_cast<std::size_t>(count)] = along_arc(here, {length, arc.curvature});
      out.curvatures[static_cast<std::size_t>(count)] = arc.curvature;
      ++count;
    }
    here = out.poses[static_cast<std::size_t>(count - 1)];
  }
  return count;
}

}  // namespace pushplan
