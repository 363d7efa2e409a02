#include "pushplan/planners/rearrangement/push_rollout.hpp"

#include <algorithm>
#include <cmath>

namespace pushplan::rearrangement {
namespace {

/// Makes a box big enough for a disc.
void enclose(Box& box, const Pose& middle, double reach) {
  box.x_min = std::min(box.x_min, middle.x - reach);
  box.y_min = std::min(box.y_min, middle.y - reach);
  box.x_max = std::max(box.x_max, middle.x + reach);
  box.y_max = std::max(box.y_max, middle.y + reach);
}

/// True if two poses of an object differ by at least the distance of a mark.
bool has_moved(const Pose& before, const Pose& after, const ObjectStep& mark) {
  constexpr double kRadian = 0.2;  // weight of a radian against a size
  const double dx = after.x - before.x;
  const double dy = after.y - before.y;
  const double moved = std::sqrt(dx * dx + dy * dy) / mark.size;
  return moved + kRadian * std::abs(wrap_angle(after.theta - before.theta)) >= mark.least;
}

}  // namespace

PushRollout::PushRollout(const Bodies& bodies, const QuasiStaticSettings& settings,
                         const ObjectGoal& goal)
    : model_(bodies, settings),
      goal_(bodies.shapes, goal),
      poses_(bodies.radii.size()),
      saved_(bodies.radii.size()),
      lengths_(bodies.radii.size()),
      done_(bodies.radii.size()) {}

/// Removes what is delivered after a step. Returns whether one more object is done.
bool PushRollout::update_done(Box& box, double margin) {
  bool news = false;
  for (std::size_t k = 0; k < poses_.size(); ++k) {
    Pose& pose = poses_[k];
    if (pose.x == saved_[k].x && pose.y == saved_[k].y) continue;
    enclose(box, pose, model_.bodies().radii[k] + margin);
    const bool was_done = done_[k];
    done_[k] = goal_.is_done(static_cast<Index>(k), pose);
    news = news || (done_[k] && !was_done);
    if (done_[k] && goal_.goal().is_receptacle) {
      pose.x = kRemoved * (1.0 + static_cast<double>(k));  // apart from the others
    }
  }
  return news;
}

/// True if something that is wanted is not done.
bool PushRollout::is_wanting(std::span<const bool> wanted) const {
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    if (wanted[k] && !done_[k]) return true;
  }
  return false;
}

/// Writes a stage down.
void PushRollout::write(const RolloutLog& log, RolloutSize& size) const {
  log.steps[static_cast<std::size_t>(size.stages)] = size.poses;
  std::ranges::copy(poses_, log.poses.row(size.stages).begin());
  std::ranges::copy(lengths_, log.lengths.row(size.stages).begin());
  ++size.stages;
}

RolloutSize PushRollout::run(const Pose& start, std::span<const Pose> poses,
                             const PushAttempt& attempt, const PushingController& controller,
                             const RolloutLog& log) {
  std::ranges::copy(poses, poses_.begin());
  std::ranges::fill(lengths_, 0.0);
  for (std::size_t k = 0; k < poses.size(); ++k) {
    done_[k] = goal_.is_done(static_cast<Index>(k), poses[k]);
  }
  const double margin = 2.0 * controller.step;
  const double robot_reach = model_.bodies().robot_radius + margin;
  Box& box = *log.box;
  box = {kInfinity, kInfinity, -kInfinity, -kInfinity};
  enclose(box, start, robot_reach);
  Pose here = start;
  log.track[0] = here;
  RolloutSize size{0, 1};
  double travelled = 0.0;
  double reached = 0.0;
  while (size.poses < static_cast<Index>(log.track.size()) && travelled < attempt.limit) {
    double step = controller.step;
    double turn = 0.0;
    if (attempt.target >= 0) {
      const auto target = static_cast<std::size_t>(attempt.target);
      const PushCommand command =
          steer_push(here, poses_[target], attempt.path, reached, attempt.shift, controller);
      step = command.step;
      turn = command.turn;
      reached = command.reached;
      if (!command.holds && !done_[target]) break;
    }
    const Pose there = arc_step(here, step, turn);
    std::ranges::copy(poses_, saved_.begin());
    if (!push_to(model_, here, there, poses_, lengths_)) break;
    here = there;
    log.track[static_cast<std::size_t>(size.poses++)] = here;
    travelled += step;
    enclose(box, here, robot_reach);
    if (update_done(box, margin) && size.stages < kStages - 1) write(log, size);
    if (!is_wanting(attempt.wanted)) break;
  }
  if (size.stages == 0 || log.steps[static_cast<std::size_t>(size.stages - 1)] != size.poses) {
    write(log, size);
  }
  return size;
}

void sweep_arcs(QuasiStatic& model, const Pose& start, std::span<const Pose> poses,
                std::span<const ArcStep> arcs, const ObjectStep& mark, ArcSweep& out) {
  const auto target = static_cast<std::size_t>(mark.target);
  const Index steps = out.track.extent(1) - 1;
  std::vector<double> lengths(poses.size(), 0.0);
  for (std::size_t a = 0; a < arcs.size(); ++a) {
    const Index arc = static_cast<Index>(a);
    const auto track = out.track.row(arc);
    const auto objects = out.poses.row(arc);
    track[0] = start;
    std::ranges::copy(poses, objects.row(0).begin());
    Index last = 0;
    for (Index n = 1; n <= steps; ++n) {
      const Pose here = track[static_cast<std::size_t>(n - 1)];
      const Pose there = arc_step(here, arcs[a].distance, arcs[a].turn);
      track[static_cast<std::size_t>(n)] = there;
      const std::span<Pose> after = objects.row(n);
      std::ranges::copy(objects.row(n - 1), after.begin());
      if (!push_to(model, here, there, after, lengths)) break;
      if (has_moved(objects.row(last)[target], after[target], mark)) {
        out.marks.push_back({arc, n});
        last = n;
      }
    }
  }
}

}  // namespace pushplan::rearrangement
