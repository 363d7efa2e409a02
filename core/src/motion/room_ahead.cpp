#include "pushplan/motion/room_ahead.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pushplan/arithmetic.hpp"
#include "pushplan/motion/recovery.hpp"

namespace pushplan {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

Index width_of(const PoseBoxes& boxes) { return 2 * boxes.half + 1; }

}  // namespace

RoomExploration::RoomExploration(const Room& room, const RoomRules& rules, const Pose& start,
                                 const PoseBoxes& boxes, Index capacity)
    : room_(room),
      rules_(rules),
      boxes_(boxes),
      checker_(room.footprint, room.walls),
      nodes_{{start, kNowhere, kNowhere}},
      open_{0},
      capacity_(static_cast<std::size_t>(capacity)),
      seen_(width_of(boxes) * width_of(boxes) * boxes.headings) {}

/// Takes the node to go on from.
Index RoomExploration::take() {
  if (rules_.breadth) return open_[taken_++];
  const Index last = open_.back();
  open_.pop_back();
  return last;
}

/// Drives a move to its end. False if that is not free, or in a breadth-first search any of the
/// poses that a plan over it will have, as that path may be driven.
bool RoomExploration::drive(const Pose& from, const Arc& move, Pose& end) {
  Index steps = 1;
  if (rules_.breadth) {
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
  const Pose& start = nodes_.front().pose;
  const Index column =
      boxes_.half + static_cast<Index>(std::rint((pose.x - start.x) / boxes_.side));
  const Index row = boxes_.half + static_cast<Index>(std::rint((pose.y - start.y) / boxes_.side));
  const Index width = width_of(boxes_);
  if (column < 0 || column >= width || row < 0 || row >= width) return kNowhere;
  const Index heading =
      floor_mod(floor_index(floor_mod(pose.theta, kTurn) / boxes_.turn), boxes_.headings);
  return (row * width + column) * boxes_.headings + heading;
}

bool RoomExploration::is_away(const Pose& pose) const {
  const double dx = pose.x - nodes_.front().pose.x;
  const double dy = pose.y - nodes_.front().pose.y;
  if (dx * dx + dy * dy > rules_.reach * rules_.reach) return true;
  if (rules_.clearance > 0.0 && can_turn({pose.x, pose.y}, rules_.clearance, room_.walls)) {
    return true;
  }
  return room_.goal.contains({pose.x, pose.y});
}

RoomExploration::Outcome RoomExploration::run(Index upto) {
  while (taken_ < open_.size() && looked_at_ < upto) {
    ++looked_at_;
    const Index at = take();
    const Pose here = nodes_[static_cast<std::size_t>(at)].pose;
    for (std::size_t m = 0; m < rules_.moves.size(); ++m) {
      Pose pose;
      if (!drive(here, rules_.moves[m], pose)) continue;
      const Index box = box_of(pose);
      if (nodes_.size() == capacity_ || box == kNowhere || seen_[box]) continue;
      seen_[box] = true;
      const auto found = static_cast<Index>(nodes_.size());
      nodes_.push_back({pose, at, static_cast<Index>(m)});
      if (is_away(pose)) {
        away_ = found;
        return Outcome::kAway;
      }
      open_.push_back(found);
    }
  }
  return taken_ < open_.size() ? Outcome::kPaused : Outcome::kClosed;
}

std::vector<Arc> RoomExploration::arcs() const {
  std::vector<Arc> arcs;
  for (Index at = away_; at > 0; at = nodes_[static_cast<std::size_t>(at)].before) {
    arcs.push_back(
        rules_.moves[static_cast<std::size_t>(nodes_[static_cast<std::size_t>(at)].move)]);
  }
  std::reverse(arcs.begin(), arcs.end());
  return arcs;
}

}  // namespace pushplan
