#include "pushplan/envs/planar_simulator.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace pushplan {
namespace {

constexpr Twist kStill{0.0, 0.0, 0.0};
constexpr Index kGlideSamples = 4;   // at least, where the robot turns and touches nothing
constexpr double kGlideTurn = 0.15;  // turn between two of them at most [rad]
constexpr double kSampled = 24.0;    // steps of fewer substeps are sampled more coarsely

Index whole(double value) { return static_cast<Index>(std::ceil(value)); }

}  // namespace

PlanarSimulator::PlanarSimulator(const Chipmunk& engine, const ChipmunkHandles& handles,
                                 const Reach& reach, const Obstacles& obstacles,
                                 const Momentum& momentum, const PlanarSettings& settings,
                                 std::span<BodyState> states)
    : scene_(engine, handles, momentum),
      drive_(scene_, reach.robot_radius(), settings.tolerance),
      reach_(reach),
      obstacles_(obstacles),
      momentum_(momentum),
      settings_(settings),
      states_(states),
      poses_(states.size() - 1),
      speeds_(poses_.size()),
      ways_(poses_.size()),
      loaded_(std::make_unique<bool[]>(poses_.size())),
      missed_(std::make_unique<bool[]>(poses_.size())) {}

/// Motion at a velocity ahead and to the left; one to the side is one ahead of another bearing.
ArcMotion PlanarSimulator::motion_of(double linear, double angular, double lateral) const {
  const double theta = states_[0].pose.theta;
  if (lateral == 0.0) return {theta, linear, angular, settings_.holds};
  const double bearing = std::atan2(lateral, linear);
  return {theta + bearing, std::hypot(linear, lateral), angular, settings_.holds, bearing};
}

void PlanarSimulator::step(double ahead, double angular, double lateral, double duration) {
  start_record();
  const ArcMotion motion = motion_of(ahead, angular, lateral);
  const double linear = motion.linear;
  const double clear = clear_time(motion, duration);
  const double turn = std::abs(angular) * duration;
  if (clear >= duration) {
    // no farther apart than the robot's radius
    const Index samples = std::max(whole(turn / kGlideTurn),
                                   whole(std::abs(linear) * duration / reach_.robot_radius()));
    glide(motion, duration, std::max(samples, turn == 0.0 ? Index{1} : kGlideSamples));
    return;
  }
  const double speed = std::abs(linear) + std::abs(angular) * reach_.robot_radius();
  double way = speed * duration;
  double decay = 0.0;
  for (std::size_t k = 0; k < poses_.size(); ++k) {
    way = std::max(way, speeds_[k] * duration);
    const auto body = static_cast<Index>(k + 1);
    decay = std::max(decay, momentum_.decay(body, states_[k + 1].twist));
  }
  const double wanted = std::max(way / settings_.travel, duration * decay / settings_.decay);
  const double fullness = std::min(1.0, wanted / kSampled);
  const Index samples =
      std::max(Index{2}, whole(static_cast<double>(settings_.samples) * fullness));
  const auto count = static_cast<double>(samples);
  const Index each = std::max(Index{1}, whole(wanted / count));
  // samples before anything is touched
  const Index free = std::min(static_cast<Index>(count * clear / duration), samples - 1);
  glide(motion, duration * static_cast<double>(free) / count, free);
  const Index left = samples - free;
  const double rest = duration * static_cast<double>(left) / count;
  choose(speed * rest, duration);
  const DriveStep drive{linear,         angular,      rest, motion.course,
                        motion.bearing, motion.holds, left, each};
  simulate(left, [&] { drive_.run(drive, active_, start_, driven_); });
}

bool PlanarSimulator::sweep(const Pose& to, const Pose& motion, double length, double duration) {
  start_record();
  const double course = std::atan2(motion.y, motion.x);
  const ArcMotion straight{course, length / duration, motion.theta / duration, true};
  if (clear_time(straight, duration) >= duration) {
    stop_objects();
    states_[0].pose = to;
    return true;
  }
  const double way = length + std::abs(motion.theta) * reach_.robot_radius();
  const Index count = std::max(Index{1}, whole(way / settings_.travel));
  const Twist velocity{motion.x / duration, motion.y / duration, motion.theta / duration};
  const double h = duration / static_cast<double>(count);
  choose(way, duration);
  simulate(1, [&] { drive_.sweep(velocity, h, count, active_, start_, driven_); });
  return !record_.held;
}

double PlanarSimulator::clear_for(double linear, double angular, double lateral, double limit) {
  return clear_time(motion_of(linear, angular, lateral), limit);
}

