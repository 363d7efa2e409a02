"""Input of the solver, checked; each breach is one error that names it."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pushplan.errors import InvalidInputError, short
from pushplan.gtsp.distances import Distances
from pushplan.world.checks import FloatArray, IntArray

if TYPE_CHECKING:
    import networkx as nx

LARGEST = 1e290
"""Finite costs stay below this, so that no sum of them overflows."""
_PIECE = 1_000_000  # costs between two looks at a stop rule
LARGEST_WHOLE = 2**53
"""Whole numbers stay below this as a sum, so that float64 holds them exactly."""


def row_pieces(costs: NDArray[np.number]) -> list[slice]:
    """Rows of (N, N) costs that take a few milliseconds at a time."""
    step = max(1, _PIECE // max(costs.shape[1], 1))
    return [slice(low, min(low + step, len(costs))) for low in range(0, len(costs), step)]


def checked_costs(
    costs: ArrayLike, stopped: Callable[[], bool] = lambda: False
) -> NDArray[np.number]:
    """The cost matrix, not copied if it is an array already.

    Args:
        costs: the matrix.
        stopped: asked every few milliseconds; where it says so, the other rows are not looked at.

    Raises:
        InvalidInputError: if it is not square, not numeric, NaN, minus infinity or too large.
    """
    try:
        matrix = np.asarray(costs)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"costs must be an (N, N) array of numbers: {error}") from error
    if matrix.dtype.kind not in "iuf":
        raise InvalidInputError(f"costs must be numbers, got an array of {matrix.dtype}")
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not matrix.size:
        raise InvalidInputError(f"costs must have shape (N, N) with N >= 1, got {matrix.shape}")
    low = np.inf
    high = -np.inf  # of the finite ones
    for rows in row_pieces(matrix):
        if rows.start and stopped():
            break
        some = matrix[rows]
        low = np.minimum(low, some.min())
        top = some.max()
        if top == np.inf:
            top = some.max(where=some < np.inf, initial=-np.inf)
        high = np.maximum(high, top)
    if np.isnan(low):
        u, v = np.argwhere(np.isnan(matrix))[0]
        raise InvalidInputError(f"costs must not be NaN, got NaN from node {u} to node {v}")
    if low == -np.inf:
        u, v = np.argwhere(matrix == -np.inf)[0]
        raise InvalidInputError(
            f"costs must be above -inf, got -inf from node {u} to node {v}; +inf forbids an arc"
        )
    largest = 0.0
    if low < np.inf:
        largest = max(abs(float(low)), abs(float(high)))
    if matrix.dtype.kind in "iu" and largest * len(matrix) >= LARGEST_WHOLE:
        raise InvalidInputError(
            f"whole-number costs must add up to less than 2^53 on a tour, got {largest:g}"
        )
    if largest > LARGEST:
        raise InvalidInputError(
            f"finite costs must be at most {LARGEST:g} in size, got {largest:g}; inf forbids an arc"
        )
    return matrix


def checked_clusters(
    clusters: Sequence[Sequence[int]] | Sequence[IntArray], nodes: int
) -> tuple[IntArray, ...]:
    """The clusters as arrays of node numbers.

    Args:
        clusters: a partition of the nodes.
        nodes: N.

    Raises:
        InvalidInputError: if they are no partition of 0 to N - 1; the message names the nodes.
    """
    listed = hasattr(clusters, "__iter__") and getattr(clusters, "ndim", 1) > 0
    if isinstance(clusters, str | bytes) or not listed:
        raise InvalidInputError(f"clusters must be a sequence of node lists, got {clusters!r:.60}")
    found: list[IntArray] = []
    owner = np.full(nodes, -1, dtype=np.int64)
    for index, cluster in enumerate(clusters):
        try:
            members = np.asarray(cluster)
        except (TypeError, ValueError) as error:
            raise InvalidInputError(f"cluster {index} must be a list of nodes: {error}") from error
        if members.ndim != 1 or not members.size:
            raise InvalidInputError(
                f"cluster {index} must be a list of at least one node, got {cluster!r:.60}"
            )
        if members.dtype.kind not in "iu":
            raise InvalidInputError(
                f"cluster {index} must hold whole numbers, got an array of {members.dtype}"
            )
        for node in members.tolist():
            if not 0 <= node < nodes:
                raise InvalidInputError(
                    f"cluster {index} has node {node}, but nodes are 0 to {nodes - 1}"
                )
            if owner[node] >= 0:
                both = f"clusters {owner[node]} and {index}"
                where = f"cluster {index} twice" if owner[node] == index else both
                raise InvalidInputError(f"clusters must not overlap: node {node} is in {where}")
            owner[node] = index
        found.append(members.astype(np.int64))
    missing = np.flatnonzero(owner < 0)
    if missing.size:
        more = ", ..." if missing.size > 8 else ""
        raise InvalidInputError(
            f"every node must be in a cluster, but {missing.size} are in none: "
            f"{', '.join(map(str, missing[:8]))}{more}"
        )
    return tuple(found)


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
    import networkx  # whoever has a graph has loaded it

    if graph.is_multigraph():
        raise InvalidInputError("a graph must have one edge at most from node to node")
    for a, b, weight in graph.edges(data="weight"):
        if isinstance(weight, bool) or not isinstance(weight, int | float | np.number):
            raise InvalidInputError(
                f"the edge from {short(a)} to {short(b)} needs a number as weight, got "
                f"{short(weight)}"
            )
    costs = networkx.to_numpy_array(graph, weight="weight", nonedge=np.inf)
    clusters: dict[Hashable, list[int]] = {}
    for place, (name, cluster) in enumerate(graph.nodes(data="cluster")):
        if cluster is None or not isinstance(cluster, Hashable):
            raise InvalidInputError(
                f"node {short(name)} needs the name of its cluster as the attribute 'cluster', got "
                f"{short(cluster)}"
            )
        clusters.setdefault(cluster, []).append(place)
    return list(graph), costs, list(clusters.values())


def checked_nodes(label: str, nodes: object, names: Sequence[Any], size: int) -> IntArray:
    """Nodes that a caller names, as numbers.

    Args:
        label: name of the argument.
        nodes: the nodes.
        names: of all nodes, where the caller has given a graph; else empty.
        size: N.

    Raises:
        InvalidInputError: if one is no node, or is there twice.
    """
    if isinstance(nodes, str | bytes) or not hasattr(nodes, "__iter__"):
        raise InvalidInputError(f"{label} must be a sequence of nodes, got {short(nodes)}")
    places = {name: place for place, name in enumerate(names or range(size))}
    found: list[int] = []
    for node in nodes:
        if isinstance(node, bool) or not isinstance(node, Hashable) or node not in places:
            valid = "those of the graph" if names else f"0 to {size - 1}"
            raise InvalidInputError(f"{label} has node {short(node)}, but nodes are {valid}")
        if places[node] in found:
            raise InvalidInputError(f"{label} has node {short(node)} twice")
        found.append(places[node])
    return np.array(found, dtype=np.int64)


def check_tour(
    label: str,
    nodes: IntArray,
    costs: NDArray[np.number] | Distances,
    clusters: Sequence[IntArray],
    *,
    closed: bool = False,
) -> None:
    """Check that nodes lie in different clusters, and with ``closed`` are a tour.

    Args:
        label: name of the argument.
        nodes: in visiting order.
        costs: (N, N).
        clusters: the nodes of each.
        closed: every cluster has to be visited, over arcs that are not forbidden.

    Raises:
        InvalidInputError: naming what is wrong first.
    """
    owner = np.empty(len(costs), dtype=np.int64)
    for index, members in enumerate(clusters):
        owner[members] = index
    visits = np.bincount(owner[nodes], minlength=len(clusters))
    if visits.max(initial=0) > 1:
        raise InvalidInputError(f"{label} visits cluster {int(visits.argmax())} more than once")
    if not closed:
        return
    if not visits.all():
        raise InvalidInputError(f"{label} does not visit cluster {int(visits.argmin())}")
    forbidden = costs[nodes, np.roll(nodes, -1)] == np.inf
    if forbidden.any() and len(nodes) > 1:
        at = int(forbidden.argmax())
        following = nodes[(at + 1) % len(nodes)]
        raise InvalidInputError(f"{label} uses the forbidden arc {nodes[at]} to {following}")
