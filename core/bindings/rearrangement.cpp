#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>

#include <algorithm>
#include <array>
#include <memory>
#include <tuple>
#include <utility>

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
template <class T, std::size_t Rank>
using Numpy = nb::ndarray<nb::numpy, T, nb::ndim<Rank>>;

Index extent(const auto& array, std::size_t axis) { return static_cast<Index>(array.shape(axis)); }

/// Zeros to fill, which Python gets as an array of its own.
template <class T, std::size_t Rank>
class OwnedArray {
 public:
  using Shape = typename ArrayView<T, Rank>::Shape;

  explicit OwnedArray(const Shape& shape) : view_(nullptr, shape) {
    numbers_ = std::make_unique<T[]>(static_cast<std::size_t>(view_.size()));
    view_ = {numbers_.get(), shape};
  }

  ArrayView<T, Rank> view() const { return view_; }
  std::span<T> numbers() const { return {numbers_.get(), static_cast<std::size_t>(view_.size())}; }
  /// The same as structures of such numbers.
  template <class Struct>
  Struct* as() const {
    return reinterpret_cast<Struct*>(numbers_.get());
  }

  /// Gives the array, or the part of it that has only so many of its rows, to Python.
  Numpy<T, Rank> give(Index rows = -1) {
    std::array<std::size_t, Rank> shape;
    for (std::size_t axis = 0; axis < Rank; ++axis) {
      shape[axis] = static_cast<std::size_t>(view_.extent(axis));
    }
    if (rows >= 0) shape[0] = static_cast<std::size_t>(rows);
    T* data = numbers_.release();
    nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<T*>(p); });
    return Numpy<T, Rank>(data, Rank, shape.data(), owner);
  }

 private:
  std::unique_ptr<T[]> numbers_;
  ArrayView<T, Rank> view_;
};

/// Calls a function that needs no Python while other threads may run some.
void without_gil(const auto& call) {
  nb::gil_scoped_release released;
  call();
}

/// Requires as many poses as there are objects.
void require_objects(const Poses& poses, const Bodies& bodies) {
  require_count("poses", poses.shape(0), bodies.radii.size());
}

/// A path of at least one point.
std::span<const Vec2> path_of(const Points& path) {
  require_room("path", path.shape(0), 1);
  return points(path);
}

void bind_goal(nb::module_& module) {
  nb::class_<ObjectGoal>(module, "ObjectGoal", "The goal of the objects.")
      .def(
          "__init__",
          [](ObjectGoal* self, const Points& polygon, const Floats<2>& edges, bool is_receptacle,
             double slack) {
            new (self)
                ObjectGoal{points(polygon), rows_as<const GoalEdge>(edges), is_receptacle, slack};
          },
          "polygon"_a, "edges"_a, "is_receptacle"_a, "slack"_a, nb::keep_alive<1, 2>(),
          nb::keep_alive<1, 3>());
  module.def(
      "all_done",
      [](const Poses& objects, const Bodies& bodies, const ObjectGoal& goal) {
        require_objects(objects, bodies);
        OwnedArray<bool, 1> done({extent(objects, 0)});
        without_gil(
            [&] { GoalTest(bodies.shapes, goal).all_done(poses(objects), done.numbers()); });
        return done.give();
      },
      "poses"_a, "bodies"_a, "goal"_a, kOwned, "(K,) whether each object is where it belongs.");
  module.def(
      "cost_to_go",
      [](const Floats<2>& costs, const Integers<1>& delivers, Index objects) {
        require_between("objects", objects, 0, kMaxExact);
        require_indices("delivers", view(delivers), Index{1} << objects);
        require_count("costs", costs.shape(0), delivers.shape(0) + 1);
        require_count("columns of costs", costs.shape(1), delivers.shape(0));
        const OwnedArray<double, 2>::Shape shape{Index{1} << objects, extent(costs, 0)};
        OwnedArray<double, 2> best(shape);
        OwnedArray<Index, 2> following(shape);
        without_gil([&] {
          fill_cost_to_go(view(costs), view(delivers), objects, {best.view(), following.view()});
        });
        return std::pair(best.give(), following.give());
      },
      "costs"_a, "delivers"_a, "objects"_a,
      "(2^objects, N + 1) cost of delivering the rest, and the push to follow or -1, by what is "
      "delivered and the last push; N for none.");
  module.attr("MAX_OBJECTS") = kMaxObjects;
  module.attr("MAX_EXACT") = kMaxExact;
  module.attr("REMOVED") = kRemoved;
}

