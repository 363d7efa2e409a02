#include "pushplan/geometry/grown_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pushplan/arithmetic.hpp"

namespace pushplan {
namespace {

constexpr double kGap = 1e-7;              // of paths to obstacles [diagonals of the map]
constexpr double kSmallRadius = 1e-3;      // smaller arcs get fewer corners [diagonals of the map]
constexpr double kArcStep = kTurn / 72.0;  // turn per corner; an arc gets 0.06 % longer [rad]
constexpr double kCoarse = 3.0;   // factor on it with many corners: an arc gets 0.6 % longer
constexpr double kExcess = 7e-4;  // fraction by which paths may be too long with fine arcs
constexpr double kCell = 0.6;  // side of a cell of estimates [clearances]; larger ones look through
                               // more closed passages
constexpr std::size_t kPiece = 4'000;  // corners drawn in about half a millisecond

double diagonal(const Box& box) { return std::hypot(box.x_max - box.x_min, box.y_max - box.y_min); }

/// The heading [rad] of the outward normal of the edge that leaves corner `i`.
double normal_heading(Polygon core, std::size_t i) {
  const Vec2 a = core[i];
  const Vec2 b = core[next_corner(core, i)];
  return std::atan2(-(b.x - a.x), b.y - a.y);
}

/// The turn [rad] of an outline at corner `i`, between the normals before and after it.
double turn_at(Polygon core, std::size_t i, double before, double after) {
  if (core.size() == 2 && core[0].x == core[1].x && core[0].y == core[1].y) {
    return i == 0 ? kTurn : 0.0;  // a point is turned around at once
  }
  const double turn = floor_mod(after - before, kTurn);
  return turn > 0.75 * kTurn ? 0.0 : turn;  // rounding of a straight corner
}

}  // namespace

std::shared_ptr<GrownMap> GrownMap::of(const StaticMap& map, double clearance) {
  return map.kept<GrownMap>({clearance},
                            [&] { return std::make_shared<GrownMap>(map, clearance); });
}

GrownMap::GrownMap(const StaticMap& map, double clearance)
    : map_(map), clearance_(clearance), gap_(kGap * diagonal(map.bounds())) {
  double largest = kSmallRadius * diagonal(map.bounds());
  for (Index k = 0; k < map.cores().count(); ++k) {
    const Index line = k - map.polygons().count();
    const double r = (line < 0 ? 0.0 : map.lines()[at(line)].radius) + clearance;
    const Box box = box_around(map.cores()[k]);
    radii_.push_back(r);
    boxes_.push_back({box.x_min - r, box.y_min - r, box.x_max + r, box.y_max + r});
    largest = std::max(largest, r);
  }
  const double step = kArcStep * (has_many_corners() ? kCoarse : 1.0);
  // 1 / cos(step / 2) - 1, which is step^2 / 8 for small steps and 1.35 times that at the coarsest
  standoff_ = 1.5 * (step * step) / 8.0 * largest + 4.0 * gap_;
}

double GrownMap::excess() const {
  return has_many_corners() ? kExcess * kCoarse * kCoarse : kExcess;
}

bool GrownMap::run() {
  const std::lock_guard lock(mutex_);
  const std::size_t end = points_.size() + kPiece;
  while (middles_.size() < radii_.size() && points_.size() < end) {
    draw(static_cast<Index>(middles_.size()));
  }
  if (grid_) return true;
  if (points_.size() < end) grid_.emplace(obstacles(), gap_);
  return false;
}

/// Draws the polygon around an obstacle.
void GrownMap::draw(Index k) {
  const Polygon core = map_.cores()[k];
  const double small = kSmallRadius * diagonal(map_.bounds()) / std::max(radii_[at(k)], 1e-300);
  const double step = std::min(0.25 * kTurn, kArcStep * (has_many_corners() ? kCoarse : 1.0) *
                                                 std::sqrt(std::max(1.0, small)));
  const double radius = radii_[at(k)] + 2.0 * gap_;
  const std::size_t begin = points_.size();
  double before = normal_heading(core, core.size() - 1);
  for (std::size_t i = 0; i < core.size(); ++i) {
    const double after = normal_heading(core, i);
    const double turn = turn_at(core, i, before, after);
    const double count = std::ceil(turn / step - 1e-9);
    const double part = turn / std::max(count, 1.0);
    const double reach = radius / std::cos(part / 2.0);
    for (double n = 0.0; n < count; n += 1.0) {
      const double angle = before + part * (n + 0.5);
      points_.push_back({core[i].x + reach * std::cos(angle), core[i].y + reach * std::sin(angle)});
    }
    before = after;
  }
  owner_.resize(points_.size(), k);
  first_.push_back(static_cast<Index>(points_.size()));
  std::vector<Segment> sides;
  add_sides(k, sides);
  incoming_.resize(points_.size());
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const auto& [from, to] = sides[i];
    const double length = std::hypot(to.x - from.x, to.y - from.y);
    outgoing_.push_back({(to.x - from.x) / length, (to.y - from.y) / length});
    incoming_[begin + (i + 1) % sides.size()] = outgoing_.back();
  }
  const Box box = box_around(sides.empty() ? core : outlines()[k]);
  middles_.push_back({0.5 * (box.x_min + box.x_max), 0.5 * (box.y_min + box.y_max)});
  halves_.push_back({0.5 * (box.x_max - box.x_min), 0.5 * (box.y_max - box.y_min)});
}

