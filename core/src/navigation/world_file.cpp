#include <algorithm>
#include <cmath>
#include <istream>
#include <locale>
#include <ostream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "pushplan/geometry/polygon.hpp"
#include "pushplan/world.hpp"

namespace pushplan {
namespace {

using Numbers = std::vector<double>;

Outline left_round(Outline outline) {
  if (polygon_area(outline) < 0.0) std::ranges::reverse(outline);
  return outline;
}

/// Numbers of one line; "inf" and "nan" are among them.
Numbers numbers_in(std::istream& words) {
  Numbers numbers;
  for (std::string word; words >> word;) {
    std::istringstream one(word);
    one.imbue(std::locale::classic());
    double value = word == "nan" ? std::nan("") : std::numeric_limits<double>::infinity();
    if (word != "nan" && word != "inf" && !(one >> value && one.eof())) {
      throw std::invalid_argument("'" + word + "' is no number");
    }
    numbers.push_back(value);
  }
  return numbers;
}

Outline outline(const Numbers& n) {
  if (n.size() < 6 || n.size() % 2 != 0) {
    throw std::invalid_argument("it needs x and y of three corners or more, got " +
                                std::to_string(n.size()) + " numbers");
  }
  Outline corners;
  for (std::size_t i = 0; i + 1 < n.size(); i += 2) corners.push_back({n[i], n[i + 1]});
  return corners;
}

/// A world that is being read, line by line.
struct Reader {
  void take(const std::string& key, const Numbers& n);
  void take_robot(const Numbers& n);

  World world{};
  Box bounds{};
  OwnPolygons polygons{};
  std::vector<Wall> lines{};
};

void require_count(const Numbers& n, std::size_t count, bool or_more = false) {
  if (n.size() < count || (n.size() > count && !or_more)) {
    throw std::invalid_argument("it needs " + std::to_string(count) + " numbers, got " +
                                std::to_string(n.size()));
  }
}

void Reader::take_robot(const Numbers& n) {
  require_count(n, 9);
  if (!(n[0] >= 0.0 && n[0] <= 3.0)) throw std::invalid_argument("a drive is 0, 1, 2 or 3");
  if (!(n[1] >= 0.0 && n[1] < 1e6)) throw std::invalid_argument("wheels are counted from 0 on");
  const auto drive = static_cast<Drive>(static_cast<int>(n[0]));
  world.robot = {{}, static_cast<Index>(n[1]), n[2], drive, n[3], n[4], n[5], n[6], n[7], n[8]};
}

void Reader::take(const std::string& key, const Numbers& n) {
  if (key == "robot") return take_robot(n);
  if (key == "goal") {
    require_count(n, 7);
    world.goal = goal_from(n);
    return;
  }
  if (!std::ranges::all_of(n, [](double value) { return std::isfinite(value); })) {
    throw std::invalid_argument("it needs finite numbers");
  }
  if (key == "part") return world.robot.parts.push_back(outline(n));
  if (key == "polygon") return polygons.add(outline(n));
  if (key == "outline" && !world.objects.empty()) {
    return world.objects.back().parts.push_back(outline(n));
  }
  constexpr std::pair<const char*, std::size_t> kCounts[] = {
      {"pose", 3},   {"twist", 3},  {"bounds", 4}, {"line", 5},
      {"object", 5}, {"margin", 1}, {"prices", 5}};
  const auto known = std::ranges::find(kCounts, key, [](const auto& one) { return one.first; });
  if (known == std::end(kCounts)) throw std::invalid_argument("'" + key + "' is unknown here");
  require_count(n, known->second, key == "prices");
  if (key == "pose") world.robot_pose = {n[0], n[1], n[2]};
  if (key == "twist") world.robot_twist = {n[0], n[1], n[2]};
  if (key == "bounds") bounds = {n[0], n[1], n[2], n[3]};
  if (key == "line") lines.push_back({{{n[0], n[1]}, {n[2], n[3]}}, n[4]});
  if (key == "object") world.objects.push_back({{}, {n[0], n[1], n[2]}, n[3], n[4]});
  if (key == "margin") world.margin = n[0];
  if (key == "prices") {
    if (!(n[0] >= 1.0 && n[0] < 1e9)) throw std::invalid_argument("columns are counted from 1 on");
    world.prices = {{n.begin() + 5, n.end()}, static_cast<Index>(n[0]), {n[1], n[2], n[3]}, n[4]};
  }
}

void write(std::ostream& out, const char* key, const Numbers& numbers) {
  out << key;
  for (const double value : numbers) {
    out << ' ';
    if (std::isnan(value)) {
      out << "nan";
    } else if (std::isinf(value)) {
      out << "inf";
    } else {
      out << value;
    }
  }
  out << '\n';
}

void write(std::ostream& out, const char* key, Polygon corners) {
  Numbers numbers;
  for (const Vec2 p : corners) numbers.insert(numbers.end(), {p.x, p.y});
  write(out, key, numbers);
}

}  // namespace

std::shared_ptr<const StaticMap> make_map(const std::vector<Outline>& walls, const Box& bounds,
                                          std::vector<Wall> lines) {
  OwnPolygons polygons;
  for (const Outline& wall : walls) polygons.add(wall.empty() ? wall : left_round(wall));
  return std::make_shared<StaticMap>(std::move(polygons), std::move(lines), bounds);
}

GoalRegion goal_from(std::span<const double> n) {
  if (n[0] == 1.0) return {GoalRegion::Kind::kLine, {n[1], n[2]}, {n[3], n[4]}};
  return {GoalRegion::Kind::kDisc, {n[1], n[2]}, {}, n[3], n[5], false, n[6]};
}

Object make_object(const std::vector<Outline>& parts, double mass) {
  double area = 0.0;
  Vec2 middle{0.0, 0.0};
  for (const Outline& part : parts) {
    if (part.empty()) continue;
    const double own = std::abs(polygon_area(part));
    const Vec2 centre = polygon_centroid(part);
    middle = {middle.x + own * centre.x, middle.y + own * centre.y};
    area += own;
  }
  Object made{{}, {middle.x / area, middle.y / area, 0.0}, mass};
  for (Outline part : parts) {
    for (Vec2& p : part) p = {p.x - made.pose.x, p.y - made.pose.y};
    made.parts.push_back(part.empty() ? part : left_round(std::move(part)));
  }
  return made;
}

World read_world(std::istream& in) {
  Reader reader;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    std::istringstream words(line);
    std::string key;
    if (!(words >> key)) continue;
    try {
      reader.take(key, numbers_in(words));
    } catch (const std::invalid_argument& fault) {
      throw std::invalid_argument("line " + std::to_string(number) + ": " + fault.what());
    }
  }
  reader.world.map = std::make_shared<StaticMap>(std::move(reader.polygons),
                                                 std::move(reader.lines), reader.bounds);
  return std::move(reader.world);
}

