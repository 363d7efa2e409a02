#include "planner_scene.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pushplan/geometry/polygon.hpp"

namespace pushplan {
namespace {

constexpr double kLargest = 1e6;       // coordinates, masses and rates
constexpr double kRounding = 1e-9;     // of the size of an outline, or its square
constexpr double kMostSlender = 30.0;  // a body thinner than the robot sets no finer steps

bool usable(double value) { return std::abs(value) <= kLargest; }  // not if it is no number
bool usable(Vec2 p) { return usable(p.x) && usable(p.y); }
bool positive(double value) { return value > 0.0 && usable(value); }
bool not_negative(double value) { return value >= 0.0 && usable(value); }

Box joined(const Box& a, const Box& b) {
  return {std::min(a.x_min, b.x_min), std::min(a.y_min, b.y_min), std::max(a.x_max, b.x_max),
          std::max(a.y_max, b.y_max)};
}

/// True if an outline is convex, turns once, and has an area.
bool is_convex(Polygon outline) {
  const bool finite = std::ranges::all_of(outline, [](Vec2 p) { return usable(p); });
  if (outline.size() < 3 || !finite) return false;
  const Box box = box_around(outline);
  const double size = std::max(box.x_max - box.x_min, box.y_max - box.y_min);
  const double area = polygon_area(outline);
  double turned = 0.0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const std::size_t j = next_corner(outline, i);
    const std::size_t k = next_corner(outline, j);
    const Vec2 a{outline[j].x - outline[i].x, outline[j].y - outline[i].y};
    const Vec2 b{outline[k].x - outline[j].x, outline[k].y - outline[j].y};
    const double cross = std::copysign(1.0, area) * (a.x * b.y - a.y * b.x);
    if (cross < -kRounding * size * size || std::hypot(a.x, a.y) <= kRounding * size) return false;
    turned += std::atan2(cross, a.x * b.x + a.y * b.y);
  }
  return std::abs(area) > kRounding * size * size && turned < 3.0 * std::numbers::pi;
}

bool is_goal(const GoalRegion& goal) {
  if (!usable(goal.point)) return false;
  const bool turns = usable(goal.heading) && positive(goal.heading_tolerance) &&
                     goal.heading_tolerance <= std::numbers::pi;
  if (goal.kind == GoalRegion::Kind::kDisc) {
    return positive(goal.radius) && (turns || !goal.has_heading());
  }
  return !goal.has_heading() && std::abs(std::hypot(goal.normal.x, goal.normal.y) - 1.0) < 1e-6;
}

}  // namespace

std::string fault_of(const World& world, const PlannerOptions& options) {
  const Robot& robot = world.robot;
  const Pose& pose = world.robot_pose;
  const Box& box = world.bounds;
  const bool car = robot.drive == Drive::kCar;
  const std::pair<bool, const char*> rules[] = {
      {!robot.parts.empty() && std::ranges::all_of(robot.parts, is_convex),
       "robot.parts must be convex polygons, one at least"},
      {positive(robot.mass) && positive(robot.max_speed) && positive(robot.max_turn_rate),
       "mass, max_speed and max_turn_rate of the robot must be positive"},
      {robot.max_acceleration > 0.0 && robot.max_turn_acceleration > 0.0,
       "accelerations of the robot must be positive, or infinite"},
      {car ? positive(robot.turning_radius) : robot.turning_radius == 0.0,
       "robot.turning_radius must be positive for a car, and 0 for other drives"},
      {usable({pose.x, pose.y}) && usable(pose.theta), "robot_pose must be finite"},
      {usable({world.robot_twist.v, world.robot_twist.w}), "robot_twist must be finite"},
      {usable({box.x_min, box.y_min}) && usable({box.x_max, box.y_max}) && box.x_min < box.x_max &&
           box.y_min < box.y_max,
       "bounds must hold an area"},
      {std::ranges::all_of(world.walls, is_convex), "walls must be convex polygons"},
      {std::ranges::all_of(world.objects, is_convex, &Object::outline),
       "outlines of objects must be convex polygons"},
      {std::ranges::all_of(world.objects, positive, &Object::mass),
       "masses of objects must be positive"},
      {is_goal(world.goal),
       "goal must be a disc with a radius, and a heading_tolerance in (0, pi] if it has a heading, "
       "or a line with a normal of length 1 and no heading"},
      {not_negative(options.push_weight) && not_negative(options.friction) &&
           not_negative(options.static_friction),
       "push_weight, friction and static_friction must be 0 or more"},
      {not_negative(options.margin) && options.margin <= 1.0, "margin must lie in [0, 1]"},
      {positive(options.turn_fraction) && options.turn_fraction <= 1.0,
       "turn_fraction must lie in (0, 1]"}};
  for (const auto& [holds, message] : rules) {
    if (!holds) return message;
  }
  return {};
}

