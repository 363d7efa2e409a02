#include "guided_drive.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "pushplan/geometry/shortest_path.hpp"
#include "pushplan/motion/recovery.hpp"
#include "pushplan/motion/reeds_shepp.hpp"
#include "tree_paths.hpp"

namespace pushplan {
namespace {

constexpr double kFar = 30.0;           // edges of a tree in a straight line beyond which it is far
constexpr double kSharp = 0.8;          // turn beyond which a bend is driven through its ends [rad]
constexpr double kWide = 1.25;          // clearance of a guide that is wide of the walls [R]
constexpr double kBeyondRadius = 1.02;  // the same at least, so that curves fit [turning radii]
constexpr double kNarrow = 1.1;         // clearance of the other one [R]

constexpr std::array kLevels{4.0, 8.0, 16.0};  // lengths of the way before and behind a place that
                                               // a window replaces, one after the other [R]
constexpr double kMargin = 6.0;     // of a window around what it replaces, at the first level [R]
constexpr double kRoom = 1.1;       // clearance where a window ends [R]
constexpr double kWindowGoal = 0.5; // radius of its goal [R]
constexpr int kWindows = 60;        // along one guide at most
constexpr Index kIterations = 2'000;  // of the search in one window at most
constexpr double kStraight = 2.0;   // distance behind a window to the next via [turning radii]

/// Poses on a polyline: some at each bend, one `depth` [m] past its end.
std::vector<Pose> vias_on(std::span<const Vec2> corners, double radius, double depth) {
  std::vector<Vec2> ends;
  std::vector<double> lengths;
  std::vector<double> headings;
  for (std::size_t i = 1; i < corners.size(); ++i) {
    const Vec2 leg{corners[i].x - corners[i - 1].x, corners[i].y - corners[i - 1].y};
    const double length = std::hypot(leg.x, leg.y);
    if (length <= 1e-9 * radius) continue;
    const double heading = std::atan2(leg.y, leg.x);
    const double before = headings.empty() ? heading : headings.back();
    ends.push_back(corners[i]);
    lengths.push_back(length);
    headings.push_back(before + wrap_angle(heading - before));
  }
  std::vector<Pose> vias;
  if (ends.empty()) return vias;
  std::size_t first = 0;
  for (std::size_t i = 1; i < ends.size(); ++i) {
    // the corners from the first on follow each other closely: they are one bend
    if (lengths[i] < radius && i + 1 < ends.size()) continue;
    std::vector<std::size_t> at{(first + i - 1) / 2};
    if (std::abs(headings[i] - headings[first]) > kSharp) at = {first, at[0], i - 1};
    at.erase(std::unique(at.begin(), at.end()), at.end());
    for (const std::size_t k : at) {
      vias.push_back({ends[k].x, ends[k].y, 0.5 * (headings[k] + headings[k + 1])});
    }
    first = i;
  }
  const double last = headings.back();
  vias.push_back({ends.back().x + depth * std::cos(last), ends.back().y + depth * std::sin(last), last});
  return vias;
}

/// The shortest curves through some poses; they may touch walls and objects.
std::vector<Arc> curves_through(const PathImprover& improver, std::span<const Pose> vias, Pose from) {
  std::vector<Arc> arcs;
  for (const Pose& via : vias) {
    const auto curve = shortest_curve(from, via, improver.turning_radius(), improver.robot().curves_back());
    arcs.insert(arcs.end(), curve.arcs.begin(), curve.arcs.end());
    from = via;
  }
  return arcs;
}

/// The map with objects among what is static.
std::shared_ptr<const StaticMap> with_objects(const PathImprover& improver) {
  const StaticMap& map = *improver.problem().map;
  OwnPolygons polygons = copy_of(map.polygons());
  const std::vector<Pose>& objects = improver.problem().objects;
  for (std::size_t k = 0; k < objects.size(); ++k) {
    improver.session().scene.place_parts(k, objects[k], polygons);
  }
  return std::make_shared<StaticMap>(
      std::move(polygons), std::vector<Wall>(map.lines().begin(), map.lines().end()), map.bounds());
}

/// True if curves through some poses are a path without a jam.
Task<bool> is_way(PathImprover& improver, const std::vector<Pose>& vias) {
  if (vias.empty()) co_return false;
  if (!improver.robot().slides()) {
    std::vector<Arc> arcs = curves_through(improver, vias, improver.lead().pose);
    co_return co_await improver.drives(std::move(arcs));
  }
  std::vector<Vec2> places;
  for (const Pose& via : vias) places.push_back({via.x, via.y});
  co_return co_await improver.slides(std::move(places));
}

/// A path that begins as it will stay, and goes on in curves along the rest of a guide.
class GuidedDrive {
 public:
  GuidedDrive(PathImprover& improver, std::vector<Pose> vias)
      : improver_(improver),
        session_(improver.session()),
        vias_(std::move(vias)),
        path_(improver.laid_out(improver.problem().start, improver.lead().arcs, 1.0)) {}

