#include "scene.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "pushplan/geometry/polygon.hpp"
#include "pushplan/motion/keep_out.hpp"

namespace pushplan {
namespace {

constexpr double kLargest = 1e70;      // coordinates, masses and rates
constexpr double kRounding = 1e-9;     // of the size of an outline, or its square
constexpr double kMostSlender = 30.0;  // a body thinner than the robot sets no finer steps

bool usable(double value) { return std::abs(value) <= kLargest; }  // not if it is no number
bool usable(Vec2 p) { return usable(p.x) && usable(p.y); }
bool usable(const Pose& pose) { return usable(Vec2{pose.x, pose.y}) && usable(pose.theta); }
bool positive(double value) { return value > 0.0 && usable(value); }
bool not_negative(double value) { return value >= 0.0 && usable(value); }

/// True if an outline is convex, turns once to the left, and has an area.
bool is_convex(Polygon outline) {
  const bool finite = std::ranges::all_of(outline, [](Vec2 p) { return usable(p); });
  if (outline.size() < 3 || !finite) return false;
  const Box box = box_around(outline);
  const double size = std::max(box.x_max - box.x_min, box.y_max - box.y_min);
  double turned = 0.0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const std::size_t j = next_corner(outline, i);
    const std::size_t k = next_corner(outline, j);
    const Vec2 a{outline[j].x - outline[i].x, outline[j].y - outline[i].y};
    const Vec2 b{outline[k].x - outline[j].x, outline[k].y - outline[j].y};
    const double cross = a.x * b.y - a.y * b.x;
    if (cross < -kRounding * size * size || std::hypot(a.x, a.y) <= kRounding * size) return false;
    turned += std::atan2(cross, a.x * b.x + a.y * b.y);
  }
  return polygon_area(outline) > kRounding * size * size && turned < 3.0 * std::numbers::pi;
}

bool are_convex(const std::vector<Outline>& parts) {
  return !parts.empty() && std::ranges::all_of(parts, [](const Outline& p) { return is_convex(p); });
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

struct MapCheck {
  bool passed;
};

bool is_sound(const StaticMap& map) {
  const Box& box = map.bounds();
  for (Index k = 0; k < map.polygons().count(); ++k) {
    if (!is_convex(map.polygons()[k])) return false;
  }
  const auto sound = [](const Wall& wall) {
    return usable(wall.line.from) && usable(wall.line.to) && not_negative(wall.radius);
  };
  return usable(Vec2{box.x_min, box.y_min}) && usable(Vec2{box.x_max, box.y_max}) &&
         box.x_min < box.x_max && box.y_min < box.y_max && std::ranges::all_of(map.lines(), sound);
}

bool is_map(const StaticMap* map) {
  if (map == nullptr) return false;
  const auto check = [&] { return std::make_shared<MapCheck>(is_sound(*map)); };
  return map->kept<MapCheck>({}, check)->passed;
}

bool are_prices(const Prices& prices) {
  const auto count = static_cast<Index>(prices.values.size());
  return usable(prices.origin) && positive(prices.cell) &&
         std::ranges::all_of(prices.values, not_negative) &&
         (count == 0 || (prices.columns > 0 && count % prices.columns == 0));
}

/// The corners that span the hull of some points, counter-clockwise (Andrew's chain, 1979).
std::vector<Vec2> convex_hull(std::vector<Vec2> points) {
  std::ranges::sort(points, {}, [](Vec2 p) { return std::pair(p.x, p.y); });
  std::vector<Vec2> hull;
  const auto chain = [&](std::size_t least, auto begin, auto end) {
    for (auto at = begin; at != end; ++at) {
      while (hull.size() >= least + 2) {
        const Vec2 a = hull[hull.size() - 2];
        const Vec2 b = hull.back();
        if ((b.x - a.x) * (at->y - a.y) - (b.y - a.y) * (at->x - a.x) > 0.0) break;
        hull.pop_back();
      }
      hull.push_back(*at);
    }
    hull.pop_back();
  };
  chain(0, points.begin(), points.end());
  chain(hull.size(), points.rbegin(), points.rend());
  return hull;
}

/// Moment of inertia over mass about the origin, of parts that do not overlap [m^2].
double gyration_square(const std::vector<Outline>& parts) {
  if (parts.size() == 1) return polygon_inertia(parts[0]);
  double area = 0.0;
  double moment = 0.0;
  for (const Outline& part : parts) {
    const Vec2 centre = polygon_centroid(part);
    const double away = centre.x * centre.x + centre.y * centre.y;
    area += polygon_area(part);
    moment += polygon_area(part) * (polygon_inertia(part) + away);
  }
  return moment / area;
}

}  // namespace

std::string fault_of(const World& world, const PlannerOptions& options) {
  const Robot& robot = world.robot;
  const bool car = robot.drive == Drive::kCar;
  const ContactOptions& contact = options.contact;
  const auto shaped = [](const Object& object) {
    return are_convex(object.parts) && usable(object.pose);
  };
  const auto heavy = [](const Object& object) {
    return positive(object.mass) && not_negative(object.gyration_square);
  };
  const std::pair<bool, const char*> rules[] = {
      {are_convex(robot.parts), "robot.parts must be convex polygons, counter-clockwise, one at least"},
      {robot.wheels >= 0 && robot.wheels < static_cast<Index>(robot.parts.size()),
       "robot.wheels must be 0 or more, and less than the number of parts"},
      {positive(robot.mass) && positive(robot.max_speed) && positive(robot.max_turn_rate),
       "mass, max_speed and max_turn_rate of the robot must be positive"},
      {robot.max_acceleration > 0.0 && robot.max_turn_acceleration > 0.0,
       "accelerations of the robot must be positive, or infinite"},
      {usable(robot.min_speed), "robot.min_speed must be finite"},
      {car ? positive(robot.turning_radius) : robot.turning_radius == 0.0,
       "robot.turning_radius must be positive for a car, and 0 for other drives"},
      {usable(world.robot_pose), "robot_pose must be finite"},
      {usable(world.robot_twist), "robot_twist must be finite"},
      {is_map(world.map.get()),
       "map must be given, its polygons convex and counter-clockwise, and its bounds an area"},
      {std::ranges::all_of(world.objects, shaped),
       "parts of objects must be convex polygons, counter-clockwise, and their poses finite"},
      {std::ranges::all_of(world.objects, heavy), "masses of objects must be positive"},
      {is_goal(world.goal),
       "goal must be a disc with a radius, and a heading_tolerance in (0, pi] if it has a heading, "
       "or a line with a normal of length 1 and no heading"},
      {not_negative(world.margin), "margin of the world must be 0 or more"},
      {are_prices(world.prices), "prices must be 0 or more, and fill whole rows of cells"},
      {not_negative(options.push_weight) && not_negative(options.heuristic_inflation) && not_negative(options.pruning_factor),
       "push_weight, heuristic_inflation and pruning_factor must be 0 or more"},
      {not_negative(contact.friction) && not_negative(contact.static_friction),
       "friction and static_friction must be 0 or more"},
      {positive(contact.gyration_scale) && positive(contact.step) && contact.step <= 1.0 &&
           contact.iterations > 0,
       "gyration_scale, step (1 at most) and iterations of contacts must be positive"},
      {not_negative(options.margin) && options.margin <= 1.0, "margin must lie in [0, 1]"},
      {positive(options.differential_radius), "differential_radius must be positive"},
      {positive(options.turn_fraction) && options.turn_fraction <= 1.0,
       "turn_fraction must lie in (0, 1]"}};
  for (const auto& [holds, message] : rules) {
    if (!holds) return message;
  }
  return {};
}

Scene::Scene(World of, const PlannerOptions& given) : world(std::move(of)), options(given) {
  for (const Outline& part : robot().parts) {
    robot_parts_.add(part);
    inscribed = std::max(inscribed, inscribed_radius(part));
  }
  for (const Vec2 p : robot_parts_.vertices) size = std::max(size, std::hypot(p.x, p.y));
  for (const Object& object : world.objects) add(object);
  keep_out = pushplan::keep_out(world.map, wall_parts(), size, world.robot_pose, world.margin);
}

void Scene::add(const Object& object) {
  std::vector<Vec2> corners;
  for (const Outline& part : object.parts) {
    parts_.add(part);
    corners.insert(corners.end(), part.begin(), part.end());
  }
  first_parts_.push_back(parts_.polygons().count());
  hulls_.add(object.parts.size() == 1 ? corners : convex_hull(corners));
  double radius = 0.0;
  for (const Vec2 p : corners) radius = std::max(radius, std::hypot(p.x, p.y));
  double square = object.gyration_square;
  if (square == 0.0) square = gyration_square(object.parts);
  const double scale = options.contact.gyration_scale;
  poses.push_back(object.pose);
  masses.push_back(object.mass);
  radii.push_back(radius);
  inverse_masses_.push_back(1.0 / object.mass);
  inverse_gyration_.push_back(1.0 / (square * scale * scale));
}

Polygons Scene::wall_parts() const {
  const Polygons all = robot_parts_.polygons();
  return {all.vertices, all.offsets.first(all.offsets.size() - static_cast<std::size_t>(robot().wheels))};
}

PriceGrid Scene::price() const {
  const Prices& prices = world.prices;
  if (prices.values.empty()) return {};
  const auto count = static_cast<Index>(prices.values.size());
  return {{prices.values.data(), {count / prices.columns, prices.columns}}, prices.origin, prices.cell};
}

Bodies Scene::bodies() const {
  return {robot_parts_.polygons(),
          wall_parts().count(),
          size,
          hulls_.polygons(),
          {parts_.polygons(), first_parts_},
          radii,
          inverse_masses_,
          inverse_gyration_,
          world.map->parts(),
          world.map->boxes()};
}

QuasiStaticSettings Scene::settings(Index iterations) const {
  const ContactOptions& contact = options.contact;
  double width = std::numeric_limits<double>::infinity();
  for (const Polygons& shapes : {wall_parts(), parts_.polygons()}) {
    for (Index k = 0; k < shapes.count(); ++k) width = std::min(width, least_width(shapes[k]));
  }
  const double thinnest = std::max(width / std::numbers::sqrt2, size / kMostSlender);
  return {.max_step = contact.step * thinnest,
          .tolerance = 1e-3 * thinnest,
          .jam_depth = 0.25 * contact.step * thinnest,
          .iterations = iterations,
          .friction = contact.friction,
          .static_friction = contact.static_friction};
}

void Scene::place_parts(std::size_t object, const Pose& at, OwnPolygons& out) const {
  for (Index p = first_parts_[object]; p < first_parts_[object + 1]; ++p) {
    Outline corners(parts_.polygons()[p].size());
    transform(at, parts_.polygons()[p], corners.data());
    out.add(corners);
  }
}

}  // namespace pushplan
