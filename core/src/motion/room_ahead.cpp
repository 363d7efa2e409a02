#include "pushplan/motion/room_ahead.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "pushplan/arithmetic.hpp"
#include "pushplan/motion/recovery.hpp"

namespace pushplan {
namespace {

constexpr double kBox = 0.6;         // sides of the boxes of poses [steps]
constexpr double kLeastTurn = 0.02;  // the same of headings at least [rad]
constexpr double kReach = 3.0;       // distance at which a robot has got away [R]
constexpr double kFar = 12.0;        // the same where it looks for a place to turn about [R]
constexpr double kSpacious = 1.3;    // clearance to turn about with at best: curves lead on from
                                     // there [radii of the footprint]
constexpr double kFiner = 0.25;      // steps of the second look, before a robot is boxed in
constexpr Index kMostPosesAhead = 5'000;  // then it counts as getting away
constexpr Index kMostPoses = 60'000;      // where it may do all that it can
constexpr Index kPiece = 250;             // poses: about half a millisecond

/// All moves of a robot; steps are in circumscribed radii, or turns [rad].
std::vector<Arc> moves_of(const ExtraMoves& extra, double step, double size, double radius) {
  std::vector<Arc> moves;
  if (extra.turns_on_spot) moves = {{step, -kInfinity}, {step, kInfinity}};
  for (const double way : {-1.0, 1.0}) {
    if (way < 0.0 && !extra.reverses) continue;
    for (const double side : {-1.0, 1.0, 0.0}) moves.push_back({way * step * size, side / radius});
  }
  return moves;
}

}  // namespace

RoomExploration::RoomExploration(const Room& room, std::vector<RoomRules> rules, const Pose& start)
    : room_(room),
      tries_(std::move(rules)),
      done_(tries_.empty()),
      start_(start),
      checker_(room.footprint, room.walls) {
  if (!done_) begin();
}

/// Begins a try at the start.
void RoomExploration::begin() {
  boxes_.side = kBox * rules().moves.back().length;
  double least = kInfinity;
  for (const Arc& move : rules().moves) {
    if (move.curvature == 0.0) continue;
    const double turn = std::isinf(move.curvature) ? 1.0 : std::abs(move.curvature);
    least = std::min(least, std::abs(move.length) * turn);
  }
  boxes_.turn = std::clamp(kBox * least, kLeastTurn, std::numbers::pi);
  boxes_.half = static_cast<Index>(rules().reach / boxes_.side) + 2;
  boxes_.headings = ceil_index(kTurn / boxes_.turn);
  seen_ = ZeroedArray<bool>(boxes_.width() * boxes_.width() * boxes_.headings);
  nodes_ = {{start_, kNowhere, kNowhere}};
  open_ = {0};
  taken_ = 0;
  looked_at_ = 0;
}

/// Takes the node to go on from.
Index RoomExploration::take() {
  if (rules().breadth) return open_[taken_++];
  const Index last = open_.back();
  open_.pop_back();
  return last;
}

/// Drives a move to its end. False if that is not free, or in a breadth-first search any of the
/// poses that a plan over it will have, as that path may be driven.
bool RoomExploration::drive(const Pose& from, const Arc& move, Pose& end) {
  Index steps = 1;
  if (rules().breadth) {
    steps = ceil_index(std::abs(move.length) / step_along(move.curvature, room_.spacing));
  }
  for (Index step = 1; step <= steps; ++step) {
    const double length = move.length * static_cast<double>(step) / static_cast<double>(steps);
    end = along_arc(from, {length, move.curvature});
    if (!checker_.is_free(end)) return false;
  }
  return true;
}

/// The number of the box of a pose, `kNowhere` beyond the last ones.
Index RoomExploration::box_of(const Pose& pose) const {
  const Index column =
      boxes_.half + static_cast<Index>(std::rint((pose.x - start_.x) / boxes_.side));
  const Index row = boxes_.half + static_cast<Index>(std::rint((pose.y - start_.y) / boxes_.side));
  const Index width = boxes_.width();
  if (column < 0 || column >= width || row < 0 || row >= width) return kNowhere;
  const Index heading =
      floor_mod(floor_index(floor_mod(pose.theta, kTurn) / boxes_.turn), boxes_.headings);
  return (row * width + column) * boxes_.headings + heading;
}

bool RoomExploration::is_away(const Pose& pose) const {
  const double dx = pose.x - start_.x;
  const double dy = pose.y - start_.y;
  if (dx * dx + dy * dy > rules().reach * rules().reach) return true;
  if (rules().clearance > 0.0 && can_turn({pose.x, pose.y}, rules().clearance, room_.walls)) {
    return true;
  }
  return room_.goal.contains({pose.x, pose.y});
}

/// Goes on until the robot is away or so many poses are looked at in all.
void RoomExploration::look_at_poses(Index upto) {
  while (!exhausted() && looked_at_ < upto) {
    ++looked_at_;
    const Index at = take();
    const Pose here = nodes_[static_cast<std::size_t>(at)].pose;
    for (std::size_t m = 0; m < rules().moves.size(); ++m) {
      Pose pose;
      if (!drive(here, rules().moves[m], pose)) continue;
      const Index box = box_of(pose);
      if (box == kNowhere || seen_[box]) continue;
      seen_[box] = true;
      const auto found = static_cast<Index>(nodes_.size());
      nodes_.push_back({pose, at, static_cast<Index>(m)});
      if (is_away(pose)) {
        away_ = found;
        return;
      }
      open_.push_back(found);
    }
  }
}

bool RoomExploration::run() {
  if (done_) return true;
  look_at_poses(std::min(looked_at_ + kPiece, rules().most));
  if (!away() && !exhausted() && looked_at_ < rules().most) return false;
  // too many poses count as getting away, but are no place to turn about
  const bool answered = away() || (!exhausted() && rules().clearance == 0.0);
  done_ = answered || try_ + 1 == tries_.size();
  if (done_) return true;
  ++try_;
  begin();
  return false;
}

std::vector<Arc> RoomExploration::arcs() const {
  std::vector<Arc> arcs;
  for (Index at = away_; at > 0; at = nodes_[static_cast<std::size_t>(at)].before) {
    arcs.push_back(
        rules().moves[static_cast<std::size_t>(nodes_[static_cast<std::size_t>(at)].move)]);
  }
  std::reverse(arcs.begin(), arcs.end());
  return arcs;
}

RoomExploration explore_ahead(const Room& room, const Pose& start, double size, double radius) {
  std::vector<Arc> moves = moves_of({}, kRecoveryStep, size, radius);
  return {room, {{std::move(moves), kReach * size, 0.0, false, kMostPosesAhead}}, start};
}

RoomExploration explore_around(const ExtraMoves& extra, const Room& room, const Pose& start,
                               double size, double radius) {
  std::vector<RoomRules> tries;
  for (const double step : {kRecoveryStep, kFiner * kRecoveryStep}) {
    std::vector<Arc> moves = moves_of(extra, step, size, radius);
    tries.push_back({std::move(moves), kReach * size, 0.0, false, kMostPoses});
  }
  return {room, std::move(tries), start};
}

RoomExploration explore_to_turn(const ExtraMoves& extra, const Room& room, const Pose& start,
                                double size) {
  const double swept = room.footprint.radius;
  std::vector<RoomRules> tries;
  if (!can_turn({start.x, start.y}, swept, room.walls)) {
    const std::vector<Arc> moves = moves_of(extra, kRecoveryStep, size, size);
    tries = {{moves, kFar * size, kSpacious * swept, true, kMostPosesAhead},
             {moves, kFar * size, swept, true, kMostPoses}};
  }
  return {room, std::move(tries), start};
}

}  // namespace pushplan
