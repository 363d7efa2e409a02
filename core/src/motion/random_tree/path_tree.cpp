#include "pushplan/motion/random_tree/path_tree.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pushplan {
namespace {

constexpr double kHeadingSpread = 0.4;  // standard deviation about the coarse path [rad]
constexpr std::size_t kAround = 3;      // points ahead and behind that a heading is taken from

}  // namespace

PathTree::PathTree(const Pose& root, const GoalRegion& goal, const TreeLimits& limits,
                   double backward, const Footprint& footprint, const ConvexObstacles& among)
    : goal_(goal), limits_(limits), steering_(limits, footprint, among) {
  add({root, {0.0, 0.0}, 0, backward});
}

void PathTree::add(const Node& node) {
  const double side = limits_.edge_length;
  const Index column = floor_index(node.pose.x / side);
  const Index row = floor_index(node.pose.y / side);
  const auto [found, is_new] = cell_numbers_.try_emplace({column, row}, cells_.size());
  if (is_new) {
    const Vec2 centre{side * (static_cast<double>(column) + 0.5),
                      side * (static_cast<double>(row) + 0.5)};
    cells_.push_back({centre, {}});
  }
  cells_[found->second].nodes.emplace_back(node.pose, count());
  nodes_.push_back(node);
}

/// The node nearest to a target: first in the nearest cell, then in those that may hold a nearer
/// one.
Index PathTree::nearest(const Pose& target) {
  const double half = 0.5 * limits_.edge_length;
  for (Cell& cell : cells_) {
    const double dx = std::max(std::abs(target.x - cell.centre.x) - half, 0.0);
    const double dy = std::max(std::abs(target.y - cell.centre.y) - half, 0.0);
    cell.gap_squared = dx * dx + dy * dy;
  }
  double least = kInfinity;
  Index nearest = 0;
  const auto look_into = [&](const Cell& cell) {
    for (const auto& [pose, node] : cell.nodes) {
      const double dx = pose.x - target.x;
      const double dy = pose.y - target.y;
      const double gap = std::sqrt(dx * dx + dy * dy);
      if (gap >= least) continue;
      const double turn = std::abs(wrap_angle(pose.theta - target.theta));
      const double distance = gap + limits_.turn_weight * turn;
      if (distance < least) {
        least = distance;
        nearest = node;
      }
    }
  };
  look_into(*std::ranges::min_element(cells_, {}, &Cell::gap_squared));
  for (const Cell& cell : cells_) {
    if (cell.gap_squared < least * least) look_into(cell);
  }
  return nearest;
}

bool PathTree::grow(const Pose& target, double sampled) {
  const Index from = nearest(target);
  const Node& parent = nodes_[static_cast<std::size_t>(from)];
  const SteeredArc found = steering_.steer(parent.pose, target, sampled, parent.backward);
  if (found.arc.length == 0.0) return false;
  add({found.end, found.arc, from, parent.backward + std::min(found.arc.length, 0.0)});
  return goal_.distance({found.end.x, found.end.y}) == 0.0;
}

std::vector<Arc> PathTree::arcs() const {
  std::vector<Arc> arcs;
  for (Index at = count() - 1; at > 0; at = nodes_[static_cast<std::size_t>(at)].parent) {
    arcs.push_back(nodes_[static_cast<std::size_t>(at)].arc);
  }
  std::reverse(arcs.begin(), arcs.end());
  return arcs;
}

Pose TreeTargets::draw() {
  if (random_.uniform() >= fraction_) {
    return {bounds_.x_min + random_.uniform() * (bounds_.x_max - bounds_.x_min),
            bounds_.y_min + random_.uniform() * (bounds_.y_max - bounds_.y_min),
            std::numbers::pi * (2.0 * random_.uniform() - 1.0)};
  }
  const std::size_t last = coarse_path_.size() - 1;
  const auto i = static_cast<std::size_t>(random_.below(static_cast<Index>(coarse_path_.size())));
  const Vec2 at = coarse_path_[i];
  const Vec2 behind = coarse_path_[i - std::min(i, kAround)];
  const Vec2 ahead = coarse_path_[std::min(i + kAround, last)];
  const double heading = std::atan2(ahead.y - behind.y, ahead.x - behind.x);
  return {at.x + spread_ * random_.normal(), at.y + spread_ * random_.normal(),
          heading + kHeadingSpread * random_.normal()};
}

}  // namespace pushplan