/// A lattice with memory of its own.
struct OwnedGrid {
  std::unique_ptr<bool[]> blocked;
  std::unique_ptr<bool[]> blocked_moves;
  PoseGrid grid;
};

OwnedGrid make_grid(Vec2 origin, double step, Index rows, Index columns,
                    CollisionChecker& checker) {
  constexpr Index kHeadings = kHeadingCount;
  const ArrayView<bool, 3>::Shape shape{kHeadings, rows, columns};
  const ArrayView<bool, 4>::Shape moves{2, kHeadings, rows, columns};
  const auto count = static_cast<std::size_t>(kHeadings * rows * columns);
  OwnedGrid made{std::make_unique<bool[]>(count), std::make_unique<bool[]>(2 * count), {}};
  const ArrayView<bool, 3> blocked(made.blocked.get(), shape);
  const ArrayView<bool, 4> blocked_moves(made.blocked_moves.get(), moves);
  made.grid = {origin, step, blocked, blocked_moves};
  block_poses(made.grid, checker, blocked);
  block_moves(made.grid, checker, blocked_moves);
  return made;
}

template <std::size_t Rank>
Numpy<const bool, Rank> shown(ArrayView<const bool, Rank> view, nb::handle owner) {
  std::array<std::size_t, Rank> shape;
  std::copy(view.shape().begin(), view.shape().end(), shape.begin());
  return Numpy<const bool, Rank>(view.data(), Rank, shape.data(), owner);
}

constexpr Index kMostCells = 30'000;  // of a row or a column

void bind_grid(nb::module_& module) {
  nb::class_<OwnedGrid>(module, "PoseGrid",
                        "A lattice of poses over a static map; cell (i, j) has its middle at "
                        "(x, y) + (j, i) * step.")
      .def(
          "__init__",
          [](OwnedGrid* self, double x, double y, double step, Index rows, Index columns,
             const Footprint& shape, const ConvexObstacles& among) {
            require_between("rows", rows, 0, kMostCells);
            require_between("columns", columns, 0, kMostCells);
            if (!(step > 0.0)) refuse("step", std::to_string(step), "positive");
            CollisionChecker checker(shape, among);
            new (self) OwnedGrid(make_grid({x, y}, step, rows, columns, checker));
          },
          "x"_a, "y"_a, "step"_a, "rows"_a, "columns"_a, "shape"_a, "among"_a, ReleaseGil())
      .def_prop_ro("x", [](const OwnedGrid& self) { return self.grid.origin.x; })
      .def_prop_ro("y", [](const OwnedGrid& self) { return self.grid.origin.y; })
      .def_prop_ro("step", [](const OwnedGrid& self) { return self.grid.step; })
      .def_prop_ro(
          "blocked",
          [](nb::handle_t<OwnedGrid> self) {
            return shown(nb::cast<const OwnedGrid&>(self).grid.blocked, self);
          },
          "(16, rows, columns) where something static is in the way.")
      .def_prop_ro(
          "blocked_moves",
          [](nb::handle_t<OwnedGrid> self) {
            return shown(nb::cast<const OwnedGrid&>(self).grid.blocked_moves, self);
          },
          "(2, 16, rows, columns) from where it is in the way of the move ahead, and of the turn to "
          "the next heading.")
      .def(
          "near_poses",
          [](const OwnedGrid& self, const OnePose& at, double reach) {
            const PoseCosts found = near_poses(self.grid, pose(at), reach);
            return std::pair(copied(std::span(found.nodes)), copied(std::span(found.costs)));
          },
          "pose"_a, "reach"_a,
          "Flat indices of free poses within `reach` cells, and the cost of going there [m].")
      .def(
          "contact_depths",
          [](const OwnedGrid& self, const Footprint& shape, const Poses& objects,
             const Bodies& bodies) {
            require_objects(objects, bodies);
            const PoseGrid& grid = self.grid;
            OwnedArray<float, 4> out({extent(objects, 0), static_cast<Index>(kHeadingCount),
                                      grid.rows(), grid.columns()});
            without_gil([&] {
              contact_depths(grid, shape, poses(objects), bodies.objects, bodies.radii, out.view());
            });
            return out.give();
          },
          "shape"_a, "poses"_a, "bodies"_a, kOwned,
          "(K, 16, rows, columns) depth of the footprint in each object [m].")
      .def(
          "search",
          [](const OwnedGrid& self, const Integers<1>& starts, const Floats<1>& start_costs,
             const Floats<3>& depths, const Floats<3>& touch, double turn_cost, double arm,
             const Integers<1>& targets) {
            for (const std::size_t axis : {0, 1, 2}) {
              require_count("depths", depths.shape(axis), self.grid.blocked.extent(axis));
              require_count("touch", touch.shape(axis), self.grid.blocked.extent(axis));
            }
            const auto count = static_cast<Index>(depths.size());
            require_count("start_costs", start_costs.shape(0), starts.shape(0));
            require_indices("starts", view(starts), count);
            require_indices("targets", view(targets), count);
            for (const double cost : view(start_costs)) require_not_negative("start_costs", cost);
            require_not_negative("turn_cost", turn_cost);
            require_not_negative("arm", arm);
            OwnedArray<double, 1> costs({count});
            OwnedArray<Index, 1> before({count});
            without_gil([&] {
              PoseSearch search({self.grid, view(depths), view(touch), turn_cost, arm},
                                costs.numbers(), before.numbers());
              search.run({view(starts), view(start_costs)}, view(targets));
            });
            return std::pair(costs.give(), before.give());
          },
          "starts"_a, "start_costs"_a, "depths"_a, "touch"_a, "turn_cost"_a, "arm"_a, "targets"_a,
          "Cost of each pose [m], and the pose before it, -1 for none. Ends with the last target.");
  module.def(
      "add_layers",
      [](const Array<const float, 4>& layers, const Floats<1>& weights) {
        require_count("weights", weights.shape(0), layers.shape(0));
        const OwnedArray<double, 3>::Shape shape{extent(layers, 1), extent(layers, 2),
                                                 extent(layers, 3)};
        OwnedArray<double, 3> depth(shape);
        OwnedArray<double, 3> touch(shape);
        without_gil([&] { add_layers(view(layers), view(weights), depth.view(), touch.view()); });
        return std::pair(depth.give(), touch.give());
      },
      "layers"_a, "weights"_a,
      "Depth in all objects of weight at each pose [m], and the weights of those it is in.");
  module.def(
      "least_costs",
      [](const Floats<1>& costs, const Integers<1>& nodes, const Floats<1>& extra,
         const Integers<1>& ends) {
        require_count("extra", extra.shape(0), nodes.shape(0));
        require_indices("nodes", view(nodes), extent(costs, 0));
        if (ends.shape(0) > 0) require_offsets("ends", view(ends), nodes.shape(0));
        OwnedArray<double, 1> out({extent(ends, 0)});
        least_costs(view(costs), {view(nodes), view(extra), view(ends)}, out.numbers());
        return out.give();
      },
      "costs"_a, "nodes"_a, "extra"_a, "ends"_a, kOwned,
      "(N,) cost of getting to places, each by those of the poses that end there [m].");
}

