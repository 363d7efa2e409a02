#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>

#include "arrays.hpp"
#include "pushplan/planners/rearrangement/controller.hpp"
#include "pushplan/planners/rearrangement/cost_to_go.hpp"
#include "pushplan/planners/rearrangement/goal.hpp"
#include "pushplan/planners/rearrangement/pose_grid.hpp"
#include "pushplan/planners/rearrangement/pose_search.hpp"
#include "pushplan/planners/rearrangement/push_pose.hpp"
#include "pushplan/planners/rearrangement/push_rollout.hpp"
#include "pushplan/planners/rearrangement/route.hpp"

namespace pushplan::bindings {

using namespace nb::literals;
using namespace pushplan::rearrangement;

namespace {

using Bools = Array<const bool, 1>;

Index extent(const auto& array, std::size_t axis) { return static_cast<Index>(array.shape(axis)); }

ArrayView<Pose, 2> pose_matrix(const FloatsOut<3>& array) {
  return {reinterpret_cast<Pose*>(array.data()), {extent(array, 0), extent(array, 1)}};
}

ArrayView<Pose, 3> pose_matrices(const FloatsOut<4>& array) {
  return {reinterpret_cast<Pose*>(array.data()),
          {extent(array, 0), extent(array, 1), extent(array, 2)}};
}

void bind_goal(nb::module_& module) {
  nb::class_<ObjectGoal>(module, "ObjectGoal", "The goal of the objects.")
      .def(
          "__init__",
          [](ObjectGoal* self, const Points& polygon, const Floats<2>& edges, bool is_receptacle,
             double slack) {
            new (self) ObjectGoal{points(polygon), rows_as<const GoalEdge>(edges), is_receptacle,
                                  slack};
          },
          "polygon"_a.noconvert(), "edges"_a.noconvert(), "is_receptacle"_a, "slack"_a,
          nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>());
  module.def(
      "all_done",
      [](const Poses& objects, const Bodies& bodies, const ObjectGoal& goal,
         const Array<bool, 1>& out) {
        GoalTest(bodies.objects, goal).all_done(poses(objects), view(out));
      },
      "poses"_a.noconvert(), "bodies"_a, "goal"_a, "out"_a.noconvert(), ReleaseGil());
  module.def(
      "fill_cost_to_go",
      [](const Floats<2>& costs, const Integers<1>& delivers, Index objects,
         const FloatsOut<2>& best, const IntegersOut<2>& following) {
        fill_cost_to_go(view(costs), view(delivers), objects, {view(best), view(following)});
      },
      "costs"_a.noconvert(), "delivers"_a.noconvert(), "objects"_a, "best"_a.noconvert(),
      "following"_a.noconvert(), ReleaseGil());
}

void bind_grid(nb::module_& module) {
  nb::class_<PoseGrid>(module, "PoseGrid", "A lattice of poses over a static map.")
      .def(
          "__init__",
          [](PoseGrid* self, double x, double y, double step, const Array<const bool, 3>& blocked,
             const Array<const bool, 4>& blocked_moves) {
            new (self) PoseGrid{{x, y}, step, view(blocked), view(blocked_moves)};
          },
          "x"_a, "y"_a, "step"_a, "blocked"_a.noconvert(), "blocked_moves"_a.noconvert(),
          nb::keep_alive<1, 5>(), nb::keep_alive<1, 6>());
  module.def(
      "block_poses",
      [](const PoseGrid& grid, const Footprint& shape, const ConvexObstacles& among,
         const Array<bool, 3>& blocked) {
        CollisionChecker checker(shape, among);
        block_poses(grid, checker, view(blocked));
      },
      "grid"_a, "shape"_a, "among"_a, "blocked"_a.noconvert(), ReleaseGil());
  module.def(
      "block_moves",
      [](const PoseGrid& grid, const Footprint& shape, const ConvexObstacles& among,
         const Array<bool, 4>& blocked_moves) {
        CollisionChecker checker(shape, among);
        block_moves(grid, checker, view(blocked_moves));
      },
      "grid"_a, "shape"_a, "among"_a, "blocked_moves"_a.noconvert(), ReleaseGil());
  module.def(
      "near_poses",
      [](const PoseGrid& grid, const OnePose& at, double reach) {
        const PoseCosts found = near_poses(grid, pose(at), reach);
        return nb::make_tuple(copied(std::span(found.nodes)), copied(std::span(found.costs)));
      },
      "grid"_a, "pose"_a.noconvert(), "reach"_a);
  module.def(
      "contact_depths",
      [](const PoseGrid& grid, const Footprint& shape, const Poses& objects, const Bodies& bodies,
         const Array<float, 4>& out) {
        contact_depths(grid, shape, poses(objects), bodies.objects, bodies.radii, view(out));
      },
      "grid"_a, "shape"_a, "poses"_a.noconvert(), "bodies"_a, "out"_a.noconvert(), ReleaseGil());
  module.def(
      "add_layers",
      [](const Array<const float, 4>& layers, const Floats<1>& weights, const FloatsOut<3>& depth,
         const FloatsOut<3>& touch) {
        add_layers(view(layers), view(weights), view(depth), view(touch));
      },
      "layers"_a.noconvert(), "weights"_a.noconvert(), "depth"_a.noconvert(),
      "touch"_a.noconvert(), ReleaseGil());
  module.def(
      "search_poses",
      [](const PoseGrid& grid, const Integers<1>& starts, const Floats<1>& start_costs,
         const Floats<3>& depths, const Floats<3>& touch, double turn_cost, double arm,
         const Integers<1>& targets, const FloatsOut<1>& costs, const IntegersOut<1>& before) {
        PoseSearch search({grid, view(depths), view(touch), turn_cost, arm}, view(costs),
                          view(before));
        search.run({view(starts), view(start_costs)}, view(targets));
      },
      "grid"_a, "starts"_a.noconvert(), "start_costs"_a.noconvert(), "depths"_a.noconvert(),
      "touch"_a.noconvert(), "turn_cost"_a, "arm"_a, "targets"_a.noconvert(),
      "costs"_a.noconvert(), "before"_a.noconvert(), ReleaseGil());
  module.def(
      "least_costs",
      [](const Floats<1>& costs, const Integers<1>& nodes, const Floats<1>& extra,
         const Integers<1>& ends, const FloatsOut<1>& out) {
        least_costs(view(costs), {view(nodes), view(extra), view(ends)}, view(out));
      },
      "costs"_a.noconvert(), "nodes"_a.noconvert(), "extra"_a.noconvert(), "ends"_a.noconvert(),
      "out"_a.noconvert(), ReleaseGil());
}

void bind_poses(nb::module_& module) {
  module.def(
      "pose_behind",
      [](const OnePose& object, const Points& outline, double heading, double shift,
         double distance, const FloatsOut<1>& out) {
        *reinterpret_cast<Pose*>(out.data()) =
            pose_behind(pose(object), points(outline), heading, shift, distance);
      },
      "pose"_a.noconvert(), "outline"_a.noconvert(), "heading"_a, "shift"_a, "distance"_a,
      "out"_a.noconvert());
  module.def(
      "pushable_moves",
      [](const Floats<3>& middles, const Array<const bool, 2>& is_open, const Floats<1>& shifts,
         double distance, const Footprint& shape, const ConvexObstacles& among,
         const Array<bool, 3>& out) {
        CollisionChecker checker(shape, among);
        const auto* corners = reinterpret_cast<const Vec2*>(middles.data());
        pushable_moves({corners, {extent(middles, 0), extent(middles, 1)}}, view(is_open),
                       view(shifts), distance, checker, view(out));
      },
      "middles"_a.noconvert(), "is_open"_a.noconvert(), "shifts"_a.noconvert(), "distance"_a,
      "shape"_a, "among"_a, "out"_a.noconvert(), ReleaseGil());
  module.def(
      "cheapest_legs",
      [](const Points& line, double heading, double end, Index first, Index longest, double step,
         double turn_cost, double arm, const Footprint& shape, const Footprint& tight,
         const ConvexObstacles& among, const Poses& objects, const Bodies& bodies,
         const Floats<1>& weights) {
        const Legs legs = [&] {
          nb::gil_scoped_release released;
          RouteSearch search({step, turn_cost, arm}, shape, tight, among,
                             {poses(objects), bodies.objects, bodies.radii, view(weights)});
          return search.cheapest_legs(points(line), heading, end, first, longest);
        }();
        return nb::make_tuple(copied(std::span<const double>(legs.costs)),
                              copied(std::span(legs.before)),
                              copied_rows<double>(std::span(legs.turns)));
      },
      "points"_a.noconvert(), "heading"_a, "end"_a, "first"_a, "longest"_a, "step"_a,
      "turn_cost"_a, "arm"_a, "shape"_a, "tight"_a, "among"_a, "poses"_a.noconvert(), "bodies"_a,
      "weights"_a.noconvert());
}

void bind_pushes(nb::module_& module) {
  nb::class_<PushingController>(module, "PushingController",
                                "Parameters of the geometric pushing controller.")
      .def(
          "__init__",
          [](PushingController* self, double step, double turn, double size, double half_width,
             double front, double ahead, double gain) {
            new (self) PushingController{step, turn, size, half_width, front, ahead, gain};
          },
          "step"_a, "turn"_a, "size"_a, "half"_a, "front"_a, "ahead"_a, "gain"_a)
      .def(
          "is_on_bumper",
          [](const PushingController& self, const OnePose& robot, const OnePose& object) {
            return self.on_bumper(pose(robot), pose(object));
          },
          "robot"_a.noconvert(), "target"_a.noconvert())
      .def(
          "steer_push",
          [](const PushingController& self, const OnePose& robot, const OnePose& object,
             const Points& path, double reached, double shift) {
            const PushCommand command =
                steer_push(pose(robot), pose(object), points(path), reached, shift, self);
            return nb::make_tuple(command.step, command.turn, command.reached, command.holds);
          },
          "robot"_a.noconvert(), "target"_a.noconvert(), "path"_a.noconvert(), "reached"_a,
          "shift"_a);
  module.def(
      "along_path",
      [](double x, double y, const Points& path, double reached, double ahead) {
        const Carrot carrot = along_path({x, y}, points(path), reached, ahead);
        return nb::make_tuple(carrot.point.x, carrot.point.y, carrot.reached, carrot.distance);
      },
      "x"_a, "y"_a, "path"_a.noconvert(), "reached"_a, "ahead"_a);

  nb::class_<QuasiStaticSettings>(module, "QuasiStaticSettings")
      .def(
          "__init__",
          [](QuasiStaticSettings* self, double max_step, double tolerance, double jam_depth,
             Index iterations, double friction, double static_friction) {
            new (self) QuasiStaticSettings{max_step,   tolerance, jam_depth,
                                           iterations, friction,  static_friction};
          },
          "max_step"_a, "tolerance"_a, "jam_depth"_a, "iterations"_a, "friction"_a,
          "static_friction"_a);
  nb::class_<PushRollout>(module, "PushRollout", "Rollouts of pushes, with memory for one thread.")
      .def(nb::init<const Bodies&, const QuasiStaticSettings&, const ObjectGoal&>(), "bodies"_a,
           "settings"_a, "goal"_a, nb::keep_alive<1, 2>(), nb::keep_alive<1, 4>())
      .def(
          "run",
          [](PushRollout& self, const OnePose& start, const Poses& objects, Index target,
             const Points& path, double shift, double limit, const Bools& wanted,
             const PushingController& controller, const PosesOut& track,
             const IntegersOut<1>& steps, const FloatsOut<3>& stage_poses,
             const FloatsOut<2>& stage_lengths, const FloatsOut<1>& box) {
            const RolloutSize size =
                self.run(pose(start), poses(objects),
                         {target, points(path), shift, limit, view(wanted)}, controller,
                         {poses(track), view(steps), pose_matrix(stage_poses),
                          view(stage_lengths), reinterpret_cast<Box*>(box.data())});
            return std::pair{size.stages, size.poses};
          },
          "start"_a.noconvert(), "poses"_a.noconvert(), "target"_a, "path"_a.noconvert(),
          "shift"_a, "limit"_a, "wanted"_a.noconvert(), "controller"_a, "track"_a.noconvert(),
          "steps"_a.noconvert(), "stage_poses"_a.noconvert(), "stage_lengths"_a.noconvert(),
          "box"_a.noconvert(), ReleaseGil());
  module.def(
      "sweep_arcs",
      [](QuasiStatic& model, const OnePose& start, const Poses& objects, const Floats<2>& arcs,
         Index target, double size, double least, const FloatsOut<3>& tracks,
         const FloatsOut<4>& out) {
        ArcSweep sweep{pose_matrix(tracks), pose_matrices(out)};
        {
          nb::gil_scoped_release released;
          sweep_arcs(model, pose(start), poses(objects), rows_as<const ArcStep>(arcs),
                     {target, size, least}, sweep);
        }
        return copied_rows<Index>(std::span<const ArcSweep::Mark>(sweep.marks));
      },
      "model"_a, "start"_a.noconvert(), "poses"_a.noconvert(), "arcs"_a.noconvert(), "target"_a,
      "size"_a, "least"_a, "tracks"_a.noconvert(), "out"_a.noconvert(), kOwned);
}

}  // namespace

void bind_rearrangement(nb::module_& module) {
  bind_goal(module);
  bind_grid(module);
  bind_poses(module);
  bind_pushes(module);
}

}  // namespace pushplan::bindings
