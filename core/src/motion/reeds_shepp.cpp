#include "pushplan/motion/reeds_shepp.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pushplan/arithmetic.hpp"

namespace pushplan {
namespace {

constexpr double kQuarter = 0.5 * std::numbers::pi;

/// Miss at the goal up to which a word leads there [turning radii, rad].
constexpr double kMiss = 1e-7;

/// Squares and cosines are allowed this much beyond their range, for rounding.
constexpr double kRounding = 1e-12;

constexpr double kLeft = 1.0;
constexpr double kRight = -1.0;
constexpr double kStraight = 0.0;

/// Finds the shortest word from the origin to a pose; lengths are in units of the turning radius.
///
/// The paper's formulas (8.1) to (8.11) give one word of each kind; changing the direction of
/// travel, left and right, and the order of the pieces gives the others. Which signs of lengths
/// make a word an optimal one does not matter here: any word that leads to the goal is a path, and
/// the shortest is kept.
class WordSearch {
 public:
  explicit WordSearch(const Pose& goal) : goal_(goal) {}

  void run() {
    for (const double travel : {1.0, -1.0}) {
      for (const double side : {1.0, -1.0}) {
        travel_ = travel;
        side_ = side;
        const double x = travel * goal_.x;
        const double y = side * goal_.y;
        const double phi = travel * side * goal_.theta;
        const double cosine = std::cos(phi);
        const double sine = std::sin(phi);
        reversed_ = false;
        try_symmetric(x, y, phi, sine, cosine);
        try_one_sided(x, y, phi, sine, cosine);
        reversed_ = true;
        try_one_sided(x * cosine + y * sine, x * sine - y * cosine, phi, sine, cosine);
      }
    }
  }

  const std::array<Arc, 5>& best() const { return best_; }
  double length() const { return length_; }

 private:
  /// Words that read the same from behind: CSC, CCu|CuC, C|CuCu|C and C|CSC|C.
  void try_symmetric(double x, double y, double phi, double sine, double cosine) {
    const double same_x = x - sine;
    const double same_y = y - 1.0 + cosine;
    const double same = std::sqrt(same_x * same_x + same_y * same_y);
    const double bearing = std::atan2(same_y, same_x);
    keep({{{bearing, kLeft}, {same, kStraight}, {phi - bearing, kLeft}}});  // (8.1)
    const double other_x = x + sine;
    const double other_y = y - 1.0 - cosine;
    const double square = other_x * other_x + other_y * other_y;
    if (square >= 4.0 - kRounding) {
      const double middle = std::sqrt(std::max(square - 4.0, 0.0));
      const double first = std::atan2(other_y, other_x) + std::atan2(2.0, middle);
      keep({{{first, kLeft}, {middle, kStraight}, {first - phi, kRight}}});  // (8.2)
      const double turn =
          std::atan2(middle * other_x - 2.0 * other_y, -2.0 * other_x - middle * other_y);
      keep({{{turn, kLeft},
             {-kQuarter, kRight},
             {4.0 - middle, kStraight},
             {-kQuarter, kLeft},
             {turn - phi, kRight}}});  // (8.11)
    }
    const double apart = 0.25 * (2.0 + std::sqrt(square));
    if (apart <= 1.0) {
      const double middle = std::acos(apart);
      const auto [first, last] = outer_turns(middle, -middle, other_x, other_y, phi);
      keep({{{first, kLeft}, {middle, kRight}, {-middle, kLeft}, {last, kRight}}});  // (8.7)
    }
    const double near = (20.0 - square) / 16.0;
    if (near >= 0.0 && near <= 1.0 + kRounding) {
      const double middle = -std::acos(std::min(near, 1.0));
      const auto [first, last] = outer_turns(middle, middle, other_x, other_y, phi);
      keep({{{first, kLeft}, {middle, kRight}, {middle, kLeft}, {last, kRight}}});  // (8.8)
    }
  }

