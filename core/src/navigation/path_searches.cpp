#include "path_searches.hpp"

#include <cmath>
#include <mutex>

namespace pushplan {
namespace {

constexpr std::size_t kTables = 4;  // that are kept with a map
constexpr double kPatienceGrowth = 1.25;
constexpr double kMassSpread = 0.7;  // deviation of the logarithm of objects' costs, from search to
                                     // search
constexpr double kArc = 2.0;         // length of an edge of a search [cells of the table]
constexpr Index kNodes = 100'000;    // of one search at most
constexpr double kMemory = 48.0;     // of the objects' poses in one search at most [MiB]
constexpr Index kExpansions = 30;    // half the arcs driven at most between two pauses
constexpr double kSlack = 1.05;  // cost of a path of a search, over the best, that is shortcut
constexpr double kMostRatio = 2.0;  // the same at most: more inflation would make searches greedy

}  // namespace

/// A table that planning calls on a map share, with what is done of it.
struct PathSearches::Table {
  Table(Polygons wall_parts, const ConvexObstacles& walls, const GoalRegion& goal, double size,
        double radius)
      : parts(copy_of(wall_parts)), maker({parts.polygons(), size}, walls, goal, size, radius) {}

  /// True if there is nothing more to do.
  bool step() {
    const std::lock_guard lock(mutex);
    if (!maker.done()) maker.step();
    return maker.done();
  }

  OwnPolygons parts;
  CostToGoMaker maker;
  std::mutex mutex;
};

Task<bool> PathSearches::make_table() {
  const PlannerOptions& options = session_.scene.options;
  const bool wanted = options.search == SearchKind::kPushAware && options.uses(Part::kSearches);
  if (!wanted) co_return false;
  const Scene& scene = session_.scene;
  const Polygons parts = scene.wall_parts();
  const GoalRegion goal = improver_.room().goal;
  const double radius = improver_.turning_radius();
  std::vector<double> key{static_cast<double>(goal.kind), goal.point.x,  goal.point.y,
                          goal.normal.x, goal.normal.y, goal.radius, radius, scene.size};
  for (Index k = 0; k < parts.count(); ++k) {
    for (const Vec2 p : parts[k]) key.insert(key.end(), {p.x, p.y});
  }
  const StaticMap& map = *improver_.problem().map;
  const auto make = [&] {
    return std::make_shared<Table>(parts, map.walls(), goal, scene.size, radius);
  };
  table_ = map.kept<Table>(std::move(key), make, kTables);
  while (!table_->step()) co_await session_.pauses.point();
  co_return table_->maker.useful();
}

/// The cost of the best plan over that of its path without objects. Among many objects the rest of
/// a path costs so much more than its length, too, and a search that knows wastes no time on what
/// only looks cheap.
double PathSearches::cost_ratio() const {
  const double length = table_->maker.table().length_to_go(improver_.problem().start);
  const double alone = improver_.robot().mass * length;
  if (!improver_.solved() || !(alone > 0.0 && alone < kInfinity)) return kUnsolvedRatio;
  return std::min(std::max(improver_.best_cost() / alone, 1.0), kMostRatio);
}

Task<void> PathSearches::search(double least_inflation) {
  const double usual = session_.scene.options.heuristic_inflation;
  double inflation = least_inflation;
  if (inflation == 0.0) inflation = std::max(usual, 0.5 * (1.0 + cost_ratio()));
  Variant usual_one{kArc,  // with a name, as GCC 12 destroys unnamed aggregates twice here
                    2, inflation, session_.scene.masses};
  co_await run(std::move(usual_one));
}

Task<void> PathSearches::search_at_random() {
  if (!session_.scene.options.uses(Part::kVariants)) {
    co_await search();
    co_return;
  }
  Random& random = session_.random;
  const double usual = session_.scene.options.heuristic_inflation;
  const double most = std::max(1.03 * usual, cost_ratio());
  Variant variant{kArc * (0.7 + 0.8 * random.uniform()), 1 + static_cast<int>(random.below(3)), 0.0, session_.scene.masses};
  variant.inflation = 0.98 * usual + (most - 0.98 * usual) * random.uniform();
  for (double& mass : variant.masses) mass *= std::exp(kMassSpread * random.normal());
  co_await run(std::move(variant));
}

/// Arcs to drive between two pauses.
Index PathSearches::batch() const {
  const auto objects = static_cast<Index>(session_.scene.object_count());
  return std::max<Index>(1, 10 * kExpansions / (10 + objects));
}

Task<void> PathSearches::run(Variant variant) {
  const CostToGo table = table_->maker.table();
  const PushTree::CellShape cells{table.rows(), table.columns(), table.headings()};
  const std::size_t objects = session_.scene.object_count();
  if (!nodes_) nodes_.emplace(kNodes, static_cast<Index>(objects), kMemory, cells);
  if (nodes_->cells().count() != cells.count()) nodes_->set_cells(cells);
  nodes_->plant(improver_.lead().pose, improver_.lead().objects, 0.0);
  ++session_.counts.searches;
  std::vector<double> curvatures;
  for (int i = -variant.turns; i <= variant.turns; ++i) {
    curvatures.push_back(i / (variant.turns * improver_.turning_radius()));
  }
  const Branching branching{curvatures, variant.arc * table.cells.step, variant.inflation,
                            session_.scene.options.pruning_factor, variant.masses};
  const PathProblem problem = improver_.path_problem();
  const auto search = session_.pushing.search(*nodes_, table, branching,
                                              kSlack * improver_.plan_cost(), problem);
  SearchStatus status = SearchStatus::kPaused;
  while (status == SearchStatus::kPaused && !nodes_->full) {
    co_await session_.pauses.point();
    const Index before = nodes_->driven;
    if (static_cast<double>(before) >= patience_) {
      patience_ *= kPatienceGrowth;  // the trees may know better meanwhile
      co_return;
    }
    status = search->run(2 * batch());
    const Index driven = nodes_->driven - before;
    session_.count(std::max<Index>(1, driven));
    session_.counts.expansions += driven;
  }
  if (status == SearchStatus::kFound) {
    std::vector<Arc> arcs = nodes_->arcs_to(search->goal());
    co_await try_arcs(std::move(arcs));
  }
}

/// Shortcuts the path along some arcs, where it could be a plan.
Task<void> PathSearches::try_arcs(std::vector<Arc> arcs) {
  std::optional<Candidate> candidate = co_await improver_.candidate(std::move(arcs), improver_.jam_cost());
  if (candidate) co_await improver_.work_out(*candidate);
}

}  // namespace pushplan
