#include "pushplan/motion/recovery.hpp"

#include <algorithm>
#include <cmath>

#include "pushplan/arithmetic.hpp"
#include "pushplan/geometry/obstacles.hpp"
#include "pushplan/zeroed_array.hpp"

namespace pushplan {
namespace {

constexpr double kCell = 0.6;   // sides of the boxes of poses of which one is looked at [steps]
constexpr double kReach = 3.0;  // greatest distance of the place to turn [radii]
constexpr Index kMostPoses = 100'000;
constexpr double kClearance = 1.05;  // that the robot needs to turn about [radii]
constexpr double kDeeper = 1e-3;     // by how much it may get deeper into what it touches [radii]

/// Checks that the robot, itself and grown, gets no deeper into what it touches at the start.
class DepthCheck {
 public:
  explicit DepthCheck(const RecoveryProblem& problem)
      : body_(problem.body, problem.obstacles),
        grown_(problem.grown, problem.obstacles),
        body_depth_(body_.depth(problem.start) + kDeeper * problem.size),
        grown_depth_(grown_.depth(problem.start) + kDeeper * problem.size) {}

  bool gets_deeper(const Pose& pose) {
    return body_.depth(pose) > body_depth_ || grown_.depth(pose) > grown_depth_;
  }

 private:
  CollisionChecker body_;
  CollisionChecker grown_;
  double body_depth_;  // greatest one allowed [m]
  double grown_depth_;
};

/// Boxes of poses around the start of which one is looked at each.
class SeenPoses {
 public:
  SeenPoses(const Pose& start, double size) : start_(start), side_(kUnit * size) {}

  /// The number of the box of a pose, -1 if it is out of reach.
  Index box_of(const Pose& pose) const {
    const Index column = kHalf + static_cast<Index>(std::rint((pose.x - start_.x) / side_));
    const Index row = kHalf + static_cast<Index>(std::rint((pose.y - start_.y) / side_));
    const Index heading = floor_index(floor_mod(pose.theta, kTurn) / kUnit);
    if (column < 0 || column >= kWidth || row < 0 || row >= kWidth) return -1;
    if (heading < 0 || heading >= turns_) return -1;  // of NaN
    return (row * kWidth + column) * turns_ + heading;
  }

  bool& operator[](Index box) const { return seen_[box]; }

 private:
  static constexpr double kUnit = kCell * kRecoveryStep;
  static constexpr Index kHalf = static_cast<Index>(kReach / kUnit);
  static constexpr Index kWidth = 2 * kHalf + 1;

  Pose start_;
  double side_;  // [m]
  Index turns_ = ceil_index(kTurn / kUnit);
  ZeroedArray<bool> seen_{kWidth * kWidth * turns_};
};

}  // namespace

bool can_turn(Vec2 centre, double size, const ConvexObstacles& obstacles) {
  const Box& bounds = obstacles.bounds;
  const double radius = kClearance * size;
  const double room = std::min({centre.x - bounds.x_min, bounds.x_max - centre.x,
                                centre.y - bounds.y_min, bounds.y_max - centre.y});
  if (room < radius) return false;
  for (Index s = 0; s < obstacles.count(); ++s) {
    const Box& box = obstacles.boxes[static_cast<std::size_t>(s)];
    if (centre.x + radius <= box.x_min || centre.x - radius >= box.x_max) continue;
    if (centre.y + radius <= box.y_min || centre.y - radius >= box.y_max) continue;
    if (core_distance(centre, obstacles.polygons[s]) < radius) return false;
  }
  return true;
}

std::vector<Pose> recovery_path(const RecoveryProblem& problem) {
  struct Node {
    Pose pose;
    Index before;
  };
  DepthCheck check(problem);
  const SeenPoses seen(problem.start, problem.size);
  std::vector<Node> nodes{{problem.start, -1}};
  const auto path_to = [&](Index last) {
    std::vector<Pose> path;
    for (Index at = last; at >= 0; at = nodes[static_cast<std::size_t>(at)].before) {
      path.push_back(nodes[static_cast<std::size_t>(at)].pose);
    }
    std::reverse(path.begin(), path.end());
    return path;
  };
  for (std::size_t at = 0; at < nodes.size(); ++at) {
    const Pose here = nodes[at].pose;
    for (const RecoveryStep& step : problem.steps) {
      const Pose pose = arc_step(here, step.distance, step.turn);
      const Index box = seen.box_of(pose);
      if (box < 0 || seen[box]) continue;
      if (check.gets_deeper(pose)) continue;
      if (check.gets_deeper(arc_step(here, 0.5 * step.distance, 0.5 * step.turn))) continue;
      seen[box] = true;
      nodes.push_back({pose, static_cast<Index>(at)});
      const auto count = static_cast<Index>(nodes.size());
      if (count == kMostPoses) return {};
      if (can_turn({pose.x, pose.y}, problem.size, problem.obstacles)) return path_to(count - 1);
    }
  }
  return {};
}

}  // namespace pushplan