  /// Words that read otherwise from behind: C|C|C, C|CC and C|CSC.
  void try_one_sided(double x, double y, double phi, double sine, double cosine) {
    const double same_x = x - sine;
    const double same_y = y - 1.0 + cosine;
    const double same = std::sqrt(same_x * same_x + same_y * same_y);
    const double bearing = std::atan2(same_y, same_x);
    if (same <= 4.0) {
      const double half = std::acos(0.25 * same);
      const double first = bearing + kQuarter + half;
      const double middle = 2.0 * half - std::numbers::pi;
      keep({{{first, kLeft}, {middle, kRight}, {phi - first + middle, kLeft}}});  // (8.3), (8.4)
    }
    if (same >= 2.0) {
      const double along = std::sqrt(same * same - 4.0);
      const double first = bearing + std::atan2(along, -2.0);
      keep({{{first, kLeft},
             {-kQuarter, kRight},
             {2.0 - along, kStraight},
             {phi - kQuarter - first, kLeft}}});  // (8.9)
    }
    const double other_x = x + sine;
    const double other_y = y - 1.0 - cosine;
    const double other = std::sqrt(other_x * other_x + other_y * other_y);
    if (other >= 2.0) {
      const double first = std::atan2(other_x, -other_y);
      keep({{{first, kLeft},
             {-kQuarter, kRight},
             {2.0 - other, kStraight},
             {first + kQuarter - phi, kRight}}});  // (8.10)
    }
  }

  struct OuterTurns {
    double first;
    double last;
  };

  /// First and last turn of a word of four, (8.6), whose middle ones are `u` and `v`.
  static OuterTurns outer_turns(double u, double v, double x, double y, double phi) {
    const double difference = u - v;
    const double a = std::sin(u) - std::sin(difference);
    const double b = std::cos(u) - std::cos(difference) - 1.0;
    const double turn = std::atan2(y * a - x * b, x * a + y * b);
    const double side = 2.0 * (std::cos(difference) - std::cos(v) - std::cos(u)) + 3.0;
    const double first = side < 0.0 ? turn + std::numbers::pi : turn;
    return {first, first - u + v - phi};
  }

  /// Keeps a word if it is shorter than the best and leads to the goal.
  void keep(std::array<Arc, 5> word) {
    double length = 0.0;
    for (Arc& piece : word) {
      if (piece.curvature != 0.0) piece.length = wrap_below_pi(piece.length);
      length += std::abs(piece.length);
    }
    if (!(length < length_)) return;
    if (reversed_) std::reverse(word.begin(), word.end());
    Pose here{0.0, 0.0, 0.0};
    for (Arc& piece : word) {
      piece.length *= travel_;
      piece.curvature *= side_;
      if (piece.length != 0.0) here = along_arc(here, piece);
    }
    const double miss = std::max({std::abs(here.x - goal_.x), std::abs(here.y - goal_.y),
                                  std::abs(wrap_below_pi(here.theta - goal_.theta))});
    if (miss > kMiss * std::max(1.0, length)) return;
    length_ = length;
    best_ = word;
  }

  Pose goal_;  // as seen from the start
  double travel_ = 1.0;
  double side_ = 1.0;
  bool reversed_ = false;
  std::array<Arc, 5> best_{};
  double length_ = kInfinity;
};

}  // namespace

ShortestCurve reeds_shepp(const Pose& start, const Pose& end, double radius) {
  const double dx = (end.x - start.x) / radius;
  const double dy = (end.y - start.y) / radius;
  const double cosine = std::cos(start.theta);
  const double sine = std::sin(start.theta);
  WordSearch search(
      {dx * cosine + dy * sine, dy * cosine - dx * sine, wrap_below_pi(end.theta - start.theta)});
  search.run();
  ShortestCurve curve{search.best(), radius * search.length()};
  for (Arc& arc : curve.arcs) {
    arc.length *= radius;
    arc.curvature /= radius;
  }
  return curve;
}

ShortestCurve shortest_curve(const Pose& start, const Pose& end, double radius, bool reverses) {
  if (reverses) return reeds_shepp(start, end, radius);
  const DubinsPath path = dubins(start, end, radius);
  return {{path.arcs[0], path.arcs[1], path.arcs[2]}, path.length};
}

}  // namespace pushplan
