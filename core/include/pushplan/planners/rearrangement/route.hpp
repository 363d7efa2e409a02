// Costs of the legs and turns of a route around objects.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "pushplan/geometry/pose.hpp"
#include "pushplan/motion/collision.hpp"

namespace pushplan::rearrangement {

struct RouteCosts {
  double step;       // distance of the poses that are looked at [m]
  double turn_cost;  // of a turn [m/rad]
  double arm;        // distance by which a turn carries an object along [m/rad]
};

/// Objects in the way of a route. Their arrays are read when a `RouteSearch` is made.
struct RouteObjects {
  std::span<const Pose> poses;
  Polygons outlines;                // in their body frames [m]
  std::span<const double> radii;    // circumscribed [m]
  std::span<const double> weights;  // cost of carrying each along
};

/// The cheapest legs between points on a line. Row 2 i is point i reached driving ahead, row 2 i +
/// 1 driving back.
struct Legs {
  struct Turns {
    double first;  // how the turn before the leg is made: 1 left, -1 right, 0 the shorter way
    double last;   // and the turn after it, at the last point
  };

  std::array<double, 2> costs;  // of ending ahead, and back [m]
  std::vector<Index> before;    // the row before each row, -1 if none
  std::vector<Turns> turns;
};

/// Costs of motions among objects and obstacles, with memory for one thread. All arrays have to
/// outlive it.
class RouteSearch {
 public:
  RouteSearch(const RouteCosts& costs,
              const Footprint& shape,  // with the margin that objects cost from
              const Footprint& tight,  // with the margin that walls are kept from
              const ConvexObstacles& obstacles, const RouteObjects& objects);

  /// The cheapest way over points, the first of which is where the robot is.
  Legs cheapest_legs(std::span<const Vec2> points,
                     double heading,  // of the robot at the first point [rad]
                     double end,      // heading to turn to at the last one [rad]
                     Index first,     // number of points from which a leg to any other may begin
                     Index longest);  // most points that a leg from another one may skip to

 private:
  struct Overlap {
    double depth;  // of the footprint in the objects [m]
    double touch;  // weights of those that it is in
  };
  struct Turn {
    double cost;  // [m]
    double side;  // 1 left, -1 right, 0 the shorter way
  };
  struct Leg {
    double cost;     // [m]
    double heading;  // in which it ends [rad]
    double side;     // of the turn before it
  };

  /// A motion is of no use where what is spent before it and its own cost reach the most [m].
  struct Limit {
    double spent;
    double most;
  };

  Overlap overlap(const Pose& pose);
  double motion(const Pose& here, const Pose& there, double turn, Limit limit);
  Turn turn(Vec2 at, double heading, double to, Limit limit);
  Leg leg(Vec2 from, double heading, Vec2 to, double sign, Limit limit);

  RouteCosts costs_;
  Footprint shape_;
  CollisionChecker walls_;
  RouteObjects objects_;
  std::vector<Vec2> outlines_;  // of the objects in the world frame
  std::vector<Vec2> corners_;   // of the footprint in the world frame
};

}  // namespace pushplan::rearrangement
