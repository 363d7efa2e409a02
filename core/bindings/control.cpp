#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>

#include <algorithm>
#include <optional>

#include "arrays.hpp"
#include "pushplan/control/mpc/tracker.hpp"
#include "pushplan/control/waiting.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

namespace {

using Counts = nb::ndarray<Index, nb::shape<4>, nb::c_contig, nb::device::cpu>;

/// A command as Python has it: speed [m/s], turn rate [rad/s].
std::pair<double, double> numbers(const mpc::Twist& twist) { return {twist.v, twist.w}; }

void bind_horizon(nb::module_& module) {
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
  nb::class_<mpc::Horizon>(module, "Horizon", "Commands for the next steps, in arrays of Python.")
      .def(
          "__init__",
          [](mpc::Horizon* self, const mpc::CommandLimits& limits, const Numbers<2>& units,
             const Integers<1>& columns, Index moves, const Integers<1>& blocks,
             const FloatsOut<2>& hessian, const FloatsOut<1>& gradient, const FloatsOut<1>& low,
             const FloatsOut<1>& high, const FloatsOut<1>& x, const FloatsOut<1>& steps,
             const FloatsOut<1>& solved, const IntegersOut<1>& shifted,
             const FloatsOut<2>& solution, const FloatsOut<2>& nominal, const NumbersOut<2>& last,
             const FloatsOut<2>& sent, const Counts& counts) {
            new (self) mpc::Horizon{limits,
                                    {units.data()[0], units.data()[1]},
                                    view(columns),
                                    {moves, view(blocks), view(hessian), view(gradient), view(low),
                                     view(high), view(x)},
                                    view(steps),
                                    view(solved),
                                    view(shifted),
                                    rows_as<mpc::Twist>(solution),
                                    rows_as<mpc::Twist>(nominal),
                                    reinterpret_cast<mpc::Twist*>(last.data()),
                                    rows_as<mpc::SentCommand>(sent),
                                    reinterpret_cast<mpc::HorizonCounts*>(counts.data())};
          },
          "limits"_a, "units"_a.noconvert(), "columns"_a.noconvert(), "moves"_a,
          "blocks"_a.noconvert(), "hessian"_a.noconvert(), "gradient"_a.noconvert(),
          "low"_a.noconvert(), "high"_a.noconvert(), "x"_a.noconvert(), "steps"_a.noconvert(),
          "solved"_a.noconvert(), "shifted"_a.noconvert(), "solution"_a.noconvert(),
          "nominal"_a.noconvert(), "last"_a.noconvert(), "sent"_a.noconvert(),
          "counts"_a.noconvert(), nb::keep_alive<1, 4>(), nb::keep_alive<1, 6>(),
          nb::keep_alive<1, 7>(), nb::keep_alive<1, 8>(), nb::keep_alive<1, 9>(),
          nb::keep_alive<1, 10>(), nb::keep_alive<1, 11>(), nb::keep_alive<1, 12>(),
          nb::keep_alive<1, 13>(), nb::keep_alive<1, 14>(), nb::keep_alive<1, 15>(),
          nb::keep_alive<1, 16>(), nb::keep_alive<1, 17>(), nb::keep_alive<1, 18>(),
          nb::keep_alive<1, 19>())
      .def(
          "send",
          [](mpc::Horizon& self, double v, double w, double held, bool ramps) {
            return numbers(self.send({v, w}, held, ramps));
          },
          "v"_a, "w"_a, "held"_a, "ramps"_a)
      .def("remember", &mpc::Horizon::remember, "time"_a, "over"_a);
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
      .def(nb::init<const mpc::Horizon&, const mpc::Tuning&, double, double>(), "horizon"_a,
           "tuning"_a, "span"_a, "delay"_a, nb::keep_alive<1, 2>())
      .def("begin_track", &mpc::Tracker::begin_track)
      .def(
          "begin_step",
          [](mpc::Tracker& self, const mpc::ReferencePath& track, const OnePose& at, double time,
             double held) -> std::optional<std::pair<double, double>> {
            const auto known = self.begin_step(track, pose(at), time, held);
            if (!known) return std::nullopt;
            return numbers(*known);
          },
          "track"_a, "pose"_a.noconvert(), "time"_a, "held"_a, ReleaseGil(),
          "Put up the program for where the robot is; the command where it is known without one.")
      .def("assemble_step", &mpc::Tracker::assemble_step, "track"_a, ReleaseGil())
      .def(
          "finish_step",
          [](mpc::Tracker& self, const mpc::ReferencePath& track, const OnePose& at, double time,
             double held, bool solved) {
            return numbers(self.finish_step(track, pose(at), time, held, solved));
          },
          "track"_a, "pose"_a.noconvert(), "time"_a, "held"_a, "solved"_a, ReleaseGil(),
          "The command: of the solution, or what is nearest to it without one.");
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
  bind_horizon(module);
  bind_path(module);
  bind_tracker(module);
  bind_waiting(module);
}

}  // namespace pushplan::bindings
