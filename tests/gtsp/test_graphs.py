"""NetworkX graphs in place of a matrix and lists."""

from __future__ import annotations

import networkx as nx
import numpy as np
import pytest

from pushplan.gtsp import TourStatus, solve_gtsp
from pushplan.world import Deadline, InvalidInputError


def graph_of(costs: np.ndarray, clusters: list[list[str]], names: list[str]) -> nx.DiGraph:
    graph = nx.DiGraph()
    for cluster, members in enumerate(clusters):
        graph.add_nodes_from(members, cluster=f"cluster {cluster}")
    for i, a in enumerate(names):
        for j, b in enumerate(names):
            if i != j:
                graph.add_edge(a, b, weight=costs[i, j])
    return graph


def test_a_graph_is_solved_as_its_matrix_is() -> None:
    costs = np.random.default_rng(0).random((9, 9))
    names = list("abcdefghi")
    tour = solve_gtsp(costs, [[0], [1, 2, 3, 4], [5, 6, 7, 8]])
    found = solve_gtsp(graph_of(costs, [["a"], list("bcde"), list("fghi")], names))
    assert found.nodes == tuple(names[node] for node in tour.nodes)
    assert found.cost == tour.cost == tour.lower_bound and found.status is TourStatus.OPTIMAL


def test_tours_of_a_graph_are_given_by_its_names() -> None:
    costs = np.random.default_rng(0).random((9, 9))
    graph = graph_of(costs, [["a"], list("bcde"), list("fghi")], list("abcdefghi"))
    found = solve_gtsp(graph, initial="b i a".split(), fixed_start=["b", "i"], stop=Deadline(0.0))
    assert found.nodes == ("b", "i", "a")
    assert solve_gtsp(graph, initial=found).cost <= found.cost
    with pytest.raises(InvalidInputError, match="initial has node 'z', but nodes are those of the"):
        solve_gtsp(graph, initial=["a", "b", "z"])


def test_an_edge_that_is_missing_is_forbidden_and_an_undirected_one_leads_both_ways() -> None:
    graph = nx.Graph()
    graph.add_nodes_from([(0, {"cluster": "x"}), (1, {"cluster": "y"}), (2, {"cluster": "z"})])
    graph.add_weighted_edges_from([(0, 1, 1.0), (1, 2, 2.0)])
    assert solve_gtsp(graph).status is TourStatus.INFEASIBLE
    graph.add_edge(0, 2, weight=4)
    assert solve_gtsp(graph).cost == 7.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda g: g.add_node("new"), "node 'new' needs the name of its cluster"),
        (lambda g: g.add_edge("a", "b"), "the edge from 'a' to 'b' needs a number as weight"),
        (lambda g: g.add_edge("a", "b", weight="1"), "needs a number as weight, got '1'"),
        (lambda g: g.add_edge("a", "b", weight=np.nan), "must not be NaN"),
        (lambda g: g.add_node("a", cluster=[1]), "node 'a' needs the name of its cluster"),
    ],
)
def test_what_a_graph_lacks_is_named(change, words: str) -> None:
    graph = nx.DiGraph()
    graph.add_nodes_from([("a", {"cluster": 0}), ("b", {"cluster": 1})])
    change(graph)
    with pytest.raises(InvalidInputError, match=words):
        solve_gtsp(graph)


def test_empty_graphs_parallel_edges_and_costs_alone_are_refused() -> None:
    with pytest.raises(InvalidInputError, match="N >= 1"):
        solve_gtsp(nx.DiGraph())
    with pytest.raises(InvalidInputError, match="one edge at most"):
        solve_gtsp(nx.MultiDiGraph())
    with pytest.raises(InvalidInputError, match="clusters must be given"):
        solve_gtsp(np.ones((3, 3)))
