#include "pushplan/motion/shortcutting.hpp"

#include <cmath>
#include <limits>

#include "pushplan/motion/reeds_shepp.hpp"
#include "pushplan/motion/shortcut.hpp"

namespace pushplan {
namespace {

constexpr double kToEnd = 0.2;      // share of candidates with another end,
constexpr double kThrough = 0.65;   // and of these with those that lead through another pose
constexpr double kInside = 0.999;   // distance of an end from the centre of a goal [radii]
constexpr double kMostShift = 0.5;  // greatest change of an end's heading for the turn to it [rad]

double sign(double x) { return x > 0.0 ? 1.0 : (x < 0.0 ? -1.0 : 0.0); }

/// A pose in the goal near `last` that a robot at `from` would drive straight into.
Pose new_end(const Pose& from, const Pose& last, const ShortcutShift& shift,
             const PathProblem& problem) {
  const GoalRegion& goal = problem.goal;
  Pose end;
  if (goal.kind == GoalRegion::Kind::kDisc) {
    const double angle =
        std::atan2(last.y - goal.point.y, last.x - goal.point.x) + 0.6 * shift.sideways;
    end.x = goal.point.x + kInside * goal.radius * std::cos(angle);
    end.y = goal.point.y + kInside * goal.radius * std::sin(angle);
  } else {
    double behind =
        (last.x - goal.point.x) * goal.normal.x + (last.y - goal.point.y) * goal.normal.y;
    behind -= 1e-5 * problem.spacing;
    const double aside = problem.displacement * shift.sideways;
    end.x = last.x - behind * goal.normal.x - aside * goal.normal.y;
    end.y = last.y - behind * goal.normal.y + aside * goal.normal.x;
  }
  if (problem.connection == Connection::kStraight) {
    end.theta = last.theta;
    return end;
  }
  // heading at the end of the turn-then-straight path: nearly the bearing from here
  end.theta = std::atan2(end.y - from.y, end.x - from.x) + 0.1 * shift.turn;
  const double turn = wrap_below_pi(end.theta - from.theta);
  const double dx = end.x - from.x;
  const double dy = end.y - from.y;
  const double gap = std::sqrt(dx * dx + dy * dy);
  // a turn before the straight shifts the bearing by about r (1 - cos turn) / gap
  const double shifted =
      problem.turning_radius * (1.0 - std::cos(turn)) / std::max(gap, problem.turning_radius);
  end.theta += sign(turn) * std::min(shifted, kMostShift);
  return end;
}

/// Lays the shortest motion between two poses, without the start. Returns the number of poses, -1
/// where it does not fit.
Index connect(const Pose& start, const Pose& end, const PathProblem& problem,
              const PathBuffer& out) {
  if (problem.connection == Connection::kStraight) {
    return lay_straight(start, end, problem.spacing, out);
  }
  const bool reverses = problem.connection == Connection::kReedsShepp;
  const ShortestCurve way = shortest_curve(start, end, problem.turning_radius, reverses);
  return sample_arcs(start, way.arcs, problem.spacing, out);
}

/// First and last pose of the piece to replace: short pieces as often as long ones.
struct Piece {
  Index first;
  Index last;
};

Piece pick_piece(Index count, const ShortcutDraw& draw) {
  const auto span =
      static_cast<Index>(2.0 + static_cast<double>(count - 2) * draw.span * draw.span);
  const auto first = static_cast<Index>(draw.place * static_cast<double>(count - span));
  return {first, std::min(first + span, count - 1)};
}

}  // namespace

ShortcutProposal propose_shortcut(const SweptPath& path, const ShortcutDraw& draw,
                                  const ShortcutShift& shift, const PathProblem& problem,
                                  SweptPath& trial) {
  const Index count = path.count;
  const bool to_end = draw.kind < kToEnd;
  auto [first, last] = pick_piece(count, draw);
  if (to_end) last = count - 1;
  const ShortcutProposal none{first, 0, 0};
  Pose target = path.poses[at(last)];
  const GoalRegion& goal = problem.goal;
  const bool to_place = to_end && (goal.turns || !goal.has_heading());
  if (to_place) {
    target = new_end(path.poses[at(first)], path.poses[at(count - 1)], shift, problem);
  }
  const Path old{path.used(), std::span(path.curvatures).first(at(count))};
  const PathBuffer out = trial.buffer();
  Index size = copy_start(old, first, out);
  const auto drive_to = [&](const Pose& stop) {
    const Pose here = out.poses[at(size - 1)];
    const Index added = connect(here, stop, problem, out.from(size));
    if (added >= 0) size += added;
    return added >= 0;
  };
  if (!to_end && draw.kind < kThrough && last - first > 3) {
    // displacements of all sizes, from fine adjustments to another side of a box
    const double scale = std::pow(10.0, -1.5 * draw.scale);
    const double sideways = problem.displacement * shift.sideways * scale;
    const double turn = 0.3 * shift.turn * scale;
    if (!drive_to(displace(path.poses[at((first + last) / 2)], sideways, turn))) return none;
  }
  if (!drive_to(target)) return none;
  const Pose arrived = out.poses[at(size - 1)];
  const double miss = std::abs(arrived.x - target.x) + std::abs(arrived.y - target.y);
  if (miss > 1e-3 * problem.spacing) return none;
  if (to_place && !goal.contains({arrived.x, arrived.y})) return none;
  if (to_end && goal.turns) {
    const double angle = wrap_below_pi(goal.heading - arrived.theta);
    const Arc turn{std::abs(angle), std::copysign(std::numeric_limits<double>::infinity(), angle)};
    const Index turned = sample_arcs(arrived, {&turn, 1}, problem.spacing, out.from(size));
    if (turned < 0) return none;
    size += turned;
  }
  const Index added = size - first - 1;
  const Index rest = count - 1 - last;
  if (to_end || rest == 0) return {first, added, size};
  if (size + rest > out.size()) return none;
  return {first, added, copy_rest(old, last, out, size)};
}

}  // namespace pushplan
