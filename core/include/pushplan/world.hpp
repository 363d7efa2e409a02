// A scene as a robot's own program describes it: plain values in SI units, world frame.
#pragma once

#include <iosfwd>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "pushplan/geometry/static_map.hpp"
#include "pushplan/motion/goal_region.hpp"

namespace pushplan {

enum class Drive {
  kDifferential,    // speed and turn rate are free
  kConstantSpeed,   // always at `max_speed`
  kCar,             // turns on `turning_radius` at best
  kOmnidirectional  // moves in any direction and turns at once
};

struct Robot {
  std::vector<Outline> parts{};  // of the footprint, convex, in the body frame: x forward, y left
  Index wheels = 0;              // of the last parts: they push objects, and do not count at walls
  double mass = 0.0;             // [kg]
  Drive drive = Drive::kDifferential;
  double max_speed = 0.0;       // [m/s]
  double min_speed = 0.0;       // negative where a differential drive or a car may reverse
  double max_turn_rate = 0.0;   // [rad/s]
  double turning_radius = 0.0;  // of a car at any speed [m]; 0 for other drives
  double max_acceleration = std::numeric_limits<double>::infinity();       // [m/s^2]
  double max_turn_acceleration = std::numeric_limits<double>::infinity();  // [rad/s^2]

  bool slides() const { return drive == Drive::kOmnidirectional; }
  bool turns_on_spot() const { return drive == Drive::kDifferential || slides(); }
  bool can_stop() const { return drive != Drive::kConstantSpeed; }
  bool reverses() const { return min_speed < 0.0 || slides(); }
  /// True for a car that may reverse: its shortest curves lead ahead and back.
  bool curves_back() const { return drive == Drive::kCar && reverses(); }
  /// Least turning radius [m]: a car's own, that of other drives at full speed.
  double least_radius() const {
    return turning_radius > 0.0 ? turning_radius : max_speed / max_turn_rate;
  }
};

/// Something that the robot may push.
struct Object {
  std::vector<Outline> parts{};  // convex ones, in the frame of the object, about its centroid
  Pose pose{};                   // of that frame
  double mass = 0.0;             // [kg]
  double gyration_square = 0.0;  // moment of inertia over mass [m^2]; 0: that of the parts
};

/// Prices of places in square cells: a metre at a price p costs as much as 1 + p elsewhere.
struct Prices {
  std::vector<double> values{};  // row by row, row 0 at the least y of the grid
  Index columns = 0;
  Pose origin{};      // of the outer corner of the first cell
  double cell = 1.0;  // side [m]
};

struct World {
  Robot robot{};
  Pose robot_pose{};
  Pose robot_twist{};                     // velocity that it drives now [m/s, m/s, rad/s]
  std::shared_ptr<const StaticMap> map{};  // the same one for many calls saves time
  std::vector<Object> objects{};
  GoalRegion goal{};    // of the robot's origin; the normal of a line has length 1
  double margin = 0.0;  // kept from everything static, as far as the robot is not nearer [m]
  Prices prices{};
};

/// A map of convex polygons and thick lines; corners may run either way round.
std::shared_ptr<const StaticMap> make_map(const std::vector<Outline>& walls, const Box& bounds,
                                          std::vector<Wall> lines = {});

/// An object from convex outlines in the world frame that do not overlap.
Object make_object(const std::vector<Outline>& parts, double mass);

/// A goal of seven numbers: 0, x, y, radius, 0, heading, which is not a number if any will do, and its
/// tolerance; or 1, x, y, the normal and two more.
GoalRegion goal_from(std::span<const double> numbers);

/// Reads and writes a world as lines of plain numbers, which lose nothing. `pushplan plan --plain`
/// writes one from any world file. Throws std::invalid_argument, naming the line.
World read_world(std::istream& in);
void write_world(const World& world, std::ostream& out);

}  // namespace pushplan
