// Collision checks, ends and speeds of paths, and searches for a way out.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/tuple.h>

#include "arrays.hpp"
#include "goal.hpp"
#include "pushplan/motion/coarse_path.hpp"
#include "pushplan/motion/collision.hpp"
#include "pushplan/motion/footprint.hpp"
#include "pushplan/motion/goal_approach.hpp"
#include "pushplan/motion/keep_out.hpp"
#include "pushplan/motion/length_bound.hpp"
#include "pushplan/motion/recovery.hpp"
#include "pushplan/motion/room_ahead.hpp"
#include "pushplan/motion/speed_profile.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

namespace {

/// The obstacles of a map and further ones, which own their arrays.
struct MoreObstacles : ConvexObstacles {
  explicit MoreObstacles(OwnObstacles made) : ConvexObstacles(made.view()), own(std::move(made)) {}

  OwnObstacles own;
};

void bind_length_bound(nb::module_& module) {
  nb::class_<LengthBound>(module, "LengthBound", "A lower bound on the cost of plans.")
      .def(
          "__init__",
          [](LengthBound* self, const StaticMap& map, const OnePose& start, const Numbers<5>& goal,
             double mass, double inscribed_radius, double turning_radius) {
            require_not_negative("inscribed_radius", inscribed_radius);
            require_finite("inscribed_radius", inscribed_radius);
            new (self) LengthBound(map, pose(start), goal_region(goal), mass, inscribed_radius,
                                   turning_radius);
          },
          "map"_a, "start"_a, "goal"_a, "mass"_a, "inscribed_radius"_a, "turning_radius"_a,
          nb::keep_alive<1, 2>())
      .def("run", &LengthBound::run, ReleaseGil())
      .def("cost", &LengthBound::cost)
      .def_prop_ro_static("SLIM", [](nb::handle) { return LengthBound::kSlim; });
}

void bind_collision(nb::module_& module) {
  nb::class_<OwnFootprint>(module, "OwnFootprint", "Convex parts of a robot, grown by a margin.")
      .def(
          "__init__",
          [](OwnFootprint* self, const Points& vertices, const Integers<1>& offsets,
             double margin) { new (self) OwnFootprint(polygons(vertices, offsets), margin); },
          "vertices"_a, "offsets"_a, "margin"_a);
  nb::class_<Footprint>(module, "Footprint", "Convex parts of a robot.")
      .def(
          "__init__",
          [](Footprint* self, const OwnFootprint& parts) { new (self) Footprint(parts.view()); },
          "parts"_a, nb::keep_alive<1, 2>())
      .def_ro("radius", &Footprint::radius);
  nb::class_<ConvexObstacles>(module, "ConvexObstacles", "Convex polygons in groups of neighbours.")
      .def(
          "__init__",
          [](ConvexObstacles* self, const StaticMap& map) {
            new (self) ConvexObstacles(map.walls());
          },
          "map"_a, nb::keep_alive<1, 2>())
      .def(
          "touches_disc",
          [](const ConvexObstacles& self, double x, double y, double radius) {
            return disc_touches({x, y}, radius, self);
          },
          "x"_a, "y"_a, "radius"_a)
      .def(
          "can_turn",
          [](const ConvexObstacles& self, double x, double y, double size) {
            return can_turn({x, y}, size, self);
          },
          "x"_a, "y"_a, "size"_a);
  nb::class_<MoreObstacles, ConvexObstacles>(module, "MoreObstacles",
                                             "Those of a map, and further outlines.")
      .def(
          "__init__",
          [](MoreObstacles* self, const StaticMap& map, const Points& vertices,
             const Integers<1>& offsets, const Numbers<4>& bounds) {
            const Polygons outlines = polygons(vertices, offsets);
            require_all_finite("vertices", vertices);
            OwnPolygons every = copy_of(map.parts());
            for (Index k = 0; k < outlines.count(); ++k) every.add(outlines[k]);
            const Box& within = *reinterpret_cast<const Box*>(bounds.data());
            new (self) MoreObstacles(OwnObstacles(every.polygons(), within));
          },
          "map"_a, "vertices"_a, "offsets"_a, "bounds"_a);
  nb::class_<CollisionChecker>(module, "CollisionChecker",
                               "Checks of a footprint, with memory for one thread.")
      .def(nb::init<Footprint, ConvexObstacles>(), "footprint"_a, "obstacles"_a,
           nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>())
      .def(
          "is_free",
          [](CollisionChecker& self, const OnePose& at) { return self.is_free(pose(at)); },
          "pose"_a)
      .def(
          "first_blocked",
          [](CollisionChecker& self, const Poses& path) { return self.first_blocked(poses(path)); },
          "poses"_a, ReleaseGil())
      .def(
          "depth", [](CollisionChecker& self, const OnePose& at) { return self.depth(pose(at)); },
          "pose"_a);
  module.def(
      "start_margin",
      [](const Points& vertices, const Integers<1>& offsets, const ConvexObstacles& walls,
         double margin, const OnePose& at) {
        return start_margin(polygons(vertices, offsets), walls, margin, pose(at));
      },
      "vertices"_a, "offsets"_a, "walls"_a, "margin"_a, "pose"_a);
  module.def(
      "keep_out",
      [](const std::shared_ptr<const StaticMap>& map, const Points& vertices,
         const Integers<1>& offsets, double size, const OnePose& at, double margin) {
        return keep_out(map, polygons(vertices, offsets), size, pose(at), margin);
      },
      "map"_a, "vertices"_a, "offsets"_a, "size"_a, "pose"_a, "margin"_a);
  module.def(
      "end_at_pose",
      [](const Numbers<5>& goal, double tolerance, const Poses& path, const Footprint& body,
         const ConvexObstacles& walls, double size, bool on_spot, bool curves_back, bool reverses,
         double radius, double spacing) {
        require_room("path", path.shape(0), 1);
        GoalRegion region = goal_region(goal);
        region.heading_tolerance = tolerance;
        const EndTurns turns{on_spot, curves_back, radius, spacing};
        std::optional<PathEnd> end =
            end_at_pose(region, poses(path), turns, reverses, body, size, walls);
        if (!end) end = PathEnd{0, {}, {}};
        return std::tuple(end->kept, copied_rows<double>(std::span<const Pose>(end->poses)),
                          copied(std::span<const double>(end->curvatures)));
      },
      "goal"_a, "tolerance"_a, "path"_a, "footprint"_a, "walls"_a, "size"_a, "on_spot"_a,
      "curves_back"_a, "reverses"_a, "radius"_a, "spacing"_a,
      "Poses kept (0 for none), and the poses and curvatures after them.");
}

void bind_speed_profile(nb::module_& module) {
  nb::class_<SpeedLimits>(module, "SpeedLimits", "Limits of a robot along a path.")
      .def(nb::init<double, double, double, double, double, double, bool, double, double>(),
           "size"_a, "max_speed"_a, "min_speed"_a, "turn_rate"_a, "max_acceleration"_a,
           "max_turn_acceleration"_a, "can_stop"_a, "driven_speed"_a, "driven_turn_rate"_a);
  module.def(
      "fill_speed_profile",
      [](const Poses& path, const Floats<1>& curvatures, const Floats<1>& chords,
         const SpeedLimits& limits, const std::optional<Numbers<2>>& velocity,
         const FloatsOut<1>& times, const FloatsOut<1>& speeds, const FloatsOut<1>& turn_rates) {
        const std::size_t count = path.shape(0);
        require_room("path", count, 1);
        require_count("curvatures", curvatures.shape(0), count);
        require_count("chords", chords.shape(0), count - 1);
        require_count("times", times.shape(0), count);
        require_count("speeds", speeds.shape(0), count);
        require_count("turn_rates", turn_rates.shape(0), count);
        const SpeedProfile profile{view(times), view(speeds), view(turn_rates)};
        if (velocity) {
          const double* v = velocity->data();
          return fill_sliding_profile(poses(path), limits, {v[0], v[1]}, profile);
        }
        fill_speed_profile({poses(path), view(curvatures)}, view(chords), limits, profile);
      },
      "path"_a, "curvatures"_a, "chords"_a, "limits"_a, "velocity"_a.none(), "times"_a, "speeds"_a,
      "turn_rates"_a, "Slides where there is a velocity (2,) of the start [m/s].");
  module.def(
      "turn_acceleration",
      [](const Floats<1>& turn_rates, const Floats<1>& times) {
        require_count("times", times.shape(0), turn_rates.shape(0));
        return turn_acceleration(view(turn_rates), view(times));
      },
      "turn_rates"_a, "times"_a);
}

/// Free space of a robot as Python gives it: the first four arguments of explorations.
Room room(const Footprint& footprint, const ConvexObstacles& walls, const Numbers<5>& goal,
          double spacing) {
  return {footprint, walls, goal_region(goal), spacing};
}

void bind_explorations(nb::module_& module) {
  nb::class_<RoomExploration>(module, "RoomExploration",
                              "A search for a way to get away, in pieces.")
      .def("run", &RoomExploration::run, ReleaseGil())
      .def_prop_ro("closed", &RoomExploration::closed);
  module.def(
      "explore_ahead",
      [](const Footprint& footprint, const ConvexObstacles& walls, const Numbers<5>& goal,
         double spacing, const OnePose& start, double size, double radius) {
        return explore_ahead(room(footprint, walls, goal, spacing), pose(start), size, radius);
      },
      "footprint"_a, "walls"_a, "goal"_a, "spacing"_a, "start"_a, "size"_a, "radius"_a,
      nb::keep_alive<0, 1>(), nb::keep_alive<0, 2>());
  module.def(
      "explore_around",
      [](const Footprint& footprint, const ConvexObstacles& walls, const Numbers<5>& goal,
         double spacing, const OnePose& start, double size, double radius, bool reverses,
         bool turns_on_spot) {
        return explore_around({reverses, turns_on_spot}, room(footprint, walls, goal, spacing),
                              pose(start), size, radius);
      },
      "footprint"_a, "walls"_a, "goal"_a, "spacing"_a, "start"_a, "size"_a, "radius"_a,
      "reverses"_a, "turns_on_spot"_a, nb::keep_alive<0, 1>(), nb::keep_alive<0, 2>());
}

void bind_ways_out(nb::module_& module) {
  nb::class_<Reachable>(module, "Reachable", "A search for a way around walls, in pieces.")
      .def(
          "__init__",
          [](Reachable* self, const StaticMap& map, double inscribed, double circumscribed,
             const Numbers<2>& start, const Numbers<5>& goal) {
            new (self)
                Reachable(map, {inscribed, circumscribed}, {start(0), start(1)}, goal_region(goal));
          },
          "map"_a, "inscribed"_a, "circumscribed"_a, "start"_a, "goal"_a, nb::keep_alive<1, 2>())
      .def("run", &Reachable::run, ReleaseGil())
      .def_prop_ro("is_sealed", &Reachable::is_sealed);
  module.def(
      "recovery_path",
      [](const OnePose& start, const Floats<2>& steps, const Footprint& body,
         const Footprint& grown, const ConvexObstacles& among, double size) {
        std::vector<Pose> path;
        {
          nb::gil_scoped_release released;
          path = recovery_path(
              {pose(start), rows_as<const RecoveryStep>(steps), body, grown, among, size});
        }
        return copied_rows<double>(std::span<const Pose>(path));
      },
      "start"_a, "steps"_a, "body"_a, "grown"_a, "among"_a, "size"_a, kOwned);
}

}  // namespace

void bind_motion_paths(nb::module_& module) {
  bind_collision(module);
  bind_length_bound(module);
  bind_speed_profile(module);
  bind_explorations(module);
  bind_ways_out(module);
}

}  // namespace pushplan::bindings
