#include "arrays.hpp"
#include "pushplan/search/astar.hpp"
#include "pushplan/search/grid_dijkstra.hpp"
#include "pushplan/search/search_tree.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

namespace {

void require_node(const SearchTree& tree, Index node) { require_index("node", node, tree.size()); }
void require_known(const SearchTree& tree, Index node) {
  require_node(tree, node);
  if (!tree.known(node)) refuse("node", std::to_string(node), "one that was offered");
}

/// A question about a node that can be answered for known ones only.
template <auto question>
auto known_only(const SearchTree& tree, Index node) {
  require_known(tree, node);
  return (tree.*question)(node);
}

}  // namespace

void bind_search(nb::module_& module) {
  nb::enum_<SearchStatus>(module, "SearchStatus", "How far a search has come.")
      .value("EXHAUSTED", SearchStatus::kExhausted, "No path exists.")
      .value("FOUND", SearchStatus::kFound, "The cheapest open node is a goal.")
      .value("PAUSED", SearchStatus::kPaused, "The budget was used up.");
  nb::class_<SearchTree>(module, "SearchTree", "Cheapest paths known so far, and the open nodes.")
      .def(nb::init<Index>(), "size"_a)
      .def("clear", &SearchTree::clear)
      .def(
          "offer",
          [](SearchTree& self, Index node, double cost, double bound, Index parent, Index edge) {
            require_node(self, node);
            if (parent != SearchTree::kNone) require_known(self, parent);
            self.offer(node, cost, bound, parent, edge);
          },
          "node"_a, "cost"_a, "bound"_a, "parent"_a, "edge"_a)
      .def("take", &SearchTree::take)
      .def(
          "known",
          [](const SearchTree& self, Index node) {
            require_node(self, node);
            return self.known(node);
          },
          "node"_a)
      .def("closed", known_only<&SearchTree::closed>, "node"_a)
      .def("cost", known_only<&SearchTree::cost>, "node"_a)
      .def("parent", known_only<&SearchTree::parent>, "node"_a)
      .def("edge", known_only<&SearchTree::edge>, "node"_a)
      .def("next",
           [](const SearchTree& self) {
             require_room("open nodes", static_cast<std::size_t>(self.open_count()), 1);
             return self.next();
           })
      .def_prop_ro(
          "open_nodes",
          [](const SearchTree& self) {
            const std::vector<Index> nodes = self.open_nodes();
            return copied(std::span<const Index>(nodes));
          },
          kOwned)
      .def_prop_ro("open_count", &SearchTree::open_count)
      .def_prop_ro("expanded", &SearchTree::expanded)
      .def(
          "path",
          [](const SearchTree& self, Index node) {
            require_known(self, node);
            const std::vector<SearchTree::Step> steps = self.path(node);
            return copied_rows<Index>(std::span(steps));
          },
          "node"_a, kOwned, "(P, 2) nodes from a start on, and the labels of the edges to them.");

  nb::class_<GridDijkstra>(module, "GridDijkstra", "Dijkstra's algorithm over the cells of a grid.")
      .def(
          "__init__",
          [](GridDijkstra* self, const Floats<2>& weights, double cell, const Integers<1>& starts) {
            require_indices("starts", view(starts), view(weights).size());
            new (self) GridDijkstra(view(weights), cell, view(starts));
          },
          "weights"_a, "cell"_a, "starts"_a, nb::keep_alive<1, 2>())
      .def(
          "settle",
          [](GridDijkstra& self, const Array<const bool, 2>& goals, Index upto) {
            require_count("rows of goals", goals.shape(0), self.costs().extent(0));
            require_count("columns of goals", goals.shape(1), self.costs().extent(1));
            return self.settle(view(goals), upto);
          },
          "goals"_a, "upto"_a, ReleaseGil())
      .def_prop_ro(
          "costs",
          [](const GridDijkstra& self) {
            const auto costs = self.costs();
            const auto copy = zeros<double, 2>({static_cast<std::size_t>(costs.extent(0)),
                                                static_cast<std::size_t>(costs.extent(1))});
            std::copy_n(costs.data(), costs.size(), copy.data());
            return copy;
          },
          kOwned)
      .def_prop_ro(
          "parents", [](const GridDijkstra& self) { return copied(self.parents()); }, kOwned)
      .def_prop_ro("order", [](const GridDijkstra& self) { return copied(self.order()); }, kOwned);
}

}  // namespace pushplan::bindings