void bind_poses(nb::module_& module) {
  module.def(
      "pose_behind",
      [](const OnePose& object, const Points& outline, double heading, double shift,
         double distance) {
        OwnedArray<double, 1> out({3});
        *out.as<Pose>() = pose_behind(pose(object), points(outline), heading, shift, distance);
        return out.give();
      },
      "pose"_a, "outline"_a, "heading"_a, "shift"_a, "distance"_a, kOwned);
  module.def(
      "pushable_moves",
      [](const Floats<3>& middles, const Array<const bool, 2>& is_open, const Floats<1>& shifts,
         double distance, const Footprint& shape, const ConvexObstacles& among) {
        const auto centres = grid_as<const Vec2>(middles);
        require_count("rows of is_open", is_open.shape(0), centres.extent(0));
        require_count("columns of is_open", is_open.shape(1), centres.extent(1));
        OwnedArray<bool, 3> out(
            {static_cast<Index>(kHeadingCount), extent(middles, 0), extent(middles, 1)});
        without_gil([&] {
          CollisionChecker checker(shape, among);
          pushable_moves(centres, view(is_open), view(shifts), distance, checker, out.view());
        });
        return out.give();
      },
      "middles"_a, "is_open"_a, "shifts"_a, "distance"_a, "shape"_a, "among"_a, kOwned,
      "(16, rows, columns) whether the robot fits behind an object to push it along each heading.");
  module.def(
      "push_costs",
      [](const Array<const bool, 2>& is_open, const Array<const bool, 3>& pushable,
         const Integers<1>& goals, double step, double drag_cost) {
        require_count("headings of pushable", pushable.shape(0), kHeadingCount);
        require_count("rows of pushable", pushable.shape(1), is_open.shape(0));
        require_count("columns of pushable", pushable.shape(2), is_open.shape(1));
        require_not_negative("step", step);
        require_not_negative("drag_cost", drag_cost);
        OwnedArray<double, 2> out({extent(is_open, 0), extent(is_open, 1)});
        require_indices("goals", view(goals), out.view().size());
        without_gil([&] {
          fill_push_costs(view(is_open), view(pushable), view(goals), step, drag_cost, out.view());
        });
        return out.give();
      },
      "is_open"_a, "pushable"_a, "goals"_a, "step"_a, "drag_cost"_a, kOwned,
      "(rows, columns) cost of the cheapest path of an object from each cell to a goal [m].");
  nb::class_<RouteSearch>(module, "RouteSearch",
                          "Costs of motions among objects and walls, with memory for one thread.")
      .def(
          "__init__",
          [](RouteSearch* self, double step, double turn_cost, double arm, const Footprint& shape,
             const Footprint& tight, const ConvexObstacles& among, const Poses& objects,
             const Bodies& bodies, const Floats<1>& weights) {
            require_objects(objects, bodies);
            require_count("weights", weights.shape(0), objects.shape(0));
            new (self) RouteSearch({step, turn_cost, arm}, shape, tight, among,
                                   {poses(objects), bodies.objects, bodies.radii, view(weights)});
          },
          "step"_a, "turn_cost"_a, "arm"_a, "shape"_a, "tight"_a, "among"_a, "poses"_a, "bodies"_a,
          "weights"_a, nb::keep_alive<1, 5>(), nb::keep_alive<1, 6>(), nb::keep_alive<1, 7>(),
          nb::keep_alive<1, 8>(), nb::keep_alive<1, 9>(), nb::keep_alive<1, 10>())
      .def(
          "cheapest_legs",
          [](RouteSearch& self, const Points& line, double heading, double end, Index first,
             Index longest) {
            require_room("points", line.shape(0), 1);
            const Legs legs = [&] {
              nb::gil_scoped_release released;
              return self.cheapest_legs(points(line), heading, end, first, longest);
            }();
            return std::tuple(copied(std::span<const double>(legs.costs)),
                              copied(std::span(legs.before)),
                              copied_rows<double>(std::span(legs.turns)));
          },
          "points"_a, "heading"_a, "end"_a, "first"_a, "longest"_a,
          "Costs of ending ahead and back; the row before each row (2 i, 2 i + 1); (2 N, 2) turns "
          "before and after.");
}

