#include <nanobind/stl/pair.h>

#include <algorithm>
#include <limits>

#include "arrays.hpp"
#include "pushplan/control/mpc/tracker.hpp"
#include "pushplan/control/waiting.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

namespace {

constexpr Index kMostVariables = 2000;  // of a program, whose P is dense

/// A command as Python has it: speed [m/s], turn rate [rad/s].
std::pair<double, double> numbers(const mpc::Twist& twist) { return {twist.v, twist.w}; }

void bind_program(nb::module_& module) {
  nb::class_<mpc::CommandLimits>(module, "CommandLimits")
      .def(
          "__init__",
          [](mpc::CommandLimits* self, bool constant, double min_speed, double max_speed,
             double max_turn_rate, double max_acceleration, double max_turn_acceleration,
             double turning_radius) {
            new (self) mpc::CommandLimits{constant,      min_speed,        max_speed,
                                          max_turn_rate, max_acceleration, max_turn_acceleration,
                                          turning_radius};
          },
          "constant"_a, "min_speed"_a, "max_speed"_a, "max_turn_rate"_a, "max_acceleration"_a,
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
  nb::class_<mpc::QuadraticProgram>(module, "QuadraticProgram",
                                    "A quadratic program over commands, and its solver.")
      .def(
          "__init__",
          [](mpc::QuadraticProgram* self, Index variables, Index moves, const Integers<1>& blocks,
             const mpc::SolverSettings& settings) {
            require_between("moves", moves, 2, kMostVariables);
            require_between("variables", variables, moves, kMostVariables);
            Index least = 0;  // blocks do not overlap
            for (const Index first : view(blocks)) {
              require_between("blocks", first, least, variables - moves);
              least = first + moves;
            }
            new (self) mpc::QuadraticProgram(
                variables, moves, {blocks.data(), blocks.data() + blocks.size()}, settings);
          },
          "variables"_a, "moves"_a, "blocks"_a.noconvert(), "settings"_a)
      .def(
          "solve",
          [](mpc::QuadraticProgram& self, const Floats<2>& hessian, const Floats<1>& gradient,
             const Floats<1>& low, const Floats<1>& high, const FloatsOut<1>& x) {
            require_count("hessian", hessian.shape(0), self.x.size());
            const auto fill = [](const char* name, const auto& from, std::vector<double>& to) {
              require_count(name, from.size(), to.size());
              std::copy_n(from.data(), to.size(), to.begin());
            };
            fill("hessian", hessian, self.curvatures);
            fill("gradient", gradient, self.gradient);
            fill("low", low, self.low);
            fill("high", high, self.high);
            fill("x", x, self.x);
            const bool solved = self.solve();
            std::ranges::copy(self.x, x.data());
            return solved;
          },
          "hessian"_a.noconvert(), "gradient"_a.noconvert(), "low"_a.noconvert(),
          "high"_a.noconvert(), "x"_a.noconvert(), ReleaseGil(),
          "Minimise from x, in place; False if OSQP does not call its answer solved.");
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
          "poses"_a.noconvert(), "lengths"_a.noconvert(), "speeds"_a.noconvert(),
          nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>())
      .def(
          "locate",
          [](const mpc::ReferencePath& self, double x, double y, double low, double high) {
            const auto [along, index, fraction] = mpc::locate(self, {x, y}, low, high);
            return nb::make_tuple(along, index, fraction);
          },
          "x"_a, "y"_a, "low"_a, "high"_a)
      .def(
          "errors",
          [](const mpc::ReferencePath& self, double x, double y, double theta, Index index,
             double fraction) {
            require_index("index", index, static_cast<Index>(self.poses.size()));
            const auto [offset, error, heading, curvature] =
                mpc::errors(self, {x, y, theta}, {0.0, index, fraction});
            return nb::make_tuple(offset, error, heading, curvature);
          },
          "x"_a, "y"_a, "theta"_a, "index"_a, "fraction"_a);
}

void bind_tracker(nb::module_& module) {
  nb::class_<mpc::Tuning>(module, "Tuning")
      .def(
          "__init__",
          [](mpc::Tuning* self, double size, double max_speed, double max_turn_rate,
             double max_acceleration, bool stops, bool optimise_speed, double heading_weight,
             double turn_weight, double smoothness, double terminal, double speed_weight) {
            new (self) mpc::Tuning{size,       max_speed,      max_turn_rate,  max_acceleration,
                                   stops,      optimise_speed, heading_weight, turn_weight,
                                   smoothness, terminal,       speed_weight};
          },
          "size"_a, "max_speed"_a, "max_turn_rate"_a, "max_acceleration"_a, "stops"_a,
          "optimise_speed"_a, "heading_weight"_a, "turn_weight"_a, "smoothness"_a, "terminal"_a,
          "speed_weight"_a);
  nb::class_<mpc::TrackingAssembly>(module, "TrackingAssembly", "Puts up tracking problems.")
      .def(nb::init<Index>(), "variables"_a)
      .def(
          "assemble",
          [](mpc::TrackingAssembly& self, const mpc::ReferencePath& track,
             const mpc::Tuning& tuning, const OnePose& at, double along, const Numbers<2>& before,
             const Floats<1>& steps, const FloatsOut<2>& nominal, const FloatsOut<2>& hessian,
             const FloatsOut<1>& gradient) {
            self.assemble(track, tuning, pose(at), along, {before.data()[0], before.data()[1]},
                          view(steps), rows_as<mpc::Twist>(nominal), view(hessian), view(gradient));
          },
          "track"_a, "tuning"_a, "pose"_a.noconvert(), "along"_a, "before"_a.noconvert(),
          "steps"_a.noconvert(), "nominal"_a.noconvert(), "hessian"_a.noconvert(),
          "gradient"_a.noconvert(), ReleaseGil());
  nb::class_<mpc::Tracker>(module, "Tracker", "A predictive tracker of one robot.")
      .def(
          "__init__",
          [](mpc::Tracker* self, const mpc::CommandLimits& limits, const mpc::Tuning& tuning,
             const mpc::SolverSettings& solver, Index steps, double span, double delay, double v,
             double w) {
            require_between("steps", steps, 2, kMostVariables / 2);
            new (self) mpc::Tracker(limits, tuning, solver, steps, span, delay, {v, w});
          },
          "limits"_a, "tuning"_a, "solver"_a, "steps"_a, "span"_a, "delay"_a, "v"_a, "w"_a)
      .def("begin_track", &mpc::Tracker::begin_track)
      .def(
          "follow",
          [](mpc::Tracker& self, const mpc::ReferencePath& track, const OnePose& at, double time,
             double held) { return numbers(self.follow(track, pose(at), time, held)); },
          "track"_a, "pose"_a.noconvert(), "time"_a, "held"_a, ReleaseGil(),
          "The command for where the robot is; a stop where that is not finite.")
      .def_prop_ro("failures", [](mpc::Tracker& self) { return self.horizon().failed; });
}

void bind_waiting(nb::module_& module) {
  module.def(
      "clear_steps",
      [](double step, double turn, Index first, Index most, const Footprint& shape,
         const ConvexObstacles& walls, const OnePose& at) {
        CollisionChecker checker(shape, walls);
        return clear_steps(checker, pose(at), step, turn, first, most);
      },
      "step"_a, "turn"_a, "first"_a, "most"_a, "shape"_a, "walls"_a, "at"_a.noconvert(),
      ReleaseGil());
}

}  // namespace

void bind_control(nb::module_& module) {
  bind_program(module);
  bind_path(module);
  bind_tracker(module);
  bind_waiting(module);
}

}  // namespace pushplan::bindings
