#include "scene.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "pushplan/geometry/polygon.hpp"

namespace pushplan {
namespace {

constexpr double kLargest = 1e6;       // coordinates, masses and rates
constexpr double kRounding = 1e-9;     // of the size of an outline, or its square
constexpr double kMostSlender = 30.0;  // a body thinner than the robot sets no finer steps
constexpr double kStep = 0.1;        // between two contact resolutions [sizes of the thinnest body]
constexpr double kTolerance = 1e-3;  // overlap that counts as resolved [the same]
constexpr Index kIterations = 12;    // of the contact solver

bool usable(double value) { return std::abs(value) <= kLargest; }  // not if it is no number
bool positive(double value) { return value > 0.0 && usable(value); }
bool usable(const Pose& pose) { return usable(pose.x) && usable(pose.y) && usable(pose.theta); }

Box box_around(Polygon outline) {
  Box box{kLargest, kLargest, -kLargest, -kLargest};
  for (const Vec2 p : outline) {
    box = {std::min(box.x_min, p.x), std::min(box.y_min, p.y), std::max(box.x_max, p.x),
           std::max(box.y_max, p.y)};
  }
  return box;
}

/// True if an outline is convex, turns once, and has an area.
bool is_convex(Polygon outline) {
  if (outline.size() < 3) return false;
  if (!std::ranges::all_of(outline, [](Vec2 p) { return usable(p.x) && usable(p.y); }))
    return false;
  const Box box = box_around(outline);
  const double size = std::max(box.x_max - box.x_min, box.y_max - box.y_min);
  const double area = polygon_area(outline);
  const double side = area < 0.0 ? -1.0 : 1.0;
  double turned = 0.0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec2 a = outline[i];
    const Vec2 b = outline[next_corner(outline, i)];
    const Vec2 c = outline[next_corner(outline, next_corner(outline, i))];
    const Vec2 first{b.x - a.x, b.y - a.y};
    const Vec2 second{c.x - b.x, c.y - b.y};
    const double cross = side * (first.x * second.y - first.y * second.x);
    if (cross < -kRounding * size * size || std::hypot(first.x, first.y) <= kRounding * size) {
      return false;
    }
    turned += std::atan2(cross, first.x * second.x + first.y * second.y);
  }
  return side * area > kRounding * size * size && turned < 3.0 * std::numbers::pi;
}

/// Least distance between two parallel lines that hold an outline [m].
double width_of(Polygon outline) {
  double least = kLargest;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec2 a = outline[i];
    const Vec2 b = outline[next_corner(outline, i)];
    double depth = 0.0;
    for (const Vec2 p : outline) {
      depth = std::max(depth, (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x));
    }
    least = std::min(least, depth / std::hypot(b.x - a.x, b.y - a.y));
  }
  return least;
}

std::string fault_of(const Robot& robot) {
  if (robot.parts.empty()) return "robot.parts must not be empty";
  for (const Outline& part : robot.parts) {
    if (!is_convex(part)) return "robot.parts must be convex polygons with an area";
  }
  if (!positive(robot.mass)) return "robot.mass must be positive";
  if (!positive(robot.max_speed)) return "robot.max_speed must be positive";
  if (!positive(robot.max_turn_rate)) return "robot.max_turn_rate must be positive";
  if (!(robot.max_acceleration > 0.0 && robot.max_turn_acceleration > 0.0)) {
    return "accelerations of the robot must be positive, or infinite";
  }
  const bool car = robot.drive == Drive::kCar;
  if (car ? !positive(robot.turning_radius) : robot.turning_radius != 0.0) {
    return "robot.turning_radius must be positive for a car, and 0 for other drives";
  }
  return {};
}

std::string fault_of(const PlannerOptions& options) {
  const bool weights = options.push_weight >= 0.0 && usable(options.push_weight);
  const bool contacts = options.friction >= 0.0 && options.static_friction >= 0.0 &&
                        usable(options.friction) && usable(options.static_friction);
  if (!weights || !contacts) return "push_weight and frictions must be 0 or more";
  if (!(options.margin >= 0.0 && options.margin <= 1.0)) return "margin must lie in [0, 1]";
  if (!(options.turn_fraction > 0.0 && options.turn_fraction <= 1.0)) {
    return "turn_fraction must lie in (0, 1]";
  }
  return {};
}

}  // namespace

std::string fault_of(const World& world, const PlannerOptions& options) {
  if (std::string fault = fault_of(world.robot); !fault.empty()) return fault;
  const Box& bounds = world.bounds;
  const bool finite =
      usable(bounds.x_min) && usable(bounds.y_min) && usable(bounds.x_max) && usable(bounds.y_max);
  if (!finite || !(bounds.x_min < bounds.x_max && bounds.y_min < bounds.y_max)) {
    return "bounds must hold an area";
  }
  if (!usable(world.robot_pose)) return "robot_pose must be finite";
  if (!usable(world.robot_twist.v) || !usable(world.robot_twist.w)) {
    return "robot_twist must be finite";
  }
  if (!std::ranges::all_of(world.walls, is_convex)) {
    return "walls must be convex polygons with an area";
  }
  for (const Object& object : world.objects) {
    if (!is_convex(object.outline)) return "outlines of objects must be convex, with an area";
    if (!usable(object.pose)) return "poses of objects must be finite";
    if (!positive(object.mass)) return "masses of objects must be positive";
  }
  const GoalRegion& goal = world.goal;
  const bool disc = goal.kind == GoalRegion::Kind::kDisc;
  const double normal = std::hypot(goal.normal.x, goal.normal.y);
  if (!usable(goal.point.x) || !usable(goal.point.y) ||
      (disc ? !positive(goal.radius) : !(std::abs(normal - 1.0) < 1e-6))) {
    return "the goal must be a disc with a radius, or a line with a normal of length 1";
  }
  return fault_of(options);
}

