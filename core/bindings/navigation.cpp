#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>

#include <sstream>

#include "arrays.hpp"
#include "pushplan/navigation/pushing.hpp"
#include "pushplan/planner.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

namespace {

std::vector<Outline> outlines(const Polygons& shapes, Index first, Index last) {
  std::vector<Outline> found;
  for (Index k = first; k < last; ++k) found.emplace_back(shapes[k].begin(), shapes[k].end());
  return found;
}

void bind_world(nb::module_& module) {
  nb::enum_<Drive>(module, "Drive", "Kind of motion.")
      .value("differential", Drive::kDifferential)
      .value("constant_speed", Drive::kConstantSpeed)
      .value("car", Drive::kCar)
      .value("omnidirectional", Drive::kOmnidirectional);
  nb::class_<Robot>(module, "Robot", "A robot as a planner sees it.")
      .def(
          "__init__",
          [](Robot* self, const Points& vertices, const Integers<1>& offsets, Index wheels,
             Drive drive, const Numbers<7>& limits) {
            const Polygons parts = polygons(vertices, offsets);
            const double* n = limits.data();
            new (self) Robot{outlines(parts, 0, parts.count()), wheels, n[0], drive, n[1], n[2],
                             n[3], n[4], n[5], n[6]};
          },
          "vertices"_a, "offsets"_a, "wheels"_a, "drive"_a,
          "limits"_a,
          "Limits: mass, greatest and least speed, turn rate, turning radius, accelerations.");
  nb::class_<World>(module, "World", "A scene.")
      .def(
          "__init__",
          [](World* self, const Robot& robot, const OnePose& at, const OnePose& twist,
             std::shared_ptr<const StaticMap> map, const Numbers<7>& goal, double margin) {
            new (self)
                World{robot, pose(at), pose(twist), std::move(map), {},
                                goal_from({goal.data(), 7}), margin};
          },
          "robot"_a, "pose"_a, "twist"_a, "map"_a, "goal"_a,
          "margin"_a)
      .def(
          "set_objects",
          [](World& self, const Points& vertices, const Integers<1>& offsets,
             const Integers<1>& first_parts, const Poses& at, const Floats<1>& masses,
             const Floats<1>& gyration_squares) {
            const Compounds shapes = compounds(vertices, offsets, first_parts);
            require_count("poses", at.shape(0), shapes.count());
            require_count("masses", masses.shape(0), shapes.count());
            require_count("gyration_squares", gyration_squares.shape(0), shapes.count());
            self.objects.clear();
            for (Index k = 0; k < shapes.count(); ++k) {
              const auto i = static_cast<std::size_t>(k);
              self.objects.push_back({outlines(shapes.parts, shapes.begin(k), shapes.end(k)),
                                      poses(at)[i], masses.data()[i], gyration_squares.data()[i]});
            }
          },
          "vertices"_a, "offsets"_a, "first_parts"_a,
          "poses"_a, "masses"_a, "gyration_squares"_a)
      .def(
          "set_prices",
          [](World& self, const Floats<2>& prices, const OnePose& origin, double cell) {
            self.prices = {{prices.data(), prices.data() + prices.size()},
                           static_cast<Index>(prices.shape(1)),
                           pose(origin),
                           cell};
          },
          "prices"_a, "origin"_a, "cell"_a)
      .def(
          "written",
          [](const World& self) {
            std::ostringstream out;
            write_world(self, out);
            return out.str();
          },
          "Lines of plain numbers, from which `read_world` makes the same world.");
  module.def(
      "read_world",
      [](const std::string& text) {
        std::istringstream lines(text);
        return read_world(lines);
      },
      "text"_a);
}

void require_no_fault(const World& world, const PlannerOptions& options) {
  const std::string fault = fault_of(world, options);
  if (!fault.empty()) throw std::invalid_argument(fault);
}

template <InteractionModel M>
void bind_model(nb::class_<PathPlanner>& planner) {
  planner.def(
      "__init__",
      [](PathPlanner* self, const World& world, const PlannerOptions& options, M& model) {
        require_no_fault(world, options);
        require_count("objects of the model", model.radii().size(), world.objects.size());
        new (self) PathPlanner(world, options, std::make_unique<PushingWith<M>>(model));
      },
      "world"_a, "options"_a, "model"_a, nb::keep_alive<1, 4>());
}

void bind_planner(nb::module_& module) {
  nb::enum_<SearchKind>(module, "SearchKind", "How paths are looked for.")
      .value("shortest_path", SearchKind::kShortestPath)
      .value("kinodynamic", SearchKind::kKinodynamic)
      .value("push_aware", SearchKind::kPushAware);
  nb::enum_<Part>(module, "Part", "What can be left out.", nb::is_arithmetic())
      .value("guided_drive", Part::kGuidedDrive)
      .value("windows", Part::kWindows)
      .value("patient_drive", Part::kPatientDrive)
      .value("trees", Part::kTrees)
      .value("coarse_path", Part::kCoarsePath)
      .value("searches", Part::kSearches)
      .value("variants", Part::kVariants)
      .value("turn_first", Part::kTurnFirst)
      .value("ways_out", Part::kWaysOut);
  nb::enum_<PlanStatus>(module, "PlanStatus", "Outcome of a planning call.")
      .value("SOLVED", PlanStatus::kSolved)
      .value("PATH_ONLY", PlanStatus::kPathOnly)
      .value("START_BLOCKED", PlanStatus::kStartBlocked)
      .value("GOAL_UNREACHABLE", PlanStatus::kGoalUnreachable)
      .value("NO_PLAN", PlanStatus::kNoPlan)
      .value("INVALID_INPUT", PlanStatus::kInvalidInput)
      .value("FAILED", PlanStatus::kFailed);
  nb::class_<PlannerOptions>(module, "PlannerOptions", "Parameters of a planner.")
      .def(nb::init<>())
      .def_rw("search", &PlannerOptions::search)
      .def_rw("seed", &PlannerOptions::seed)
      .def_rw("push_weight", &PlannerOptions::push_weight)
      .def_rw("margin", &PlannerOptions::margin)
      .def_rw("turn_fraction", &PlannerOptions::turn_fraction)
      .def_rw("differential_radius", &PlannerOptions::differential_radius)
      .def_rw("heuristic_inflation", &PlannerOptions::heuristic_inflation)
      .def_rw("pruning_factor", &PlannerOptions::pruning_factor)
      .def_rw("without", &PlannerOptions::without, "Sum of parts that are left out.")
      .def(
          "set_contact",
          [](PlannerOptions& self, double friction, double static_friction, double gyration_scale,
             double step, Index iterations) {
            self.contact = {friction, static_friction, gyration_scale, step, iterations};
          },
          "friction"_a, "static_friction"_a, "gyration_scale"_a, "step"_a, "iterations"_a);
  nb::class_<Plan>(module, "Plan", "Poses with times.")
      .def_ro("status", &Plan::status)
      .def_ro("message", &Plan::message)
      .def_prop_ro("times", [](const Plan& self) { return shown<double>(std::span(self.times), self); })
      .def_prop_ro("poses",
                   [](const Plan& self) { return shown<double>(std::span(self.poses), self); })
      .def_prop_ro("speeds", [](const Plan& self) { return shown<double>(std::span(self.speeds), self); })
      .def_prop_ro("turn_rates",
                   [](const Plan& self) { return shown<double>(std::span(self.turn_rates), self); })
      .def_prop_ro("objects",
                   [](const Plan& self) { return shown<double>(std::span(self.objects), self); })
      .def_ro("travel_cost", &Plan::travel_cost)
      .def_ro("interaction_cost", &Plan::interaction_cost)
      .def_ro("cost", &Plan::cost);
  nb::class_<PlannerCounts>(module, "PlannerCounts", "What a planning call has done.")
      .def_ro("iterations", &PlannerCounts::iterations)
      .def_ro("nodes", &PlannerCounts::nodes)
      .def_ro("trees", &PlannerCounts::trees)
      .def_ro("searches", &PlannerCounts::searches)
      .def_ro("expansions", &PlannerCounts::expansions)
      .def_ro("tight", &PlannerCounts::tight);
  nb::class_<PathPlanner> planner(module, "PathPlanner", "A planning call that works in pieces.");
  planner
      .def(
          "__init__",
          [](PathPlanner* self, const World& world, const PlannerOptions& options) {
            require_no_fault(world, options);
            new (self) PathPlanner(world, options);
          },
          "world"_a, "options"_a)
      .def("run", &PathPlanner::run, "budget"_a = 0, ReleaseGil())
      .def_prop_ro("done", &PathPlanner::done)
      .def_prop_ro("status", &PathPlanner::status)
      .def_prop_ro("cost", &PathPlanner::cost)
      .def_prop_ro("bound", &PathPlanner::bound)
      .def_prop_ro("iterations", [](const PathPlanner& self) { return self.counts().iterations; })
      .def_prop_ro("counts", &PathPlanner::counts, nb::rv_policy::copy)
      .def("best", &PathPlanner::best);
  bind_model<QuasiStatic>(planner);
  bind_model<IceInteraction>(planner);
  bind_model<CalledInteraction>(planner);
  module.def(
      "plan",
      [](const World& world, const PlannerOptions& options, Index iterations) {
        return plan(world, options, iterations);
      },
      "world"_a, "options"_a, "iterations"_a, ReleaseGil(),
      "The best plan, as C++ programs get it.");
}

}  // namespace

void bind_navigation(nb::module_& module) {
  bind_world(module);
  bind_planner(module);
}

}  // namespace pushplan::bindings