const CoveredSides& GrownMap::covered_sides() {
  const std::lock_guard lock(mutex_);
  if (!covered_sides_) covered_sides_.emplace(outlines(), map_.bounds(), kCell * clearance_);
  return *covered_sides_;
}

const BendGraph& GrownMap::bend_graph() {
  const std::lock_guard lock(mutex_);
  if (!bend_graph_) bend_graph_.emplace(corners().bends(), obstacles(), map_.bounds(), gap_);
  return *bend_graph_;
}

bool GrownMap::keeps_clearance(Vec2 p) const {
  for (Index k = 0; k < map_.cores().count(); ++k) {
    const bool near = boxes_[at(k)].contains(p, gap_);
    if (near && core_distance(p, map_.cores()[k]) - radii_[at(k)] < gap_) return false;
  }
  return true;
}

bool GrownMap::is_free(Vec2 p) const {
  return map_.bounds().contains(p, gap_) && keeps_clearance(p);
}

/// Adds the sides of the polygon around an obstacle.
void GrownMap::add_sides(Index k, std::vector<Segment>& sides) const {
  const Polygon drawn = outlines()[k];
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    sides.push_back({drawn[i], drawn[next_corner(drawn, i)]});
  }
}

std::array<Segment, 4> GrownMap::sides_of_bounds() const {
  const auto [x0, y0, x1, y1] = map_.bounds();
  return {{{{x0, y0}, {x1, y0}}, {{x1, y0}, {x1, y1}}, {{x1, y1}, {x0, y1}}, {{x0, y1}, {x0, y0}}}};
}

std::optional<Vec2> GrownMap::way_out(Vec2 p) const {
  if (keeps_clearance(p)) return p;
  const std::shared_ptr<GrownMap> bare = of(map_, 0.0);
  if (obstacle_distance(p, bare->obstacles()) < -gap_) return std::nullopt;
  for (double reach = 2.0 * std::ranges::max(radii_) + gap_;; reach *= 2.0) {
    std::vector<Index> near;
    for (Index k = 0; k < map_.cores().count(); ++k) {
      const Box& box = boxes_[at(k)];
      const double away = std::hypot(std::max({box.x_min - p.x, p.x - box.x_max, 0.0}),
                                     std::max({box.y_min - p.y, p.y - box.y_max, 0.0}));
      if (away <= reach) near.push_back(k);
    }
    std::vector<Vec2> places = crossings(near);
    for (const Index k : near) places.push_back(pushed_out(p, k));
    const auto step = [&](Vec2 place) { return std::hypot(place.x - p.x, place.y - p.y); };
    std::ranges::stable_sort(places, {}, step);
    for (const Vec2 place : places) {
      if (near.size() < radii_.size() && step(place) > reach) break;
      if (is_free(place) && line_of_sight(p, place, bare->obstacles(), -2.0 * gap_)) return place;
    }
    if (near.size() == radii_.size()) return std::nullopt;
  }
}