  /// Searches windows where the curves fail; true where that leads to a plan.
  Task<bool> run();

 private:
  struct Fault {
    Index pose;   // the first at which the robot touches a wall or jams; the number of poses if none
    double cost;  // up to there, infinite where it jams [kg m]
  };

  void follow_guide();
  void append(Index kept, const SweptPath& tail);
  Task<Fault> first_fault();
  Task<bool> arrives(double cost);
  Task<bool> search_around(Index fault, double reach);
  Index end_from(std::span<const double> lengths, double along,
                 std::span<const Pose> objects) const;
  std::vector<double> lengths() const;

  PathImprover& improver_;
  Session& session_;
  std::vector<Pose> vias_;     // along the rest of the guide
  std::vector<double> bends_;  // lengths at which they are reached [m]
  SweptPath path_;
  Index known_ = 1;  // poses up to which the path stays, and the objects are known
};

/// Driven lengths up to each pose.
std::vector<double> GuidedDrive::lengths() const {
  std::vector<double> along{0.0};
  const auto poses = path_.used();
  for (std::size_t i = 1; i < poses.size(); ++i) {
    along.push_back(along.back() +
                    std::hypot(poses[i].x - poses[i - 1].x, poses[i].y - poses[i - 1].y));
  }
  return along;
}

/// Puts the poses of a path from its second on in the place of what comes after the first `kept`.
void GuidedDrive::append(Index kept, const SweptPath& tail) {
  const auto curvatures = std::span(tail.curvatures).first(tail.used().size());
  path_.append(kept, tail.used().subspan(1), curvatures.subspan(1));
}

void GuidedDrive::follow_guide() {
  const Pose end = path_.used().back();
  double at = lengths().back();
  const std::vector<Arc> arcs = curves_through(improver_, vias_, end);
  append(path_.count, improver_.laid_out(end, arcs, 1.0));
  bends_.clear();
  const std::size_t each = arcs.size() / std::max<std::size_t>(1, vias_.size());
  for (std::size_t i = 0; i < arcs.size(); ++i) {
    at += std::abs(arcs[i].length);
    if ((i + 1) % each == 0) bends_.push_back(at);
  }
}

Task<bool> GuidedDrive::run() {
  follow_guide();
  double reached = 0.0;
  std::size_t level = 0;
  for (int i = 0; i < kWindows; ++i) {
    const Fault fault = co_await first_fault();
    if (fault.pose == path_.count) co_return co_await arrives(fault.cost);
    const double at = lengths()[static_cast<std::size_t>(fault.pose)];
    if (at > reached + improver_.size()) {
      level = 0;
      reached = at;
    }
    bool found = false;
    while (!found) {
      if (level == kLevels.size()) co_return false;
      found = co_await search_around(fault.pose, kLevels[level++]);
    }
    follow_guide();
  }
  co_return false;
}

Task<GuidedDrive::Fault> GuidedDrive::first_fault() {
  const Index blocked = improver_.first_blocked(path_, known_);
  const double jam = improver_.jam_cost();
  const double cost = co_await improver_.sweep(path_, blocked, jam, known_);
  if (cost < jam) co_return Fault{blocked, cost};
  const double most = jam / improver_.robot().mass;
  Index at = 0;
  while (at + 1 < blocked && path_.lengths[static_cast<std::size_t>(at)] < most) ++at;
  co_return Fault{at, kInfinity};
}

/// Keeps the path, with the heading of the goal at its end; true if that is a plan.
Task<bool> GuidedDrive::arrives(double cost) {
  std::optional<SweptPath> ended = improver_.ended(std::move(path_));
  if (!ended || !improver_.reached_by(ended->used().back())) co_return false;
  const auto path = std::make_shared<SweptPath>(std::move(*ended));
  if (improver_.has_pose_goal()) {
    cost = co_await improver_.sweep(*path, path->count, improver_.jam_cost());
  }
  improver_.keep(path, cost);
  co_return improver_.solved();
}

/// The first pose from a length [m] on at which there is room for the robot; `lengths` are those
/// driven up to each pose.
Index GuidedDrive::end_from(std::span<const double> lengths, double along,
                            std::span<const Pose> objects) const {
  const double room = kRoom * improver_.size();
  const auto& radii = session_.scene.radii;
  const ConvexObstacles walls = improver_.problem().map->walls();
  for (Index n = std::ranges::lower_bound(lengths, along) - lengths.begin(); n + 1 < path_.count; ++n) {
    const Pose& at = path_.poses[static_cast<std::size_t>(n)];
    bool free = can_turn({at.x, at.y}, room, walls);
    for (std::size_t k = 0; k < objects.size() && free; ++k) {
      free = std::hypot(objects[k].x - at.x, objects[k].y - at.y) - radii[k] > room;
    }
    if (free) return n;
  }
  return path_.count - 1;
}

/// The part of a map that lies in a box.
std::shared_ptr<const StaticMap> cropped(const StaticMap& map, const Box& box) {
  const Box& all = map.bounds();
  const Box inside{std::max(box.x_min, all.x_min), std::max(box.y_min, all.y_min),
                   std::min(box.x_max, all.x_max), std::min(box.y_max, all.y_max)};
  OwnPolygons polygons;
  std::vector<Wall> lines;
  const Index count = map.polygons().count();
  for (Index k = 0; k < static_cast<Index>(map.boxes().size()); ++k) {
    if (map.boxes()[static_cast<std::size_t>(k)].apart(inside, 0.0)) continue;
    if (k < count) {
      polygons.add(map.polygons()[k]);
    } else {
      lines.push_back(map.lines()[static_cast<std::size_t>(k - count)]);
    }
  }
  return std::make_shared<StaticMap>(std::move(polygons), std::move(lines), inside);
}

/// Cuts the path before a fault, and goes on with another way to behind it if there is one.
Task<bool> GuidedDrive::search_around(Index fault, double reach) {
  const double size = improver_.size();
  const std::vector<double> along = lengths();
  const double at = along[static_cast<std::size_t>(fault)];
  const auto before = std::ranges::upper_bound(along, at - reach * size) - along.begin();
  const Index first = std::max<Index>(before - 1, 0);
  const auto row = path_.objects_at(first);
  Problem part{nullptr, path_.poses[static_cast<std::size_t>(first)], {row.begin(), row.end()}, improver_.goal()};
  const Index last = end_from(along, at + reach * size, part.objects);
  const bool is_last = last == path_.count - 1;
  const Pose& end = path_.poses[static_cast<std::size_t>(last)];
  if (!is_last) part.goal = {GoalRegion::Kind::kDisc, {end.x, end.y}, {}, kWindowGoal * size};
  Box box{end.x, end.y, end.x, end.y};
  for (Index n = first; n <= last; ++n) {
    const Pose& p = path_.poses[static_cast<std::size_t>(n)];
    box = {std::min(box.x_min, p.x), std::min(box.y_min, p.y), std::max(box.x_max, p.x), std::max(box.y_max, p.y)};
  }
  const double wide = (kMargin + reach) * size;
  part.map = cropped(*improver_.problem().map, {box.x_min - wide, box.y_min - wide, box.x_max + wide, box.y_max + wide});
  PathImprover window(session_, std::move(part), improver_.turning_radius());
  window.make_window(kIterations);
  TreePaths trees(window);
  co_await trees.search_window();
  if (!window.solved()) co_return false;
  known_ = first + 1;
  append(known_, *window.best());
  const double left = along[static_cast<std::size_t>(last)] + kStraight * improver_.turning_radius();
  std::vector<Pose> rest;
  for (std::size_t i = 0; i < vias_.size() && !is_last; ++i) {
    if (bends_[i] > left || i + 1 == vias_.size()) rest.push_back(vias_[i]);
  }
  vias_ = std::move(rest);
  co_return true;
}

}  // namespace

bool is_far(const PathImprover& improver) {
  const Pose& start = improver.problem().start;
  return improver.goal().distance({start.x, start.y}) > kFar * kEdge * improver.size();
}

Task<std::vector<Pose>> guide(PathImprover& improver, bool wide, bool around) {
  const double size = improver.size();
  const GoalRegion goal = improver.goal();
  double depth = 1.01 * kInset * size;
  if (goal.kind == GoalRegion::Kind::kDisc) depth = goal.radius - 0.99 * improver.room().goal.radius;
  double radius = improver.turning_radius();
  if (improver.robot().slides()) radius = kTightest * size;  // it may follow every corner
  const auto map = around ? with_objects(improver) : improver.problem().map;
  const double clearance = wide ? std::max(kWide * size, kBeyondRadius * radius) : kNarrow * size;
  const Pose start = improver.lead().pose;
  ShortestPath search(*map, clearance, {start.x, start.y}, regions_of(goal));
  while (!search.run()) co_await improver.session().pauses.point();
  if (search.points().size() < 2) co_return std::vector<Pose>{};
  co_return vias_on(search.points(), radius, depth);
}

Task<bool> along_guide(PathImprover& improver, bool around) {
  for (const bool wide : {true, false}) {
    const std::vector<Pose> vias = co_await guide(improver, wide, around);
    if (co_await is_way(improver, vias)) co_return true;
  }
  co_return false;
}

Task<void> warm_start(PathImprover& improver) {
  const PlannerOptions& options = improver.session().scene.options;
  if (!options.uses(Part::kGuidedDrive)) co_return;
  const bool far = is_far(improver);
  for (const bool wide : {true, false}) {
    std::vector<Pose> vias = co_await guide(improver, wide);
    if (vias.empty()) continue;
    if (co_await is_way(improver, vias)) break;
    if (!far || !options.uses(Part::kWindows)) continue;
    GuidedDrive drive(improver, std::move(vias));
    if (co_await drive.run()) break;
  }
  if (far && improver.solved()) co_await improver.work_out_best();
}

}  // namespace pushplan
