#include <cstdint>
#include <string_view>

#include "arrays.hpp"

namespace nb = nanobind;

namespace {

PyObject* listener = nullptr;

// Nearly all events are calls of id(): a hook in Python would slow deep copies down by two thirds.
// The last events come when nothing in Python can be called any more.
int hear(const char* event, PyObject* arguments, void*) {
  if (std::string_view(event) == "builtins.id" || Py_IsInitialized() == 0) {
    return 0;
  }
  PyObject* answer = PyObject_CallFunction(listener, "sO", event, arguments);
  Py_XDECREF(answer);
  return answer == nullptr ? -1 : 0;
}

}  // namespace

NB_MODULE(_core, module) {
  module.doc() = "The compiled core of pushplan (C++, see core/).";
  // caches of Python hold shapes until the interpreter ends: no leak, and nothing to print
  nb::set_leak_warnings(false);
  module.attr("SOURCES") = PUSHPLAN_SOURCES;
  module.attr("COMPILER") = PUSHPLAN_COMPILER;
  module.def(
      "audit_hook",
      [](const nb::callable& callback) {
        listener = nb::object(callback).release().ptr();
        return reinterpret_cast<std::uintptr_t>(&hear);
      },
      nb::arg("callback"), "Take a function and return the address of a hook in C that calls it.");
  nb::register_exception_translator([](const std::exception_ptr& thrown, void*) {
    try {
      std::rethrow_exception(thrown);
    } catch (const std::invalid_argument& refusal) {
      const auto errors = nb::module_::import_("pushplan.errors");
      PyErr_SetString(errors.attr("InvalidInputError").ptr(), refusal.what());
    }
  });
  // rooms whose types others take come first
  auto geometry = module.def_submodule("geometry", "Shapes, obstacles and distances around them.");
  pushplan::bindings::bind_geometry(geometry);
  auto interaction = module.def_submodule("interaction", "Models of what the robot pushes.");
  pushplan::bindings::bind_interaction(interaction);
  auto search = module.def_submodule("search", "Shortest paths on graphs.");
  pushplan::bindings::bind_search(search);
  auto motion = module.def_submodule("motion", "Arcs, shortcuts and state lattices.");
  pushplan::bindings::bind_motion(motion);
  pushplan::bindings::bind_motion_paths(motion);
  auto control = module.def_submodule("control", "Predictive control along a path.");
  pushplan::bindings::bind_control(control);
  auto envs = module.def_submodule("envs", "Parts of simulators.");
  pushplan::bindings::bind_envs(envs);
  auto gtsp = module.def_submodule("gtsp", "Parts of the GTSP solver.");
  pushplan::bindings::bind_gtsp(gtsp);
  auto navigation = module.def_submodule("navigation", "The planner of paths that push.");
  pushplan::bindings::bind_navigation(navigation);
  auto observation = module.def_submodule("observation", "Worlds drawn into images.");
  pushplan::bindings::bind_observation(observation);
  auto perception = module.def_submodule("perception", "Rays of sensors, and maps of scans.");
  pushplan::bindings::bind_perception(perception);
  auto planners = module.def_submodule("planners", "Searches and tables of planners.");
  pushplan::bindings::bind_planners(planners);
  auto pushing = module.def_submodule("pushing", "Predictive pushing of one box along a path.");
  pushplan::bindings::bind_pushing(pushing);
  auto rearrangement = module.def_submodule("rearrangement", "Parts of rearrangement planning.");
  pushplan::bindings::bind_rearrangement(rearrangement);
  auto scenarios = module.def_submodule("scenarios", "Steps of the ice generator.");
  pushplan::bindings::bind_scenarios(scenarios);
}
