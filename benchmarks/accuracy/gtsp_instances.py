"""Families of GTSP instances by seed, made like the public ones: whole costs, Fischetti's clusters.

Each family has four sizes; the seed draws one of them and all the rest. See `FAMILIES`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from pushplan.gtsp.distances import distances

NODES_PER_CLUSTER = 5
"""As in the public instances (Fischetti, Salazar González and Toth 1997)."""
SIZES = (50, 90, 140, 220)
"""Clusters."""


class Instance(NamedTuple):
    """A matrix and its clusters."""

    costs: np.ndarray  # (N, N)
    clusters: list[list[int]]


def instance(family: str, seed: int) -> Instance:
    """The instance of a family for a seed; four seeds in a row have four sizes."""
    return FAMILIES[family](np.random.default_rng(seed), SIZES[seed % len(SIZES)])


def far_apart(costs: np.ndarray, count: int) -> list[list[int]]:
    """Fischetti's clusters: centres far from each other, every node goes to the nearest one."""
    both = np.minimum(costs, costs.T)
    centres = [int(both[0].argmax())]
    away = both[centres[0]].astype(float)
    while len(centres) < count:
        away[centres] = -1.0
        centres.append(int(away.argmax()))
        away = np.minimum(away, both[centres[-1]])
    owner = both[centres].argmin(axis=0)
    owner[centres] = np.arange(count)
    return [np.flatnonzero(owner == c).tolist() for c in range(count)]


def uniform(rng: np.random.Generator, count: int) -> Instance:
    """Points of a square."""
    points = rng.integers(0, 4000, (NODES_PER_CLUSTER * count, 2)).astype(float)
    costs = distances(points, "EUC_2D")
    return Instance(costs, far_apart(costs, count))


def towns(rng: np.random.Generator, count: int) -> Instance:
    """Points in heaps."""
    nodes = NODES_PER_CLUSTER * count
    centres = rng.uniform(0.0, 4000.0, (max(5, count // 8), 2))
    spread = rng.normal(0.0, 150.0, (nodes, 2))
    points = np.round(centres[rng.integers(0, len(centres), nodes)] + spread)
    costs = distances(points, "EUC_2D")
    return Instance(costs, far_apart(costs, count))


def drilling(rng: np.random.Generator, count: int) -> Instance:
    """Holes of a circuit board: rows of pins on a grid, and single holes; Euclidean costs."""
    nodes = NODES_PER_CLUSTER * count
    holes = set[tuple[int, int]]()
    while len(holes) < nodes:
        x, y = (int(v) for v in rng.integers(0, 38, 2) * 100)
        pins = int(rng.choice((1, 1, 4, 7, 8)))
        across = bool(rng.integers(2))
        for pin in range(pins):
            for row in range(2 if pins > 1 else 1):
                step = (100 * pin, 300 * row)
                holes.add((x + step[across], y + step[not across]))
    points = np.array(sorted(holes), dtype=float)
    costs = distances(rng.permutation(points)[:nodes], "EUC_2D")
    return Instance(costs, far_apart(costs, count))


def crane(rng: np.random.Generator, count: int) -> Instance:
    """Jobs of a stacker crane: empty travel from the end of one to the begin of the next.

    Most jobs begin or end at one of two doors of the store, so that many costs are equal, many 0.
    """
    nodes = NODES_PER_CLUSTER * count
    doors = np.array([[0, 0], [30, 0]])
    shelf = rng.integers(0, (31, 9), (2, nodes, 2))
    door = doors[rng.integers(0, 2, (2, nodes))]
    at_door = rng.random((2, nodes, 1)) < 0.3
    begin, end = np.where(at_door, door, shelf)
    steps = np.abs(end[:, None] - begin[None])  # (from, to, axis)
    costs = np.maximum(steps[..., 0], 3 * steps[..., 1]).astype(float)
    np.fill_diagonal(costs, 0.0)
    return Instance(costs, far_apart(costs, count))


def roads(rng: np.random.Generator, count: int) -> Instance:
    """Shortest ways in a town of which half of the streets are one-way."""
    nodes = NODES_PER_CLUSTER * count
    side = int(np.ceil(np.sqrt(2.0 * nodes)))
    number = np.arange(side * side).reshape(side, side)
    here = np.concatenate([number[:, :-1].ravel(), number[:-1].ravel()])
    there = np.concatenate([number[:, 1:].ravel(), number[1:].ravel()])
    length = rng.integers(5, 30, len(here))
    ways = rng.random((2, len(here)))
    forward = ways[0] < 0.75
    backward = (ways[0] >= 0.75) | (ways[1] < 0.5)
    # the wrong way takes eight times as long, which keeps every corner within reach
    slow = 8 * length
    rows = np.concatenate([here, there])
    columns = np.concatenate([there, here])
    weights = np.concatenate([np.where(forward, length, slow), np.where(backward, length, slow)])
    graph = coo_matrix((weights, (rows, columns)), shape=(side * side,) * 2).tocsr()
    stops = rng.choice(side * side, nodes, replace=False)
    costs = dijkstra(graph, indices=stops)[:, stops]
    return Instance(costs, far_apart(costs, count))


def boxes(rng: np.random.Generator, count: int) -> Instance:
    """A robot, boxes in a square, 8 pushes of each over the nearest edge on their way."""
    return pushes(count, 8, rng)


def pushes(count: int, options: int, rng: np.random.Generator) -> Instance:
    """A robot in a 10 m square, boxes, straight pushes of each over the nearest edge on their way.

    Costs are the approach to the pushing pose, 1 for each metre of it, the push, 2 for each metre,
    and up to 0.5 for each push; going back to the start is free.
    """
    box = rng.uniform(1.0, 9.0, (count, 1, 2))
    angle = rng.uniform(0.0, 2.0 * np.pi, (count, 1)) + np.arange(options) * 2.0 * np.pi / options
    way = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    with np.errstate(divide="ignore"):
        out = np.where(way > 0.0, (10.0 - box) / way, -box / way).min(axis=-1)
    begin = np.concatenate([[[5.0, 5.0]], (box - 0.6 * way).reshape(-1, 2)])
    end = np.concatenate([[[5.0, 5.0]], (box + way * out[..., None]).reshape(-1, 2)])
    costs = np.linalg.norm(end[:, None] - begin[None], axis=-1)
    costs[:, 1:] += (2.0 * out + rng.uniform(0.0, 0.5, out.shape)).reshape(-1)
    costs[:, 0] = 0.0
    groups = [list(range(1 + b * options, 1 + (b + 1) * options)) for b in range(count)]
    return Instance(costs, [[0], *groups])


FAMILIES: dict[str, Callable[[np.random.Generator, int], Instance]] = {
    "uniform": uniform,
    "towns": towns,
    "drilling": drilling,
    "crane": crane,
    "roads": roads,
    "boxes": boxes,
}
