#include <nanobind/stl/pair.h>

#include <limits>

#include "arrays.hpp"
#include "pushplan/control/mpc/tracker.hpp"
#include "pushplan/motion/collision.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

namespace {

constexpr Index kMostSteps = 1000;  // of a program, whose P is dense

/// A command as Python has it: speed [m/s], turn rate [rad/s].
std::pair<double, double> numbers(const mpc::Twist& twist) { return {twist.v, twist.w}; }

void bind_limits(nb::module_& module) {
  nb::class_<mpc::CommandLimits>(module, "CommandLimits")
      .def(nb::init<bool, double, double, double, double, double, double>(), "constant"_a,
           "min_speed"_a, "max_speed"_a, "max_turn_rate"_a, "max_acceleration"_a,
           "max_turn_acceleration"_a, "turning_radius"_a);
  nb::class_<mpc::SolverSettings>(module, "SolverSettings")
      .def(
          "__init__",
          [](mpc::SolverSettings* self, double tolerance, Index iterations, Index rounds,
             Index first_rounds) {
            if (!(tolerance > 0.0)) refuse("tolerance", std::to_string(tolerance), "more than 0");
            require_between("iterations", iterations, 1, std::numeric_limits<int>::max());
            new (self) mpc::SolverSettings{tolerance, iterations, rounds, first_rounds};
          },
          "tolerance"_a, "iterations"_a, "rounds"_a, "first_rounds"_a);
}

void bind_path(nb::module_& module) {
  nb::class_<mpc::ReferencePath>(module, "ReferencePath")
      .def(
          "__init__",
          [](mpc::ReferencePath* self, const Poses& path, const Floats<1>& lengths,
             const Floats<1>& speeds) {
            require_room("poses", path.shape(0), 1);
            require_count("lengths", lengths.shape(0), path.shape(0));
            require_count("speeds", speeds.shape(0), path.shape(0));
            new (self) mpc::ReferencePath{poses(path), view(lengths), view(speeds)};
          },
          "poses"_a, "lengths"_a, "speeds"_a, nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(),
          nb::keep_alive<1, 4>())
      .def(
          "locate",
          [](const mpc::ReferencePath& self, double x, double y, double low, double high) {
            const auto [along, index, fraction] = mpc::locate(self, {x, y}, low, high);
            return std::tuple(along, index, fraction);
          },
          "x"_a, "y"_a, "low"_a, "high"_a)
      .def(
          "errors",
          [](const mpc::ReferencePath& self, double x, double y, double theta, Index index,
             double fraction) {
            require_index("index", index, static_cast<Index>(self.poses.size()));
            const auto [offset, error, heading, curvature] =
                mpc::errors(self, {x, y, theta}, {0.0, index, fraction});
            return std::tuple(offset, error, heading, curvature);
          },
          "x"_a, "y"_a, "theta"_a, "index"_a, "fraction"_a);
}

void bind_tracker(nb::module_& module) {
  nb::class_<mpc::Tuning>(module, "Tuning")
      .def(nb::init<double, double, double, double, bool, bool, double, double, double, double,
                    double>(),
           "size"_a, "max_speed"_a, "max_turn_rate"_a, "max_acceleration"_a, "stops"_a,
           "optimise_speed"_a, "heading_weight"_a, "turn_weight"_a, "smoothness"_a, "terminal"_a,
           "speed_weight"_a);
  nb::class_<mpc::Tracker>(module, "Tracker", "A predictive tracker of one robot.")
      .def(
          "__init__",
          [](mpc::Tracker* self, const mpc::CommandLimits& limits, const mpc::Tuning& tuning,
             const mpc::SolverSettings& solver, Index steps, double span, double delay, double v,
             double w) {
            require_between("steps", steps, 2, kMostSteps);
            new (self) mpc::Tracker(limits, tuning, solver, steps, span, delay, {v, w});
          },
          "limits"_a, "tuning"_a, "solver"_a, "steps"_a, "span"_a, "delay"_a, "v"_a, "w"_a)
      .def("begin_track", &mpc::Tracker::begin_track)
      .def(
          "follow",
          [](mpc::Tracker& self, const mpc::ReferencePath& track, const OnePose& at, double time,
             double held) { return numbers(self.follow(track, pose(at), time, held)); },
          "track"_a, "pose"_a, "time"_a, "held"_a, ReleaseGil(),
          "The command for where the robot is; a stop where that is not finite.")
      .def_prop_ro("failures", [](mpc::Tracker& self) { return self.horizon().failed; });
}

void bind_waiting(nb::module_& module) {
  module.def(
      "clear_steps",
      [](double step, double turn, Index first, Index most, const Footprint& shape,
         const ConvexObstacles& walls, const OnePose& start) {
        CollisionChecker checker(shape, walls);
        Pose at = pose(start);
        Index done = 0;
        for (; done < most; ++done) {
          at = arc_step(at, step, done >= first ? turn : 0.0);
          if (!checker.is_free(at)) break;
        }
        return done;
      },
      "step"_a, "turn"_a, "first"_a, "most"_a, "shape"_a, "walls"_a, "at"_a, ReleaseGil(),
      "Steps, of `most`, before a robot touches a wall: straight before step `first`, with a turn "
      "[rad] in each later one.");
}

}  // namespace

void bind_control(nb::module_& module) {
  bind_limits(module);
  bind_path(module);
  bind_tracker(module);
  bind_waiting(module);
}

}  // namespace pushplan::bindings