void Outlines::add(Polygon outline) {
  const std::size_t first = vertices_.size();
  vertices_.insert(vertices_.end(), outline.begin(), outline.end());
  if (polygon_area(outline) < 0.0) {
    std::reverse(vertices_.begin() + static_cast<Index>(first), vertices_.end());
  }
  offsets_.push_back(static_cast<Index>(vertices_.size()));
  const Box box = box_around(outline);
  if (boxes_.size() % ConvexObstacles::kGroup == 0) groups_.push_back(box);
  boxes_.push_back(box);
  Box& group = groups_.back();
  group = {std::min(group.x_min, box.x_min), std::min(group.y_min, box.y_min),
           std::max(group.x_max, box.x_max), std::max(group.y_max, box.y_max)};
}

double Outlines::radius() const {
  double radius = 0.0;
  for (const Vec2 p : vertices_) radius = std::max(radius, std::hypot(p.x, p.y));
  return radius;
}

Scene::Scene(const World& world) : world_(world) {
  for (const Outline& part : world.robot.parts) robot_.add(part);
  size = robot_.radius();
  for (const Outline& wall : world.walls) {
    walls_.add(wall);
    everything_.add(wall);
  }
  for (const Object& object : world.objects) {
    const Vec2 centroid = polygon_centroid(object.outline);
    Outline corners = object.outline;
    for (Vec2& p : corners) p = {p.x - centroid.x, p.y - centroid.y};
    Vec2 place{};
    transform(object.pose, std::span(&centroid, 1), &place);
    poses.push_back({place.x, place.y, object.pose.theta});
    masses.push_back(object.mass);
    centroids_.push_back(centroid);
    objects_.add(corners);
    Outlines alone;
    alone.add(corners);
    radii_.push_back(alone.radius());
    inverse_masses_.push_back(1.0 / object.mass);
    inverse_gyration_.push_back(1.0 / polygon_inertia(corners));
    transform(poses.back(), corners, corners.data());
    everything_.add(corners);
  }
}

double Scene::total_mass() const { return std::accumulate(masses.begin(), masses.end(), 0.0); }

double Scene::turning_radius() const {
  const Robot& robot = world_.robot;
  return robot.drive == Drive::kCar ? robot.turning_radius : robot.max_speed / robot.max_turn_rate;
}

GoalRegion Scene::goal(double inset) const {
  GoalRegion goal = world_.goal;
  goal.radius = std::max(goal.radius - inset, 0.5 * goal.radius);
  goal.point = {goal.point.x + inset * goal.normal.x, goal.point.y + inset * goal.normal.y};
  if (goal.kind == GoalRegion::Kind::kDisc) goal.point = world_.goal.point;
  return goal;
}

/// Corners are sharp, and cut where they turn by more than 100 degrees.
void Scene::grow_footprint(double margin) {
  constexpr double kSharp = 100.0 / 180.0 * std::numbers::pi;
  grown_ = {};
  for (Index k = 0; k < robot_.polygons().count(); ++k) {
    const Polygon part = robot_.polygons()[k];
    Outline corners;
    for (std::size_t i = 0; i < part.size(); ++i) {
      const Vec2 before = part[i == 0 ? part.size() - 1 : i - 1];
      const Vec2 after = part[next_corner(part, i)];
      const Vec2 here = part[i];
      const double in = std::atan2(here.y - before.y, here.x - before.x);
      const double turn = wrap_angle(std::atan2(after.y - here.y, after.x - here.x) - in);
      const int count = turn > kSharp && margin > 0.0 ? 2 : 1;
      const double half = 0.5 * turn / count;
      for (int j = 0; j < count; ++j) {  // along the bisector of the sides that meet there
        const double direction = in + (2 * j + 1) * half - 0.5 * std::numbers::pi;
        const double reach = margin / std::cos(half);
        corners.push_back(
            {here.x + reach * std::cos(direction), here.y + reach * std::sin(direction)});
      }
    }
    grown_.add(corners);
  }
}

Bodies Scene::bodies() const {
  return {robot_.polygons(),
          robot_.polygons().count(),
          size,
          objects_.polygons(),
          radii_,
          inverse_masses_,
          inverse_gyration_,
          walls_.polygons(),
          walls_.boxes()};
}

QuasiStaticSettings Scene::settings(double friction, double static_friction) const {
  double width = kLargest;
  for (const Outlines* all : {&robot_, &objects_}) {
    const Polygons polygons = all->polygons();
    for (Index k = 0; k < polygons.count(); ++k) width = std::min(width, width_of(polygons[k]));
  }
  const double thinnest = std::max(width / std::numbers::sqrt2, size / kMostSlender);
  return {kStep * thinnest, kTolerance * thinnest, 0.25 * kStep * thinnest, kIterations,
          friction,         static_friction};
}

Pose Scene::given_pose(Index k, const Pose& pose) const {
  const Vec2 centroid = centroids_[static_cast<std::size_t>(k)];
  const Vec2 back{-centroid.x, -centroid.y};
  Vec2 place{};
  transform(pose, std::span(&back, 1), &place);
  return {place.x, place.y, pose.theta};
}

}  // namespace pushplan