void Outlines::add(Polygon outline) {
  const auto first = static_cast<Index>(vertices.size());
  vertices.insert(vertices.end(), outline.begin(), outline.end());
  if (polygon_area(outline) < 0.0) std::reverse(vertices.begin() + first, vertices.end());
  offsets.push_back(static_cast<Index>(vertices.size()));
  const Box box = box_around(outline);
  if (boxes.size() % ConvexObstacles::kGroup == 0) groups.push_back(box);
  groups.back() = joined(groups.back(), box);
  boxes.push_back(box);
}

double Outlines::radius() const {
  double radius = 0.0;
  for (const Vec2 p : vertices) radius = std::max(radius, std::hypot(p.x, p.y));
  return radius;
}

double Outlines::width() const {
  double least = kLargest;
  for (Index k = 0; k < polygons().count(); ++k) {
    const Polygon outline = polygons()[k];
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Vec2 a = outline[i];
      const Vec2 b = outline[next_corner(outline, i)];
      const auto off = [&](Vec2 p) {
        return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
      };
      const double depth = off(*std::ranges::max_element(outline, {}, off));
      least = std::min(least, depth / std::hypot(b.x - a.x, b.y - a.y));
    }
  }
  return least;
}

Scene::Scene(const World& of) : world(of) {
  const Robot& model = world.robot;
  for (const Outline& part : model.parts) robot.add(part);
  for (const Outline& wall : world.walls) walls.add(wall);
  size = robot.radius();
  turning_radius =
      model.drive == Drive::kCar ? model.turning_radius : model.max_speed / model.max_turn_rate;
  for (const Object& object : world.objects) {
    const Vec2 centre = polygon_centroid(object.outline);
    Outlines alone;
    alone.add(object.outline);
    for (Vec2& p : alone.vertices) p = {p.x - centre.x, p.y - centre.y};
    objects.add(alone.vertices);
    first_parts.push_back(objects.polygons().count());
    poses.push_back({centre.x, centre.y, 0.0});
    masses.push_back(object.mass);
    radii.push_back(alone.radius());
    inverse_masses.push_back(1.0 / object.mass);
    inverse_gyration.push_back(1.0 / polygon_inertia(alone.vertices));
  }
}

Outlines Scene::footprint(double margin) const {
  Outlines grown;
  for (Index k = 0; k < robot.polygons().count(); ++k) {
    const Polygon part = robot.polygons()[k];
    Outline corners;
    for (std::size_t i = 0; i < part.size(); ++i) {
      const Vec2 here = part[i];
      const Vec2 before = part[i == 0 ? part.size() - 1 : i - 1];
      const Vec2 after = part[next_corner(part, i)];
      const double in = std::atan2(here.y - before.y, here.x - before.x);
      const double turn = wrap_angle(std::atan2(after.y - here.y, after.x - here.x) - in);
      // a corner for each quarter turn, where the sides of a polygon around the disc meet
      const int count = std::max(1, static_cast<int>(std::ceil(turn / (0.5 * std::numbers::pi))));
      const double half = 0.5 * turn / count;
      for (int j = 0; j < (margin > 0.0 ? count : 1); ++j) {
        const double outward = in + (2 * j + 1) * half - 0.5 * std::numbers::pi;
        const double reach = margin / std::cos(half);
        corners.push_back({here.x + reach * std::cos(outward), here.y + reach * std::sin(outward)});
      }
    }
    grown.add(corners);
  }
  return grown;
}

ConvexObstacles Scene::obstacles() const {
  return {walls.polygons(), walls.boxes, walls.groups, world.bounds};
}

GoalRegion Scene::goal(double inset) const {
  GoalRegion goal = world.goal;
  if (goal.kind == GoalRegion::Kind::kDisc) {
    goal.radius = std::max(goal.radius - inset, 0.5 * goal.radius);
  } else {
    goal.point = {goal.point.x + inset * goal.normal.x, goal.point.y + inset * goal.normal.y};
  }
  return goal;
}

Bodies Scene::bodies() const {
  return {robot.polygons(),
          robot.polygons().count(),
          size,
          objects.polygons(),
          {objects.polygons(), first_parts},
          radii,
          inverse_masses,
          inverse_gyration,
          walls.polygons(),
          walls.boxes};
}

QuasiStaticSettings Scene::settings(const PlannerOptions& options) const {
  const double width = std::min(robot.width(), objects.width());
  const double thinnest = std::max(width / std::numbers::sqrt2, size / kMostSlender);
  return {.max_step = 0.1 * thinnest,
          .tolerance = 1e-3 * thinnest,
          .jam_depth = 0.025 * thinnest,
          .iterations = 12,
          .friction = options.friction,
          .static_friction = options.static_friction};
}

}  // namespace pushplan
