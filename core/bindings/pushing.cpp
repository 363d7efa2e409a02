#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "pushplan/planners/pushing/push_tracker.hpp"

namespace pushplan::bindings {

using namespace nb::literals;
using namespace pushplan::pushing;

namespace {

/// A state as Python has it: robot pose, offset, angle, gap.
using OneState = Numbers<6>;
using States = Exact<double, nb::shape<-1, 6>>;
/// Motions of a box as Python has them, the number of the mode fifth.
using Motions = Exact<double, nb::shape<-1, 6>>;

using Slopes = Exact<double, nb::shape<2, 4>>;

constexpr Index kMostSteps = 1000;  // of a program, whose P is dense

PushState state_of(const OneState& array) {
  return *reinterpret_cast<const PushState*>(array.data());
}

auto copied_state(const PushState& state) {
  const auto* numbers = reinterpret_cast<const double*>(&state);
  return copied(std::span(numbers, sizeof(PushState) / sizeof(double)));
}

void write(const BoxMotion& motion, double* out) {
  const double mode = static_cast<double>(motion.mode);
  const double numbers[]{motion.normal, motion.sideways, motion.turn, motion.pressure,
                         mode,          motion.shear};
  std::ranges::copy(numbers, out);
}

void bind_contact(nb::module_& module) {
  nb::class_<BoxContact>(module, "BoxContact", "Bumper and pushed face.")
      .def(nb::init<double, double, double, double, double, double, double, double>(), "front"_a,
           "half"_a, "curvature"_a, "depth"_a, "low"_a, "high"_a, "spread"_a, "friction"_a)
      .def_prop_ro("numbers",
                   [](const BoxContact& self) {
                     return std::tuple(self.front, self.half, self.curvature, self.depth, self.low,
                                       self.high, self.spread, self.friction);
                   })
      .def_ro("front", &BoxContact::front, "X of the bumper in its middle, from the axle [m].")
      .def_ro("half", &BoxContact::half, "Half the bumper's width [m].")
      .def_ro("curvature", &BoxContact::curvature, "Curvature of the bumper's front [1/m].")
      .def_ro("depth", &BoxContact::depth, "From the pushed face to the box's centre [m].")
      .def_ro("low", &BoxContact::low, "Right end of the face from the centre [m], negative.")
      .def_ro("high", &BoxContact::high, "Left end of the face [m].")
      .def_ro("spread", &BoxContact::spread, "Greatest torque over force of the ground [m].")
      .def_ro("friction", &BoxContact::friction, "Coefficient between bumper and box.")
      .def(
          "line",
          [](const BoxContact& self, double offset) {
            const auto [low, high] = self.line(offset);
            return std::pair{low, high};
          },
          "offset"_a)
      .def(
          "standoff",
          [](const BoxContact& self, double offset, double angle) {
            const auto [x, touch] = self.standoff(offset, angle);
            return std::pair{x, touch};
          },
          "offset"_a, "angle"_a)
      .def(
          "velocity",
          [](const BoxContact& self, double offset, double angle, double c, double s, double v,
             double w, double dt, const NumbersOut<6>& out) {
            const auto [motion, x] = contact_velocity(self, offset, angle, c, s, {v, w}, dt);
            write(motion, out.data());
            return x;
          },
          "offset"_a, "angle"_a, "c"_a, "s"_a, "v"_a, "w"_a, "dt"_a, "out"_a)
      .def(
          "linearise",
          [](const BoxContact& self, double offset, double angle, double v, double w, double dt,
             const Numbers<4>& widths, const Slopes& slopes) {
            const double* width = widths.data();
            const BoxSlopes found = linearise(self, offset, angle, {v, w}, dt,
                                              {width[0], width[1], width[2], width[3]});
            std::ranges::copy(found.offset, slopes.data());
            std::ranges::copy(found.angle, slopes.data() + found.offset.size());
          },
          "offset"_a, "angle"_a, "v"_a, "w"_a, "dt"_a, "widths"_a, "slopes"_a)
      .def(
          "roll_out",
          [](const BoxContact& self, const OneState& start, const Floats<2>& twists,
             const Floats<1>& steps, const States& states, const Motions& motions) {
            require_count("twists", twists.shape(0), steps.shape(0));
            require_count("states", states.shape(0), steps.shape(0) + 1);
            require_count("motions", motions.shape(0), steps.shape(0));
            std::vector<BoxMotion> found(steps.shape(0));
            roll_out(self, state_of(start), rows_as<const Twist>(twists), view(steps),
                     rows_as<PushState>(states), found);
            for (std::size_t k = 0; k < found.size(); ++k) write(found[k], motions.data() + 6 * k);
          },
          "start"_a, "twists"_a, "steps"_a, "states"_a, "motions"_a, ReleaseGil())
      .def(
          "observe",
          [](const BoxContact& self, double normal, const OnePose& robot, const OnePose& box) {
            return copied_state(observe(self, normal, pose(robot), pose(box)));
          },
          "normal"_a, "robot"_a, "box"_a, kOwned)
      .def(
          "box_pose",
          [](const BoxContact& self, const OneState& state) {
            const Pose box = box_pose(self, state_of(state));
            const double numbers[]{box.x, box.y, box.theta};
            return copied(std::span<const double>(numbers));
          },
          "state"_a, kOwned);
}

void bind_clearance(nb::module_& module) {
  nb::class_<Clearance>(module, "Clearance", "Distances of robot and box from static things.")
      .def(
          "__init__",
          [](Clearance* self, const Points& vertices, const Integers<1>& offsets,
             const Floats<1>& radii, double least, double slack) {
            const Polygons parts = polygons(vertices, offsets);
            require_room("parts", offsets.shape(0), 2);
            require_count("radii", radii.shape(0), parts.count());
            new (self) Clearance(parts, view(radii), {least, slack});
          },
          "vertices"_a, "offsets"_a, "radii"_a, "least"_a, "slack"_a)
      .def(
          "gaps",
          [](Clearance& self, const BoxContact& contact, double normal, const OneState& state,
             const Obstacles& obstacles) {
            const auto [robot, box] = self.gaps(contact, normal, state_of(state), obstacles);
            return std::pair{robot, box};
          },
          "contact"_a, "normal"_a, "state"_a, "obstacles"_a, ReleaseGil());
}

void bind_problem(nb::module_& module) {
  nb::class_<PushWeights>(module, "PushWeights", "Costs and scales of the cost.")
      .def(nb::init<double, double, double, double, double, double, double, double, double, double,
                    double, double, double, double>(),
           "length"_a, "max_speed"_a, "half"_a, "curvature"_a, "heading"_a, "offset"_a, "rim"_a,
           "safe"_a, "angle"_a, "grip"_a, "turn"_a, "speed"_a, "smoothness"_a, "terminal"_a);
  nb::class_<PushingProblem>(module, "PushingProblem", "The pushing problem of one call.")
      .def(
          "__init__",
          [](PushingProblem* self, const BoxContact& contact, const mpc::ReferencePath& track,
             const PushWeights& weights, const OneState& start, double along,
             const Numbers<2>& last, const Numbers<2>& units, const Floats<1>& steps,
             const Integers<1>& groups) {
            require_count("groups", groups.shape(0), steps.shape(0));
            new (self) PushingProblem{contact,
                                      track,
                                      weights,
                                      state_of(start),
                                      along,
                                      {last.data()[0], last.data()[1]},
                                      {units.data()[0], units.data()[1]},
                                      view(steps),
                                      view(groups)};
          },
          "contact"_a, "track"_a, "weights"_a, "start"_a, "along"_a, "last"_a, "units"_a, "steps"_a,
          "groups"_a, nb::keep_alive<1, 3>(), nb::keep_alive<1, 9>(), nb::keep_alive<1, 10>());
  nb::class_<PushAssembly>(module, "PushAssembly", "Puts up pushing problems of one size.")
      .def(nb::init<Index, Index>(), "steps"_a, "commands"_a)
      .def(
          "assemble",
          [](PushAssembly& self, const PushingProblem& problem, const Floats<2>& nominal,
             const FloatsOut<2>& hessian, const FloatsOut<1>& gradient) {
            return self.assemble(problem, rows_as<const Twist>(nominal), view(hessian),
                                 view(gradient));
          },
          "problem"_a, "nominal"_a, "hessian"_a, "gradient"_a, ReleaseGil());
}

void bind_tracker(nb::module_& module) {
  nb::class_<Face>(module, "Face", "A side of a box on the bumper.")
      .def(
          "__init__",
          [](Face* self, const Numbers<3>& score, const BoxContact& contact, double normal,
             double curvature) {
            const double* numbers = score.data();
            new (self) Face{{numbers[0], numbers[1], numbers[2]}, contact, normal, curvature};
          },
          "score"_a, "contact"_a, "normal"_a, "curvature"_a);
  nb::class_<PushTracker>(module, "PushTracker", "Pushes boxes along paths.")
      .def(
          "__init__",
          [](PushTracker* self, const mpc::CommandLimits& limits, const PushWeights& weights,
             const mpc::SolverSettings& solver, const Integers<1>& groups, double reach,
             double delay, double gain, double v, double w) {
            const std::span<const Index> listed = view(groups);
            require_between("groups", static_cast<Index>(listed.size()), 2, kMostSteps);
            require_between("groups", listed[0], 0, 0);
            for (std::size_t k = 1; k < listed.size(); ++k) {
              require_between("groups", listed[k], listed[k - 1], listed[k - 1] + 1);
            }
            require_between("groups", listed.back(), 1, kMostSteps);
            new (self)
                PushTracker(limits, {weights, {listed.begin(), listed.end()}, reach, delay, gain},
                            solver, {v, w});
          },
          "limits"_a, "weights"_a, "solver"_a, "groups"_a, "reach"_a, "delay"_a, "gain"_a, "v"_a,
          "w"_a)
      .def(
          "begin",
          [](PushTracker& self, std::vector<Face> faces, const Clearance& clearance,
             double direction) {
            require_room("faces", faces.size(), 1);
            self.begin(std::move(faces), clearance, direction);
          },
          "faces"_a, "clearance"_a, "direction"_a)
      .def(
          "follow",
          [](PushTracker& self, const mpc::ReferencePath& track, const Obstacles& obstacles,
             const OnePose& robot, const OnePose& box, double time, double held) {
            if (!self.has_begun())
              throw std::invalid_argument("begin a path before it is followed");
            const Twist twist = self.follow(track, obstacles, pose(robot), pose(box), time, held);
            return std::pair{twist.v, twist.w};
          },
          "track"_a, "obstacles"_a, "robot"_a, "box"_a, "time"_a, "held"_a, ReleaseGil(),
          "The command; a stop at the end, and for poses that are not finite.")
      .def(
          "stop",
          [](PushTracker& self, double time, double held) {
            const Twist twist = self.stop(time, held);
            return std::pair{twist.v, twist.w};
          },
          "time"_a, "held"_a)
      .def_prop_ro("failures", [](PushTracker& self) { return self.horizon().failed; })
      .def_prop_ro(
          "solution",
          [](PushTracker& self) {
            return copied_rows<double>(std::span<const Twist>(self.horizon().solution));
          },
          kOwned)
      .def_prop_ro(
          "steps",
          [](PushTracker& self) { return copied(std::span<const double>(self.horizon().steps)); },
          kOwned)
      .def_prop_ro("face", &PushTracker::face)
      .def_prop_ro("along", &PushTracker::along)
      .def_prop_ro("slowed", &PushTracker::slowed)
      .def_prop_ro(
          "state", [](const PushTracker& self) { return copied_state(self.state()); }, kOwned)
      .def_prop_ro(
          "state_in_effect",
          [](const PushTracker& self) { return copied_state(self.state_in_effect()); }, kOwned);
}

}  // namespace

void bind_pushing(nb::module_& module) {
  bind_contact(module);
  bind_clearance(module);
  bind_problem(module);
  bind_tracker(module);
}

}  // namespace pushplan::bindings
