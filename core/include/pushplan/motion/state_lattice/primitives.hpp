// Motion primitives of a state lattice: arcs and lines that join lattice states exactly.
//
// A set is defined in units of the lattice step, so one set serves every robot whose turning radius
// is the same number of steps. Headings are directions of small whole vectors, so that straight
// lines join lattice points too (Pivtoraiko, Knepper and Kelly, "Differentially constrained mobile
// robot motion planning in state lattices", 2009).
#pragma once

#include <array>
#include <span>

#include "pushplan/motion/dubins.hpp"
#include "pushplan/motion/state_lattice/pose_lattice.hpp"

namespace pushplan {

/// A path from the origin to a lattice point; lengths in lattice steps.
struct LatticeConnection {
  double length;
  Vec2 end;
  std::array<Arc, 3> arcs;
};

/// What the paths from the origin to the points around it have to keep to.
struct ConnectionLimits {
  double radius;  // turning radius [steps]
  Index reach;    // greatest distance of an end [steps]
  double slack;   // greatest turn of a path beyond the change of heading [rad]
};

/// Finds the Dubins paths without needless turns from the origin to all points at a heading
/// `target` that lie ahead. Returns their number; those are left out for which `out` has no room.
Index find_connections(double heading, double target, const ConnectionLimits& limits,
                       std::span<LatticeConnection> out);

/// Finds where the robot's origin is along primitives, each of three arcs [steps].
void primitive_boxes(std::span<const double> headings,          // (P,) at their starts [rad]
                     std::span<const std::array<Arc, 3>> arcs,  // (P,)
                     std::span<const double> lengths,           // (P,)
                     std::span<OriginBox> boxes);               // (P,) filled

}  // namespace pushplan
