// Paths that push: collision checks, problems, rollouts, and searches for a way out.
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>

#include "arrays.hpp"
#include "goal.hpp"
#include "pushplan/motion/arc_rollout.hpp"
#include "pushplan/motion/coarse_path.hpp"
#include "pushplan/motion/collision.hpp"
#include "pushplan/motion/goal_approach.hpp"
#include "pushplan/motion/random_tree/steering.hpp"
#include "pushplan/motion/recovery.hpp"
#include "pushplan/motion/room_ahead.hpp"
#include "pushplan/motion/shortcutting.hpp"
#include "pushplan/motion/speed_profile.hpp"
#include "pushplan/motion/turn_on_spot.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

namespace {

void bind_collision(nb::module_& module) {
  nb::class_<Footprint>(module, "Footprint", "Convex parts of a robot.")
      .def(
          "__init__",
          [](Footprint* self, const Points& vertices, const Integers<1>& offsets, double radius) {
            new (self) Footprint{polygons(vertices, offsets), radius};
          },
          "vertices"_a.noconvert(), "offsets"_a.noconvert(), "radius"_a, nb::keep_alive<1, 2>(),
          nb::keep_alive<1, 3>())
      .def_ro("radius", &Footprint::radius);
  nb::class_<ConvexObstacles>(module, "ConvexObstacles", "Convex polygons in groups of neighbours.")
      .def(
          "__init__",
          [](ConvexObstacles* self, const Points& vertices, const Integers<1>& offsets,
             const Floats<2>& boxes, const Floats<2>& groups, const Numbers<4>& bounds) {
            const Polygons shapes = polygons(vertices, offsets);
            require_count("boxes", boxes.shape(0), shapes.count());
            constexpr Index kGroup = ConvexObstacles::kGroup;
            require_count("groups", groups.shape(0), (shapes.count() + kGroup - 1) / kGroup);
            new (self)
                ConvexObstacles{shapes, rows_as<const Box>(boxes), rows_as<const Box>(groups),
                                *reinterpret_cast<const Box*>(bounds.data())};
          },
          "vertices"_a.noconvert(), "offsets"_a.noconvert(), "boxes"_a.noconvert(),
          "groups"_a.noconvert(), "bounds"_a.noconvert(), nb::keep_alive<1, 2>(),
          nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>(), nb::keep_alive<1, 5>())
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
  nb::class_<CollisionChecker>(module, "CollisionChecker",
                               "Checks of a footprint, with memory for one thread.")
      .def(nb::init<Footprint, ConvexObstacles>(), "footprint"_a, "obstacles"_a,
           nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>())
      .def(
          "is_free",
          [](CollisionChecker& self, const OnePose& at) { return self.is_free(pose(at)); },
          "pose"_a.noconvert())
      .def(
          "first_blocked",
          [](CollisionChecker& self, const Poses& path) { return self.first_blocked(poses(path)); },
          "poses"_a.noconvert(), ReleaseGil())
      .def(
          "depth", [](CollisionChecker& self, const OnePose& at) { return self.depth(pose(at)); },
          "pose"_a.noconvert());
  nb::class_<EndTurns>(module, "EndTurns", "How a robot turns at the end of a path.")
      .def(nb::init<bool, bool, double, double>(), "on_spot"_a, "reverses"_a, "radius"_a,
           "spacing"_a);
  module.def(
      "run_up",
      [](const Numbers<5>& goal, const EndTurns& turns, double size, CollisionChecker& checker) {
        return run_up(goal_region(goal), turns, size, checker);
      },
      "goal"_a.noconvert(), "turns"_a, "size"_a, "checker"_a);
  module.def(
      "path_end",
      [](const Numbers<5>& goal, const Poses& path, const EndTurns& turns, double straight,
         CollisionChecker& checker) {
        require_room("path", path.shape(0), 1);
        std::optional<PathEnd> end =
            path_end(goal_region(goal), poses(path), turns, straight, checker);
        if (!end) end = PathEnd{0, {}, {}};
        return std::tuple(end->kept, copied_rows<double>(std::span<const Pose>(end->poses)),
                          copied(std::span<const double>(end->curvatures)));
      },
      "goal"_a.noconvert(), "path"_a.noconvert(), "turns"_a, "straight"_a, "checker"_a,
      "Poses kept (0 for none), and the poses and curvatures after them.");
}

/// Requires a path of `count` poses among the objects of a model, of which `first` is one.
void require_swept(const SweptPath& path, Index first, Index count, std::size_t objects) {
  require_between("count", count, 1, static_cast<Index>(path.poses.size()));
  require_index("first", first, count);
  require_count("objects of path", objects, path.objects.extent(1));
}

/// Uniform draws of at least 0 and below 1.
template <class T>
std::span<const T> unit_draws(const Floats<2>& draws) {
  for (const double draw : std::span(draws.data(), draws.size())) {
    if (!(draw >= 0.0 && draw < 1.0)) refuse("draws", std::to_string(draw), "in [0, 1)");
  }
  return rows_as<const T>(draws);
}

/// What depends on the model of interaction.
template <InteractionModel M>
void bind_sweeps(nb::module_& module) {
  module.def(
      "sweep_cost",
      [](const SweptPath& path, Index first, Index count, double limit, Index patience,
         const PathProblem& problem, M& model) {
        require_swept(path, first, count, model.radii().size());
        return PathSweep<M>(problem, model).cost(path, first, count, limit, patience);
      },
      "path"_a, "first"_a, "count"_a, "limit"_a, "patience"_a, "problem"_a, "model"_a,
      ReleaseGil());
  module.def(
      "shortcut",
      [](const SweptPath& path, Index count, double cost, const Floats<2>& draws,
         const Floats<2>& normals, const SweptPath& trial, const PathProblem& problem, M& model) {
        require_swept(path, 0, count, model.radii().size());
        require_swept(trial, 0, count, model.radii().size());
        require_room("path", path.poses.size(), trial.poses.size());
        require_count("normals", normals.shape(0), draws.shape(0));
        const PricedPath found =
            shortcut(path, {count, cost}, unit_draws<ShortcutDraw>(draws),
                     rows_as<const ShortcutShift>(normals), trial, problem, model);
        return std::pair(found.count, found.cost);
      },
      "path"_a, "count"_a, "cost"_a, "draws"_a.noconvert(), "normals"_a.noconvert(), "trial"_a,
      "problem"_a, "model"_a, ReleaseGil());
  module.def(
      "turn_freely",
      [](const PathProblem& problem, M& model, const OnePose& start, const Poses& objects,
         double angle, const PosesOut& out) {
        require_count("objects", objects.shape(0), model.radii().size());
        require_room("out", out.shape(0), objects.shape(0));
        const SpotTurn turn = turn_freely(problem, model, pose(start), poses(objects), angle);
        std::copy(turn.objects.begin(), turn.objects.end(), poses(out).begin());
        return std::pair(turn.angle, turn.error);
      },
      "problem"_a, "model"_a, "start"_a.noconvert(), "objects"_a.noconvert(), "angle"_a,
      "out"_a.noconvert(), ReleaseGil());
}

void bind_problems(nb::module_& module) {
  nb::class_<PriceGrid>(module, "PriceGrid", "Prices of places.")
      .def(
          "__init__",
          [](PriceGrid* self, const Floats<2>& prices, const OnePose& origin, double cell) {
            new (self) PriceGrid{view(prices), pose(origin), cell};
          },
          "prices"_a.noconvert(), "origin"_a.noconvert(), "cell"_a, nb::keep_alive<1, 2>());
  nb::class_<PathProblem>(module, "PathProblem", "Costs and constraints of a path.")
      .def(
          "__init__",
          [](PathProblem* self, double robot_mass, double push_weight, double turning_radius,
             double spacing, double jam_length, double displacement, const Numbers<5>& goal,
             const Footprint& footprint, const ConvexObstacles& walls, const PriceGrid* price,
             bool reverses, bool slides) {
            const Connection curves = reverses ? Connection::kReedsShepp : Connection::kDubins;
            const Connection connection = slides ? Connection::kStraight : curves;
            new (self)
                PathProblem{robot_mass,   push_weight,       turning_radius, spacing, jam_length,
                            displacement, goal_region(goal), footprint,      walls,   connection};
            if (price != nullptr) self->price = *price;
          },
          "robot_mass"_a, "push_weight"_a, "turning_radius"_a, "spacing"_a, "jam_length"_a,
          "displacement"_a, "goal"_a.noconvert(), "footprint"_a, "walls"_a, "price"_a = nb::none(),
          "reverses"_a = false, "slides"_a = false, nb::keep_alive<1, 9>(), nb::keep_alive<1, 10>(),
          nb::keep_alive<1, 11>());
  nb::class_<SweptPath>(module, "SweptPath", "A path with the objects that it sweeps.")
      .def(
          "__init__",
          [](SweptPath* self, const PosesOut& path, const FloatsOut<1>& curvatures,
             const FloatsOut<3>& objects, const FloatsOut<1>& lengths, const FloatsOut<1>& works) {
            const std::size_t count = path.shape(0);
            require_count("curvatures", curvatures.shape(0), count);
            require_count("objects", objects.shape(0), count);
            require_count("lengths", lengths.shape(0), count);
            require_count("works", works.shape(0), count);
            new (self) SweptPath{poses(path), view(curvatures), grid_as<Pose>(objects),
                                 view(lengths), view(works)};
          },
          "poses"_a.noconvert(), "curvatures"_a.noconvert(), "objects"_a.noconvert(),
          "lengths"_a.noconvert(), "works"_a.noconvert(), nb::keep_alive<1, 2>(),
          nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>(), nb::keep_alive<1, 5>(),
          nb::keep_alive<1, 6>());
  module.def(
      "lay_out",
      [](const OnePose& start, const Floats<2>& arcs, const SweptPath& path,
         const PathProblem& problem) {
        require_room("path", path.poses.size(), 1);
        return lay_out(pose(start), rows_as<const Arc>(arcs), path, problem);
      },
      "start"_a.noconvert(), "arcs"_a.noconvert(), "path"_a, "problem"_a);
  bind_sweeps<QuasiStatic>(module);
  bind_sweeps<IceInteraction>(module);
  bind_sweeps<CalledInteraction>(module);
}

void bind_speed_profile(nb::module_& module) {
  nb::class_<SpeedLimits>(module, "SpeedLimits", "Limits of a robot along a path.")
      .def(nb::init<double, double, double, double, double, double, bool, double, double>(),
           "size"_a, "max_speed"_a, "min_speed"_a, "turn_rate"_a, "max_acceleration"_a,
           "max_turn_acceleration"_a, "can_stop"_a, "driven_speed"_a, "driven_turn_rate"_a);
  module.def(
      "fill_speed_profile",
      [](const Poses& path, const Floats<1>& curvatures, const Floats<1>& chords,
         const SpeedLimits& limits, const FloatsOut<1>& times, const FloatsOut<1>& speeds,
         const FloatsOut<1>& turn_rates) {
        const std::size_t count = path.shape(0);
        require_room("path", count, 1);
        require_count("curvatures", curvatures.shape(0), count);
        require_count("chords", chords.shape(0), count - 1);
        require_count("times", times.shape(0), count);
        require_count("speeds", speeds.shape(0), count);
        require_count("turn_rates", turn_rates.shape(0), count);
        fill_speed_profile({poses(path), view(curvatures)}, view(chords), limits,
                           {view(times), view(speeds), view(turn_rates)});
      },
      "path"_a.noconvert(), "curvatures"_a.noconvert(), "chords"_a.noconvert(), "limits"_a,
      "times"_a.noconvert(), "speeds"_a.noconvert(), "turn_rates"_a.noconvert());
}

constexpr Index kMostBoxes = 30'000;  // of poses, in each direction

/// An exploration with the moves that it tries.
struct OwnRoomExploration {
  std::vector<Arc> moves;
  RoomExploration search;
};

void bind_ways_out(nb::module_& module) {
  module.def(
      "add_cell_weights",
      [](const FloatsOut<2>& out, double x, double y, double cell, const Points& vertices,
         const Integers<1>& offsets, const Integers<2>& within, const Floats<1>& reach,
         const Floats<1>& weight) {
        const Polygons shapes = polygons(vertices, offsets);
        require_count("within", within.shape(0), shapes.count());
        require_count("reach", reach.shape(0), shapes.count());
        require_count("weight", weight.shape(0), shapes.count());
        add_cell_weights(view(out), {{x, y}, cell}, shapes, rows_as<const CellBox>(within),
                         {view(reach), view(weight)});
      },
      "out"_a.noconvert(), "x"_a, "y"_a, "cell"_a, "vertices"_a.noconvert(),
      "offsets"_a.noconvert(), "within"_a.noconvert(), "reach"_a.noconvert(),
      "weight"_a.noconvert(), ReleaseGil());
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
      "start"_a.noconvert(), "steps"_a.noconvert(), "body"_a, "grown"_a, "among"_a, "size"_a,
      kOwned);
  nb::enum_<RoomExploration::Outcome>(module, "RoomOutcome", "What an exploration has found out.")
      .value("AWAY", RoomExploration::Outcome::kAway)
      .value("CLOSED", RoomExploration::Outcome::kClosed)
      .value("PAUSED", RoomExploration::Outcome::kPaused);
  nb::class_<OwnRoomExploration>(module, "RoomExploration",
                                 "A search for a way to get away, in batches.")
      .def(
          "__init__",
          [](OwnRoomExploration* self, const Footprint& footprint, const ConvexObstacles& walls,
             const Numbers<5>& goal, double spacing, const Floats<2>& moves, double reach,
             double clearance, bool breadth, const OnePose& start, double side, double turn,
             Index half, Index headings, Index capacity) {
            require_between("half", half, 0, kMostBoxes);
            require_between("headings", headings, 1, kMostBoxes);
            const auto given = rows_as<const Arc>(moves);
            std::vector<Arc> own(given.begin(), given.end());
            const RoomRules rules{own, reach, clearance, breadth};
            RoomExploration search({footprint, walls, goal_region(goal), spacing}, rules,
                                   pose(start), {side, turn, half, headings}, capacity);
            new (self) OwnRoomExploration{std::move(own), std::move(search)};
          },
          "footprint"_a, "walls"_a, "goal"_a.noconvert(), "spacing"_a, "moves"_a.noconvert(),
          "reach"_a, "clearance"_a, "breadth"_a, "start"_a.noconvert(), "side"_a, "turn"_a,
          "half"_a, "headings"_a, "capacity"_a, nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>())
      .def(
          "run", [](OwnRoomExploration& self, Index upto) { return self.search.run(upto); },
          "upto"_a, ReleaseGil())
      .def_prop_ro(
          "arcs",
          [](const OwnRoomExploration& self) {
            const std::vector<Arc> arcs = self.search.arcs();
            return copied_rows<double>(std::span<const Arc>(arcs));
          },
          kOwned);
  nb::class_<Steering>(module, "Steering", "Edges of a random tree, with memory for one thread.")
      .def(
          "__init__",
          [](Steering* self, double max_curvature, double edge_length, double spacing,
             double turn_weight, const Footprint& footprint, const ConvexObstacles& among) {
            new (self)
                Steering({max_curvature, edge_length, spacing, turn_weight}, footprint, among);
          },
          "max_curvature"_a, "edge_length"_a, "spacing"_a, "turn_weight"_a, "footprint"_a,
          "among"_a, nb::keep_alive<1, 6>(), nb::keep_alive<1, 7>())
      .def(
          "steer",
          [](Steering& self, const OnePose& start, const OnePose& target, double sampled,
             double backward, const OnePoseOut& out) {
            const SteeredArc found = self.steer(pose(start), pose(target), sampled, backward);
            if (found.arc.length != 0.0) *reinterpret_cast<Pose*>(out.data()) = found.end;
            return std::pair(found.arc.curvature, found.arc.length);
          },
          "start"_a.noconvert(), "target"_a.noconvert(), "sampled"_a, "backward"_a,
          "out"_a.noconvert());
}

}  // namespace

void bind_motion_paths(nb::module_& module) {
  bind_collision(module);
  bind_problems(module);
  bind_speed_profile(module);
  bind_ways_out(module);
}

}  // namespace pushplan::bindings
