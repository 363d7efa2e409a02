#include "pushplan/planners/rearrangement/route.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pushplan/geometry/convex.hpp"

namespace pushplan::rearrangement {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kSureTurn = 170.0 * (kPi / 180.0);  // up to here a turn is made the shorter way if
                                                     // nothing is said [rad]
constexpr double kLittleTurn = 0.6;  // a turn by less is not made the longer way [rad]
constexpr double kTightCost = 25.0;  // of driving on where the robot begins nearer to something
                                     // static than it should be
constexpr double kRounding = 1.0 + 1e-12;  // on limits, so that sums in another order stay below

}  // namespace

RouteSearch::RouteSearch(const RouteCosts& costs, const Footprint& shape, const Footprint& tight,
                         const ConvexObstacles& obstacles, const RouteObjects& objects)
    : costs_(costs),
      shape_(shape),
      walls_(tight, obstacles),
      objects_(objects),
      outlines_(objects.outlines.vertices.size()),
      corners_(shape.parts.vertices.size()) {
  transform(objects.poses, objects.outlines, outlines_.data());
}

RouteSearch::Overlap RouteSearch::overlap(const Pose& pose) {
  const Polygons outlines{outlines_, objects_.outlines.offsets};
  const Polygons parts{corners_, shape_.parts.offsets};
  Overlap all{0.0, 0.0};
  bool placed = false;
  for (std::size_t k = 0; k < objects_.poses.size(); ++k) {
    const double dx = objects_.poses[k].x - pose.x;
    const double dy = objects_.poses[k].y - pose.y;
    const double reach = shape_.radius + objects_.radii[k];
    if (objects_.weights[k] == 0.0 || dx * dx + dy * dy >= reach * reach) continue;
    if (!placed) {
      transform(pose, shape_.parts.vertices, corners_.data());
      placed = true;
    }
    double deepest = 0.0;
    for (Index part = 0; part < parts.count(); ++part) {
      deepest =
          std::max(deepest, convex_penetration(parts[part], outlines[static_cast<Index>(k)]).depth);
    }
    if (deepest > 0.0) {
      all.depth += deepest;
      all.touch += objects_.weights[k];
    }
  }
  return all;
}

/// Cost of a straight motion between two poses, or of a turn on the spot; infinite at a wall, and
/// where `spent` and the cost so far reach the limit.
double RouteSearch::motion(const Pose& here, const Pose& there, double turn, Limit limit) {
  const double length = std::hypot(there.x - here.x, there.y - here.y);
  const double angle = std::abs(turn);
  const Index steps = std::max<Index>(
      1, static_cast<Index>(std::ceil((length + angle * shape_.radius) / costs_.step)));
  const double parts = static_cast<double>(steps);
  double depth = overlap(here).depth;
  double inside = walls_.depth(here);
  const double carried = (length + costs_.arm * angle) / parts;
  double cost = length + costs_.turn_cost * angle;
  for (Index n = 1; n <= steps; ++n) {
    if (limit.spent + cost >= limit.most) return kInfinity;
    const double part = static_cast<double>(n) / parts;
    const Pose pose{here.x + part * (there.x - here.x), here.y + part * (there.y - here.y),
                    here.theta + part * turn};
    if (inside > 0.0) {  // out of it, but no deeper into it
      const double before = inside;
      inside = walls_.depth(pose);
      if (inside > before) return kInfinity;
      cost += kTightCost * (length + shape_.radius * angle) / parts;
    } else if (!walls_.is_free(pose)) {
      return kInfinity;
    }
    const Overlap now = overlap(pose);
    if (now.touch > 0.0 && now.depth >= depth) cost += carried * now.touch;
    depth = now.depth;
  }
  return cost;
}

/// Cost of a turn on the spot from one heading to another, and how to make it.
RouteSearch::Turn RouteSearch::turn(Vec2 at, double heading, double to, Limit limit) {
  const Pose here{at.x, at.y, heading};
  const Pose there{at.x, at.y, to};
  double turn = wrap_angle(to - heading);
  const double other = turn - std::copysign(2.0 * kPi, turn);
  double cost = motion(here, there, turn, limit);
  if (std::abs(turn) > kLittleTurn && costs_.turn_cost * std::abs(other) < cost) {
    const double longer = motion(here, there, other, limit);
    if (longer < cost) {
      cost = longer;
      turn = other;
    }
  }
  return {cost, std::abs(turn) > kSureTurn ? std::copysign(1.0, turn) : 0.0};
}

/// Cost of turning to a point and driving there: ahead with sign 1, back with -1.
RouteSearch::Leg RouteSearch::leg(Vec2 from, double heading, Vec2 to, double sign, Limit limit) {
  const double dx = to.x - from.x;
  const double dy = to.y - from.y;
  if (std::hypot(dx, dy) < 1e-9) return {0.0, heading, 0.0};
  const double ahead = std::atan2(sign * dy, sign * dx);
  auto [cost, side] = turn(from, heading, ahead, limit);
  if (cost < kInfinity) {
    cost += motion({from.x, from.y, ahead}, {to.x, to.y, ahead}, 0.0,
                   {limit.spent + cost, limit.most});
  }
  return {cost, ahead, side};
}

Legs RouteSearch::cheapest_legs(std::span<const Vec2> points, double heading, double end,
                                Index first, Index longest) {
  const Index count = static_cast<Index>(points.size());
  std::vector<double> best(at(2 * count), kInfinity);
  std::vector<double> headings(at(2 * count), heading);
  Legs legs{{},
            std::vector<Index>(at(2 * count), -1),
            std::vector<Legs::Turns>(at(2 * count), {0.0, 0.0})};
  best[0] = 0.0;
  for (Index to = 2; to < 2 * count; ++to) {
    const Index j = to / 2;
    const double sign = to % 2 == 0 ? 1.0 : -1.0;
    const Vec2 target = points[at(j)];
    for (Index from = 0; from < 2 * j; ++from) {
      const Index i = from / 2;
      if (i >= first && i < j - longest) continue;
      const Vec2 start = points[at(i)];
      const double straight = std::hypot(start.x - target.x, start.y - target.y);
      if (best[at(from)] + straight >= best[at(to)]) continue;
      const Limit limit{best[at(from)], kRounding * best[at(to)]};
      const Leg found = leg(start, headings[at(from)], target, sign, limit);
      double cost = best[at(from)] + found.cost;
      double last = 0.0;
      if (j == count - 1 && cost < best[at(to)]) {
        const Turn more = turn(target, found.heading, end, {cost, kRounding * best[at(to)]});
        last = more.side;
        cost += more.cost;
      }
      if (cost < best[at(to)]) {
        best[at(to)] = cost;
        legs.before[at(to)] = from;
        headings[at(to)] = found.heading;
        legs.turns[at(to)] = {found.side, last};
      }
    }
  }
  legs.costs = {best[best.size() - 2], best[best.size() - 1]};
  return legs;
}

}  // namespace pushplan::rearrangement