/// The points where polygons around some obstacles cross each other or the bounds.
std::vector<Vec2> GrownMap::crossings(std::span<const Index> near) const {
  std::vector<Segment> sides;
  std::vector<std::size_t> begins{0};
  for (const Index k : near) {
    add_sides(k, sides);
    begins.push_back(sides.size());
  }
  const auto sides_of = [&](std::size_t i) {
    return std::span(sides).subspan(begins[i], begins[i + 1] - begins[i]);
  };
  std::vector<Vec2> places = segment_crossings(sides_of_bounds(), sides);
  for (std::size_t i = 0; i < near.size(); ++i) {
    for (std::size_t j = i + 1; j < near.size(); ++j) {
      if (boxes_[at(near[i])].apart(boxes_[at(near[j])], 2.0 * standoff_)) continue;
      const auto found = segment_crossings(sides_of(i), sides_of(j));
      places.insert(places.end(), found.begin(), found.end());
    }
  }
  return places;
}

/// The point that is carried straight to just outside of an obstacle.
Vec2 GrownMap::pushed_out(Vec2 p, Index k) const {
  const Polygon core = map_.cores()[k];
  double least = std::numeric_limits<double>::infinity();
  Vec2 foot = core[0];
  Vec2 direction{1.0, 0.0};
  for (std::size_t i = 0; i < core.size(); ++i) {
    const Vec2 a = core[i];
    const Vec2 b = core[next_corner(core, i)];
    const double dx = b.x - a.x;
    const double dy = b.y - a.y;
    const double along = (p.x - a.x) * dx + (p.y - a.y) * dy;
    const double t = std::clamp(along / std::max(dx * dx + dy * dy, 1e-300), 0.0, 1.0);
    const Vec2 q{a.x + t * dx, a.y + t * dy};
    const double distance = std::hypot(p.x - q.x, p.y - q.y);
    if (distance >= least) continue;
    least = distance;
    foot = q;
    direction = {p.x - q.x, p.y - q.y};
    if (direction.x == 0.0 && direction.y == 0.0) direction = {dy, -dx};  // out of the edge
  }
  const double size = std::hypot(direction.x, direction.y);
  const Vec2 unit = size > 0.0 ? Vec2{direction.x / size, direction.y / size} : Vec2{1.0, 0.0};
  const double reach = radii_[at(k)] + 2.0 * gap_;
  return {foot.x + reach * unit.x, foot.y + reach * unit.y};
}

std::vector<Vec2> GrownMap::rim_ends(const Regions& goal) const {
  double reach = standoff_;
  std::vector<Vec2> around(goal.polygons.vertices.begin(), goal.polygons.vertices.end());
  for (const auto& [centre, radius] : goal.discs) {
    around.push_back(centre);
    reach = std::max(reach, radius + standoff_);
  }
  std::vector<Segment> sides;
  for (Index k = 0; k < map_.cores().count(); ++k) {
    // only obstacles near a goal can cover a part of it, unless that reaches as far as they do
    const bool is_near = !around.empty() && !boxes_[at(k)].apart(box_around(around), reach);
    if (is_near || !goal.half_planes.empty()) add_sides(k, sides);
  }
  for (const Segment& side : sides_of_bounds()) sides.push_back(side);
  std::vector<Vec2> ends = region_crossings(goal, sides);
  std::erase_if(ends, [&](Vec2 end) { return !is_free(end); });
  return ends;
}

}  // namespace pushplan
