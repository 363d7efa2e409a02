#include "pushplan/geometry/shortest_path.hpp"

#include <algorithm>
#include <cmath>

namespace pushplan {
namespace {

constexpr Index kSearchWork = 20'000;     // of a piece of a search, about half a millisecond
constexpr Index kEstimatedWork = 8'000;   // the same with estimates, which take their time
constexpr Index kEstimateCells = 10'000;  // of a piece of estimates
constexpr int kLongPieces = 20;           // of a search, after which it takes long
constexpr int kPlainPieces = 5;           // the same where there are many corners

GoalScene scene_of(const StaticMap& map, const GrownMap& grown, const OwnRegions& goal) {
  return {goal.view(), grown.obstacles(), map.bounds(), grown.gap()};
}

/// Leads a path there from the start that begins where the clearance is kept.
Route with_way_out(Vec2 start, Route route, double gap) {
  const Vec2 free = route.points[0];
  const double away = std::hypot(free.x - start.x, free.y - start.y);
  if (std::isinf(route.length)) return {};
  if (away > 2.5 * gap) {
    route.points.insert(route.points.begin(), start);
    route.length += away;
  } else {
    route.points[0] = start;
  }
  return route;
}

}  // namespace

OwnRegions regions_of(const GoalRegion& goal) {
  if (goal.kind == GoalRegion::Kind::kDisc) return {{{goal.point, goal.radius}}};
  return {{}, {{goal.point, goal.normal}}};
}

ShortestPath::ShortestPath(const StaticMap& map, double clearance, Vec2 start, OwnRegions goal,
                           Estimates estimates)
    : map_(GrownMap::of(map, clearance)),
      start_(start),
      free_(start),
      goal_(std::move(goal)),
      scene_(scene_of(map, *map_, goal_)),
      patience_(map_->has_many_corners() ? kPlainPieces : kLongPieces) {
  if (estimates == Estimates::kNever || map.cores().vertices.size() <= kSomeCorners) patience_ = -1;
  if (estimates == Estimates::kAlways) patience_ = 0;
}

bool ShortestPath::run() {
  if (!map_->run()) return false;
  if (step_ == Step::kBegin) {
    begin();
  } else if (step_ == Step::kSearch) {
    search();
  } else if (step_ == Step::kEstimate && estimate_->run(kEstimateCells)) {
    step_ = Step::kSearch;
    search_.reset();
  }
  return step_ == Step::kDone;
}

void ShortestPath::begin() {
  const std::optional<Vec2> free = map_->way_out(start_);
  step_ = free ? Step::kSearch : Step::kDone;
  if (!free) return;
  free_ = *free;
  const auto corners = map_->corners().points;
  places_.assign(corners.begin(), corners.end());
  const std::vector<Vec2> ends = map_->rim_ends(scene_.regions);
  places_.insert(places_.end(), ends.begin(), ends.end());
}

void ShortestPath::search() {
  if (patience_-- == 0) {
    estimate_.emplace(map_->covered_sides(), scene_.regions, free_);
    step_ = Step::kEstimate;
    return;
  }
  if (!search_) {
    Corners corners = map_->corners();
    corners.points = places_;
    search_.emplace(free_, corners, scene_, map_->grid(), map_->standoff(),
                    estimate_ ? &*estimate_ : nullptr);
  }
  const VisibilitySearch::Outcome outcome = search_->run(estimate_ ? kEstimatedWork : kSearchWork);
  if (outcome == VisibilitySearch::Outcome::kPaused) return;
  step_ = Step::kDone;
  if (outcome == VisibilitySearch::Outcome::kFound) finish();
}

void ShortestPath::finish() {
  const std::vector<Index> nodes = search_->path();
  Route route{0.0, {free_}};
  for (const Index node : nodes) route.points.push_back(places_[at(node)]);
  const std::size_t count = route.points.size();
  if (nodes.empty() || at(nodes.back()) < map_->corners().owner.size()) {  // on into the goal
    const GoalLeg leg = goal_leg(route.points.back(), scene_);
    route.length = leg.length;
    if (leg.length > 0.0) route.points.push_back(leg.end);
  }
  for (std::size_t i = count; --i > 0;) {
    const Vec2 there = route.points[i];
    const Vec2 here = route.points[i - 1];
    route.length += std::hypot(there.x - here.x, there.y - here.y);
  }
  route_ = with_way_out(start_, std::move(route), map_->gap());
}

GoalDistances::GoalDistances(const StaticMap& map, double clearance, OwnRegions goal)
    : map_(GrownMap::of(map, clearance)),
      goal_(std::move(goal)),
      scene_(scene_of(map, *map_, goal_)) {
  map_->make();
  const Bends bends = map_->bend_graph().bends();
  const std::vector<Vec2> ends = map_->rim_ends(scene_.regions);
  OwnRegions rims;
  for (const Vec2 end : ends) rims.discs.push_back({end, 0.0});
  const GoalScene to_rims = scene_of(map, *map_, rims);
  std::vector<double> distances;
  std::vector<Vec2> exits;
  for (const Vec2 p : bends.points) {
    const GoalLeg leg = goal_leg(p, scene_);
    const GoalLeg rim = goal_leg(p, to_rims);
    distances.push_back(std::min(leg.length, rim.length));
    exits.push_back(rim.length < leg.length ? rim.end : leg.end);
  }
  std::vector<Index> parents(bends.points.size(), kGoalLeg);
  map_->bend_graph().relax(distances, parents);
  distances.resize(bends.points.size() + ends.size(), 0.0);
  std::vector<Index> order;
  for (std::size_t i = 0; i < distances.size(); ++i) {
    if (std::isfinite(distances[i])) order.push_back(static_cast<Index>(i));
  }
  std::ranges::stable_sort(order, {}, [&](Index i) { return distances[at(i)]; });
  std::vector<Index> rank(distances.size());
  for (std::size_t i = 0; i < order.size(); ++i) rank[at(order[i])] = static_cast<Index>(i);
  for (const Index node : order) {
    const bool is_bend = node < bends.count();
    const Index parent = is_bend ? parents[at(node)] : kGoalLeg;
    places_.push_back(is_bend ? bends.points[at(node)] : ends[at(node - bends.count())]);
    incoming_.push_back(is_bend ? bends.incoming[at(node)] : Vec2{0.0, 0.0});
    outgoing_.push_back(is_bend ? bends.outgoing[at(node)] : Vec2{0.0, 0.0});
    exits_.push_back(is_bend ? exits[at(node)] : places_.back());
    distances_.push_back(distances[at(node)]);
    parents_.push_back(parent == kGoalLeg ? kGoalLeg : rank[at(parent)]);
  }
}

Route GoalDistances::path_from(Vec2 start) const {
  const std::optional<Vec2> free = map_->way_out(start);
  if (!free) return {};
  const GoalLeg leg = goal_leg(*free, scene_);
  Route route{leg.length, {*free}};
  const NodeLeg over =
      node_leg(*free, leg.length, kNoLeg, false, nodes(), scene_.obstacles, scene_.gap);
  if (over.node != kNoLeg) {
    route.length = over.distance;
    Index last = over.node;
    for (Index node = last; node != kGoalLeg; node = parents_[at(node)]) {
      route.points.push_back(places_[at(node)]);
      last = node;
    }
    const Vec2 exit = exits_[at(last)];
    if (exit.x != places_[at(last)].x || exit.y != places_[at(last)].y)
      route.points.push_back(exit);
  } else if (leg.length > 0.0) {
    route.points.push_back(leg.end);
  }
  return with_way_out(start, std::move(route), scene_.gap);
}

void GoalDistances::fill(ArrayView<double, 2> out, const Cells& cells) const {
  fill_distances(out, cells, nodes(), scene_, map_->standoff());
}

}  // namespace pushplan
