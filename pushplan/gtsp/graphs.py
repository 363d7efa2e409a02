"""Instances given as NetworkX graphs whose nodes carry their cluster."""

from __future__ import annotations

from collections.abc import Hashable
from typing import TYPE_CHECKING, Any

import numpy as np

from pushplan.errors import InvalidInputError, short
from pushplan.world.checks import FloatArray

if TYPE_CHECKING:
    import networkx as nx


def graph_instance(graph: nx.Graph[Any]) -> tuple[list[Any], FloatArray, list[list[int]]]:
    """Names, costs and clusters of a graph.

    Args:
        graph: its nodes have the attribute ``cluster``, its edges ``weight``. An edge that is
            missing is forbidden; one of an undirected graph costs the same both ways.

    Returns:
        The N nodes in the order of the graph, (N, N) costs, and the positions of the nodes of each
        cluster, clusters in the order in which they first occur.

    Raises:
        InvalidInputError: if it has parallel edges, or lacks a cluster or a weight.
    """
    if graph.is_multigraph():
        raise InvalidInputError("a graph must have one edge at most from node to node")
    names = list(graph)
    position = {name: place for place, name in enumerate(names)}
    costs = np.full((len(names), len(names)), np.inf)
    for a, b, weight in graph.edges(data="weight"):
        if isinstance(weight, bool) or not isinstance(weight, int | float | np.number):
            raise InvalidInputError(
                f"the edge from {short(a)} to {short(b)} needs a number as weight, got "
                f"{short(weight)}"
            )
        costs[position[a], position[b]] = weight
        if not graph.is_directed():
            costs[position[b], position[a]] = weight
    clusters: dict[Hashable, list[int]] = {}
    for name, cluster in graph.nodes(data="cluster"):
        if cluster is None or not isinstance(cluster, Hashable):
            raise InvalidInputError(
                f"node {short(name)} needs the name of its cluster as the attribute 'cluster', got "
                f"{short(cluster)}"
            )
        clusters.setdefault(cluster, []).append(position[name])
    return names, costs, list(clusters.values())