constexpr Index kMostPoses = 10'000'000;  // of the robot

void bind_pushes(nb::module_& module) {
  nb::class_<PushingController>(module, "PushingController",
                                "Parameters of the geometric pushing controller.")
      .def(nb::init<double, double, double, double, double, double, double>(), "step"_a, "turn"_a,
           "size"_a, "half"_a, "front"_a, "ahead"_a, "gain"_a)
      .def_prop_ro("numbers",
                   [](const PushingController& self) {
                     return std::tuple(self.step, self.turn, self.size, self.half_width, self.front,
                                       self.ahead, self.gain);
                   })
      .def_ro("step", &PushingController::step, "Distance between two commands [m].")
      .def_ro("turn", &PushingController::turn, "Greatest turn in one step [rad].")
      .def_ro("ahead", &PushingController::ahead,
              "Look-ahead distance of the object on its path [m].")
      .def(
          "with_gain",
          [](PushingController self, double gain) {
            self.gain = gain;
            return self;
          },
          "gain"_a)
      .def(
          "is_on_bumper",
          [](const PushingController& self, const OnePose& robot, const OnePose& object) {
            return self.on_bumper(pose(robot), pose(object));
          },
          "robot"_a, "target"_a)
      .def(
          "steer_push",
          [](const PushingController& self, const OnePose& robot, const OnePose& object,
             const Points& path, double reached, double shift) {
            const PushCommand command =
                steer_push(pose(robot), pose(object), path_of(path), reached, shift, self);
            return std::tuple(command.step, command.turn, command.reached, command.holds);
          },
          "robot"_a, "target"_a, "path"_a, "reached"_a, "shift"_a,
          "Step [m], turn [rad], arc length now [m], and whether the object is on the bumper.");
  module.def(
      "along_path",
      [](double x, double y, const Points& path, double reached, double ahead) {
        const Carrot carrot = along_path({x, y}, path_of(path), reached, ahead);
        return std::tuple(carrot.point.x, carrot.point.y, carrot.reached, carrot.distance);
      },
      "x"_a, "y"_a, "path"_a, "reached"_a, "ahead"_a,
      "The point to head for, the arc length of the nearest one, and the distance to that [m].");

  nb::class_<PushRollout>(module, "PushRollout", "Rollouts of pushes, with memory for one thread.")
      .def(
          "__init__",
          [](PushRollout* self, const Bodies& bodies, const ObjectGoal& goal, double max_step,
             double tolerance, double jam_depth, Index iterations, double friction,
             double static_friction) {
            new (self) PushRollout(
                bodies, {max_step, tolerance, jam_depth, iterations, friction, static_friction},
                goal);
          },
          "bodies"_a, "goal"_a, "max_step"_a, "tolerance"_a, "jam_depth"_a, "iterations"_a,
          "friction"_a, "static_friction"_a, nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>())
      .def(
          "run",
          [](PushRollout& self, const OnePose& start, const Poses& objects, Index target,
             const Points& path, double shift, double limit, const Bools& wanted,
             const PushingController& controller, Index longest) {
            const Index count = extent(objects, 0);
            require_count("poses", objects.shape(0), self.count());
            require_count("wanted", wanted.shape(0), self.count());
            require_between("target", target, -1, count - 1);
            if (target >= 0) require_room("path", path.shape(0), 1);
            require_between("longest", longest, 1, kMostPoses);
            OwnedArray<double, 2> track({longest, 3});
            OwnedArray<Index, 1> steps({kStages});
            OwnedArray<double, 3> stages({kStages, count, 3});
            OwnedArray<double, 2> lengths({kStages, count});
            OwnedArray<double, 1> box({4});
            RolloutSize size{};
            without_gil([&] {
              size = self.run(pose(start), poses(objects),
                              {target, points(path), shift, limit, view(wanted)}, controller,
                              {{track.as<Pose>(), static_cast<std::size_t>(longest)},
                               steps.numbers(),
                               {stages.as<Pose>(), {kStages, count}},
                               lengths.view(),
                               box.as<Box>()});
            });
            const auto used = static_cast<std::size_t>(size.poses);
            return std::tuple(copied_rows<double>(std::span(track.as<const Pose>(), used)),
                              steps.give(size.stages), stages.give(size.stages),
                              lengths.give(size.stages), box.give());
          },
          "start"_a, "poses"_a, "target"_a, "path"_a, "shift"_a, "limit"_a, "wanted"_a,
          "controller"_a, "longest"_a,
          "(T, 3) poses of the robot, at most `longest`; (S,) how many of them each stage has; "
          "(S, K, 3) the objects and (S, K) their path lengths at its end [m]; (4,) the box around "
          "all that moved and its surroundings [m].");
  module.def(
      "sweep_arcs",
      [](QuasiStatic& model, const OnePose& start, const Poses& objects, const Floats<2>& arcs,
         Index steps, Index target, double size, double least) {
        const Index count = extent(objects, 0);
        require_objects(objects, model.bodies());
        require_index("target", target, count);
        require_between("steps", steps, 0, kMostPoses);
        OwnedArray<double, 3> tracks({extent(arcs, 0), steps + 1, 3});
        OwnedArray<double, 4> out({extent(arcs, 0), steps + 1, count, 3});
        ArcSweep sweep{{tracks.as<Pose>(), {extent(arcs, 0), steps + 1}},
                       {out.as<Pose>(), {extent(arcs, 0), steps + 1, count}}};
        without_gil([&] {
          sweep_arcs(model, pose(start), poses(objects), rows_as<const ArcStep>(arcs),
                     {target, size, least}, sweep);
        });
        return std::tuple(tracks.give(), out.give(),
                          copied_rows<Index>(std::span<const ArcSweep::Mark>(sweep.marks)));
      },
      "model"_a, "start"_a, "poses"_a, "arcs"_a, "steps"_a, "target"_a, "size"_a, "least"_a,
      "(A, steps + 1, 3) poses of the robot along arcs, (A, steps + 1, K, 3) of the objects, and "
      "(N, 2) the arcs and steps at which the target has moved on. What lies beyond the last of "
      "them on an arc is not defined.");
}

}  // namespace

void bind_rearrangement(nb::module_& module) {
  bind_goal(module);
  bind_grid(module);
  bind_poses(module);
  bind_pushes(module);
}

}  // namespace pushplan::bindings