void write_world(const World& world, std::ostream& out) {
  out.imbue(std::locale::classic());
  out.precision(std::numeric_limits<double>::max_digits10);
  const Robot& r = world.robot;
  write(out, "robot",
        Numbers{static_cast<double>(r.drive), static_cast<double>(r.wheels), r.mass, r.max_speed,
                r.min_speed, r.max_turn_rate, r.turning_radius, r.max_acceleration,
                r.max_turn_acceleration});
  for (const Outline& part : r.parts) write(out, "part", part);
  write(out, "pose", Numbers{world.robot_pose.x, world.robot_pose.y, world.robot_pose.theta});
  write(out, "twist", Numbers{world.robot_twist.x, world.robot_twist.y, world.robot_twist.theta});
  const StaticMap& map = *world.map;
  const Box& box = map.bounds();
  write(out, "bounds", Numbers{box.x_min, box.y_min, box.x_max, box.y_max});
  for (Index k = 0; k < map.polygons().count(); ++k) write(out, "polygon", map.polygons()[k]);
  for (const auto& [line, radius] : map.lines()) {
    write(out, "line", Numbers{line.from.x, line.from.y, line.to.x, line.to.y, radius});
  }
  for (const Object& object : world.objects) {
    const Pose& at = object.pose;
    write(out, "object", Numbers{at.x, at.y, at.theta, object.mass, object.gyration_square});
    for (const Outline& part : object.parts) write(out, "outline", part);
  }
  const GoalRegion& goal = world.goal;
  if (goal.kind == GoalRegion::Kind::kLine) {
    write(out, "goal",
          Numbers{1.0, goal.point.x, goal.point.y, goal.normal.x, goal.normal.y, 0.0, 0.0});
  } else {
    write(out, "goal",
          Numbers{0.0, goal.point.x, goal.point.y, goal.radius, 0.0, goal.heading,
                  goal.heading_tolerance});
  }
  write(out, "margin", Numbers{world.margin});
  if (world.prices.values.empty()) return;
  const Prices& prices = world.prices;
  Numbers numbers{static_cast<double>(prices.columns), prices.origin.x, prices.origin.y,
                  prices.origin.theta, prices.cell};
  numbers.insert(numbers.end(), prices.values.begin(), prices.values.end());
  write(out, "prices", numbers);
}

}  // namespace pushplan