/// Also takes the poses and speeds of the objects.
double PlanarSimulator::clear_time(const ArcMotion& motion, double limit) {
  look_at_objects();
  if (rolls_) return 0.0;
  return reach_.clear_time(states_[0].pose, motion, limit, settings_.travel, poses_, obstacles_);
}

void PlanarSimulator::start_record() {
  record_.robot.clear();
  record_.objects.clear();
  record_.held = false;
  record_.touched = false;
}

void PlanarSimulator::look_at_objects() {
  rolls_ = false;
  for (std::size_t k = 0; k < poses_.size(); ++k) {
    const auto& [pose, twist] = states_[k + 1];
    const double turning = std::abs(twist.omega) * reach_.radii()[k];
    const double speed = std::hypot(twist.vx, twist.vy) + turning;
    poses_[k] = pose;
    speeds_[k] = speed < settings_.rest ? 0.0 : speed;
    rolls_ = rolls_ || speeds_[k] != 0.0;
  }
}

void PlanarSimulator::stop_objects() {
  for (BodyState& object : states_.subspan(1)) object.twist = kStill;
}

/// Drives where the robot touches nothing.
void PlanarSimulator::glide(const ArcMotion& motion, double duration, Index samples) {
  const Pose start = states_[0].pose;
  for (Index i = 0; i < samples; ++i) {
    const double time = duration * static_cast<double>(i + 1) / static_cast<double>(samples);
    record_.robot.push_back(arc_pose(start, motion, time));
    record_.objects.insert(record_.objects.end(), poses_.begin(), poses_.end());
  }
  if (samples == 0) return;
  stop_objects();
  const Pose end = record_.robot.back();
  const double v = motion.linear;
  const double course = end.theta + motion.bearing;
  states_[0] = {end, {v * std::cos(course), v * std::sin(course), motion.angular}};
}

/// Marks the objects to be loaded where points of the robot move by `reach` [m].
void PlanarSimulator::choose(double reach, double duration) {
  for (std::size_t k = 0; k < speeds_.size(); ++k) ways_[k] = speeds_[k] * duration;
  const std::span<bool> loaded(loaded_.get(), poses_.size());
  reach_.within(states_[0].pose, reach, poses_, ways_, loaded);
  if (loads_all) std::ranges::fill(loaded, true);
}

/// Runs the engine with the objects that are marked, and with those that turn out to be struck.
template <class Run>
void PlanarSimulator::simulate(Index samples, Run run) {
  const std::span<bool> loaded(loaded_.get(), poses_.size());
  const std::span<bool> missed(missed_.get(), poses_.size());
  const auto count = static_cast<Index>(poses_.size());
  const auto begin = static_cast<Index>(record_.objects.size());
  record_.objects.resize(record_.objects.size() + static_cast<std::size_t>(samples * count));
  const ArrayView<Pose, 2> paths(record_.objects.data() + begin, {samples, count});
  ArrayView<BodyState, 2> driven;
  while (true) {
    active_.clear();
    start_.assign(1, states_[0]);
    for (Index k = 0; k < count; ++k) {
      if (!loaded[static_cast<std::size_t>(k)]) continue;
      active_.push_back(k);
      start_.push_back(states_[static_cast<std::size_t>(k + 1)]);
    }
    const auto bodies = static_cast<Index>(start_.size());
    driven_.resize(static_cast<std::size_t>(samples * bodies));
    driven = {driven_.data(), {samples, bodies}};
    run();
    most_shapes = std::max(most_shapes, scene_.shape_count());
    for (Index t = 0; t < samples; ++t) {
      std::ranges::copy(poses_, paths.row(t).begin());
      for (Index i = 1; i < bodies; ++i) {
        paths(t, active_[static_cast<std::size_t>(i - 1)]) = driven(t, i).pose;
      }
    }
    reach_.struck(loaded, paths, poses_, missed);
    if (std::ranges::none_of(missed, std::identity{})) break;
    std::ranges::transform(loaded, missed, loaded.begin(), std::logical_or{});
  }
  stop_objects();
  states_[0] = driven(samples - 1, 0);
  for (std::size_t i = 0; i < active_.size(); ++i) {
    const auto body = static_cast<Index>(i + 1);
    states_[static_cast<std::size_t>(active_[i] + 1)] = driven(samples - 1, body);
  }
  for (Index t = 0; t < samples; ++t) record_.robot.push_back(driven(t, 0).pose);
  record_.held = drive_.held();
  record_.touched = scene_.contacts().touched;
}

}  // namespace pushplan
