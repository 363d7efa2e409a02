// Arcs of the predictive search.
#pragma once

#include <span>

#include "pushplan/planners/ship_predictive/ice_cost_to_go.hpp"

namespace pushplan {

/// A pose and the curvature that leads to it [1/m].
struct ArcPose {
  Pose pose;
  double curvature;
};

/// Places where the ship's origin may be.
struct ShipChannel {
  double goal;  // y of the line to which the search goes [m]
  Box box;      // [m]
};

/// Drives on in small arcs of least cost to go. Returns the number of poses, 0 where they do not
/// fit.
Index steer_on(const IceCostToGo& costs, const Pose& start,
               std::span<const double> curvatures,  // to choose from [1/m]
               double step,                         // length of the arcs [m]
               std::span<ArcPose> out);

/// Lays an arc from a pose on, cut off at the goal. `out` has room for all of it, the pose
/// included. Returns the number of poses, 0 where it leaves the channel.
Index arc_ahead(const ShipChannel& channel, const Pose& start, double curvature,
                double step,  // distance between poses along the arc [m]
                std::span<ArcPose> out);

struct CostAhead {
  double work;   // along an arc, if no floe moved [kg m]
  double to_go;  // cost to go after that [kg m]
};

/// Costs of an arc whose poses are `step` [m] apart.
CostAhead cost_ahead(const IceCostToGo& costs, std::span<const ArcPose> arc, double step);

}  // namespace pushplan
