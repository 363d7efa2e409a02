#include <nanobind/stl/tuple.h>

#include <algorithm>
#include <tuple>

#include "arrays.hpp"
#include "pushplan/gtsp/exact.hpp"
#include "pushplan/gtsp/problem.hpp"
#include "pushplan/gtsp/ruin_recreate.hpp"
#include "pushplan/gtsp/walks.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

namespace {

gtsp::WalkClusters walk_clusters(const Floats<1>& prices, const Integers<1>& sizes,
                                 const Integers<3>& moves) {
  return {view(prices), view(sizes), view(moves)};
}

constexpr Index kMostNeighbours = 1'000'000;  // neighbours; a problem has fewer

/// An order of all clusters.
std::span<const Index> order_of(const Integers<1>& order, Index clusters) {
  const auto places = view(order);
  require_count("order", places.size(), clusters);
  std::vector<char> seen(places.size(), 0);
  for (const Index cluster : places) {
    require_index("order", cluster, clusters);
    if (seen[static_cast<std::size_t>(cluster)]) {
      refuse("order", std::to_string(cluster) + " twice", "of different clusters");
    }
    seen[static_cast<std::size_t>(cluster)] = 1;
  }
  return places;
}

std::span<const Index> as_span(const std::vector<Index>& values) { return values; }

using PathsTuple =
    std::tuple<IntegersOut<1>, IntegersOut<1>, FloatsOut<1>, FloatsOut<1>, IntegersOut<1>>;

template <class Paths>
Paths paths_of(const PathsTuple& arrays) {
  const auto& [sets, ends, values, rests, parents] = arrays;
  return {view(sets), view(ends), view(values), view(rests), view(parents)};
}

}  // namespace

