#include "arrays.hpp"

NB_MODULE(_core, module) {
  module.doc() = "The compiled core of pushplan (C++, see core/). Arguments are not checked.";
  auto geometry = module.def_submodule("geometry", "Shapes, obstacles and distances around them.");
  pushplan::bindings::bind_geometry(geometry);
  auto gtsp = module.def_submodule("gtsp", "Parts of the GTSP solver.");
  pushplan::bindings::bind_gtsp(gtsp);
  auto interaction = module.def_submodule("interaction", "Models of what the robot pushes.");
  pushplan::bindings::bind_interaction(interaction);
}