void bind_gtsp(nb::module_& module) {
  module.attr("SPARE") = gtsp::kSpare;

  nb::class_<gtsp::Problem>(module, "Problem", "Costs with the nodes ordered by clusters.")
      .def(
          "__init__",
          [](gtsp::Problem* self, const Floats<2>& costs, const Floats<2>& reverse,
             const Floats<2>& into, const Floats<2>& onto, const Integers<1>& offsets,
             const Integers<2>& near, const Floats<2>& between, bool symmetric) {
            new (self) gtsp::Problem{view(costs),   view(reverse), view(into),    view(onto),
                                     view(offsets), view(near),    view(between), symmetric};
          },
          "costs"_a, "reverse"_a, "into"_a, "onto"_a, "offsets"_a, "near"_a, "between"_a,
          "symmetric"_a, nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>(),
          nb::keep_alive<1, 5>(), nb::keep_alive<1, 6>(), nb::keep_alive<1, 7>(),
          nb::keep_alive<1, 8>());

  nb::class_<gtsp::RuinRecreate>(module, "RuinRecreate",
                                 "Annealed ruin and recreate on orders of clusters.")
      .def(
          "__init__",
          [](gtsp::RuinRecreate* self, const gtsp::Problem& problem, const Integers<1>& order,
             std::uint64_t seed, Index max_removed, double blink, Index reach) {
            const auto places = order_of(order, problem.clusters());
            require_between("max_removed", max_removed, 1,
                            std::max(Index{1}, problem.clusters() - 2));
            require_between("reach", reach, 0, kMostNeighbours);
            new (self) gtsp::RuinRecreate(problem, {max_removed, blink, reach},
                                          {places.begin(), places.end()}, seed);
          },
          "problem"_a, "order"_a, "seed"_a, "max_removed"_a, "blink"_a, "reach"_a,
          nb::keep_alive<1, 2>())
      .def(
          "start",
          [](gtsp::RuinRecreate& self, const Integers<1>& order) {
            self.start(order_of(order, static_cast<Index>(self.current().order.size())));
          },
          "order"_a, ReleaseGil())
      .def("start_from_best", &gtsp::RuinRecreate::start_from_best)
      .def("run", &gtsp::RuinRecreate::run, "temperature"_a, "tolerance"_a, "rounds"_a,
           ReleaseGil())
      .def(
          "narrow",
          [](gtsp::RuinRecreate& self, const gtsp::Problem& problem, const Integers<1>& kept) {
            self.narrow(problem, view(kept));
          },
          "problem"_a, "kept"_a, nb::keep_alive<1, 2>())
      .def_prop_ro("cost", [](const gtsp::RuinRecreate& self) { return self.current().cost; })
      .def_prop_ro("best_cost", [](const gtsp::RuinRecreate& self) { return self.best().cost; })
      .def_prop_ro("random_state", &gtsp::RuinRecreate::random_state)
      .def_prop_ro(
          "order", [](const gtsp::RuinRecreate& s) { return copied(as_span(s.current().order)); },
          kOwned)
      .def_prop_ro(
          "nodes", [](const gtsp::RuinRecreate& s) { return copied(as_span(s.current().nodes)); },
          kOwned)
      .def_prop_ro(
          "best_order", [](const gtsp::RuinRecreate& s) { return copied(as_span(s.best().order)); },
          kOwned)
      .def_prop_ro(
          "best_nodes", [](const gtsp::RuinRecreate& s) { return copied(as_span(s.best().nodes)); },
          kOwned)
      .def_prop_ro(
          "least_slack", [](const gtsp::RuinRecreate& s) { return copied(s.least_slack()); },
          kOwned)
      .def_prop_ro(
          "total_slack", [](const gtsp::RuinRecreate& s) { return copied(s.total_slack()); },
          kOwned);

  module.def(
      "mark_needed",
      [](const Floats<2>& costs, const Floats<2>& reverse, const Integers<1>& offsets,
         const IntegersOut<1>& needed) {
        gtsp::mark_needed(view(costs), view(reverse), view(offsets), view(needed));
      },
      "costs"_a, "reverse"_a, "offsets"_a, "needed"_a, ReleaseGil());

  module.def(
      "fill_subsets",
      [](Index low, Index high, const FloatsOut<3>& table, const Floats<4>& blocks,
         const Integers<1>& sizes, const Floats<2>& first) {
        gtsp::fill_subsets(low, high, view(table), view(blocks), view(sizes), view(first));
      },
      "low"_a, "high"_a, "table"_a, "blocks"_a, "sizes"_a, "first"_a, ReleaseGil());

  module.def(
      "extend_walks",
      [](const Floats<3>& walks, const FloatsOut<3>& longer, const Floats<4>& blocks,
         const Integers<3>& moves, const Floats<1>& prices, const Integers<1>& sizes, Index low,
         Index high) {
        gtsp::extend_walks(view(walks), view(longer), view(blocks),
                           walk_clusters(prices, sizes, moves), low, high);
      },
      "walks"_a, "longer"_a, "blocks"_a, "moves"_a, "prices"_a, "sizes"_a, "low"_a, "high"_a,
      ReleaseGil());

  module.def(
      "read_visits",
      [](const Floats<4>& walks, const Floats<2>& first, const Floats<4>& blocks,
         const Integers<3>& moves, const Floats<1>& prices, const Integers<1>& sizes,
         const IntegersOut<1>& visits) {
        return gtsp::read_visits(view(walks), view(first), view(blocks),
                                 walk_clusters(prices, sizes, moves), view(visits));
      },
      "walks"_a, "first"_a, "blocks"_a, "moves"_a, "prices"_a, "sizes"_a, "visits"_a, ReleaseGil());

  module.def(
      "extend_paths",
      [](const Floats<3>& within, const Floats<4>& costs, const Integers<2>& lists,
         const Floats<1>& prices, const Integers<1>& sizes, double limit, const PathsTuple& paths,
         Index low, Index high, const IntegersOut<1>& slots, const PathsTuple& longer,
         Index found) {
        const gtsp::PathBounds bounds{view(within), view(costs), view(lists),
                                      view(prices), view(sizes), limit};
        return gtsp::extend_paths(bounds, paths_of<gtsp::ConstPaths>(paths), low, high, view(slots),
                                  paths_of<gtsp::Paths>(longer), found);
      },
      "within"_a, "costs"_a, "lists"_a, "prices"_a, "sizes"_a, "limit"_a, "paths"_a, "low"_a,
      "high"_a, "slots"_a, "longer"_a, "found"_a, ReleaseGil());
}

}  // namespace pushplan::bindings
