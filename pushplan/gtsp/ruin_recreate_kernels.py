"""Ruin and recreate on orders of clusters; every insertion sees every choice of nodes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.gtsp.layer_kernels import (
    Layers,
    build,
    close_gap,
    insertion_cost,
    keep,
    link_in,
    make_layers,
    undo,
)
from pushplan.gtsp.node_choice_kernels import SPARE, below, best_nodes, draw
from pushplan.gtsp.segment_swap_kernels import improve_by_swaps
from pushplan.world.checks import FloatArray, IntArray

FRESH_ROUNDS = 500
"""Values are computed from scratch this often, so that rounding does not add up."""


@kernel(inline=True)
def _ruin(
    tour: Layers,
    near: IntArray,
    removed: IntArray,
    gone: IntArray,
    target: int,
    root: int,
    now: int,
    tolerance: float,
    state: IntArray,
) -> tuple[int, float]:
    """Take out strings of clusters near a random one; how many, and the change of cost."""
    # Christiaens and Vanden Berghe 2020
    longest = 1 + below(state, target)
    seed = below(state, len(gone))
    found = 0
    change = 0.0
    for index in range(near.shape[1] + 1):
        c = seed if index == 0 else near[seed, index - 1]
        if found >= target:
            break
        if gone[c] or c == root:
            continue
        length = min(1 + below(state, longest), target - found)
        for _ in range(below(state, length)):
            if tour.before[c] != root:
                c = tour.before[c]
        a = tour.before[c]
        carried = 0.0
        while length > 0 and c != root:
            keep(tour, c, now)
            carried += tour.carry[c]
            gone[c] = 1
            removed[found] = c
            found += 1
            length -= 1
            c = tour.after[c]
        change += close_gap(tour, a, c, carried, root, now, tolerance)
    for i in range(found - 1, 0, -1):
        j = below(state, i + 1)
        removed[i], removed[j] = removed[j], removed[i]
    return found, change


@kernel(inline=True)
def _bring_forward(
    near: IntArray,
    between: FloatArray,
    removed: IntArray,
    gone: IntArray,
    low: int,
    high: int,
    farthest: bool,
) -> None:
    """Put the removed cluster that is farthest from the tour, or nearest to it, next in turn."""
    best = -1.0
    pick = low
    for i in range(low, high):
        c = removed[i]
        away = np.inf
        for index in range(near.shape[1]):
            if not gone[near[c, index]]:
                away = between[c, index]
                break
        if best < 0.0 or (away > best if farthest else away < best):
            best = away
            pick = i
    removed[low], removed[pick] = removed[pick], removed[low]


@kernel(inline=True)
def _cheapest_place(
    tour: Layers,
    near: IntArray,
    gone: IntArray,
    seen: IntArray,
    c: int,
    root: int,
    blink: float,
    state: IntArray,
) -> int:
    """Behind which cluster c is cheapest, next to one of its neighbours; a few are overlooked."""
    lowest = np.inf
    place = root
    interval = int(2.0 / blink) if blink > 0.0 else 0
    skip = below(state, interval) if interval else -1
    seen[-1] += 1
    stamp = seen[-1]
    for index in range(2 * near.shape[1]):
        d = near[c, index >> 1]
        if gone[d]:
            continue
        a = d if index & 1 else tour.before[d]
        if seen[a] == stamp:
            continue
        seen[a] = stamp
        if skip == 0:
            skip = below(state, interval)
            continue
        skip -= 1
        cost = insertion_cost(tour, c, a, tour.after[a], lowest)
        if cost < lowest:
            lowest = cost
            place = a
    return place


@kernel
def _to_front(order: IntArray, root: int, scratch: IntArray) -> None:
    """Rotate a closed order so that it begins with the root."""
    p = 0
    while order[p] != root:
        p += 1
    copy_into(scratch, order)
    for q in range(len(order)):
        order[q] = scratch[(p + q) % len(order)]


class TourProblem(NamedTuple):
    """Input of a ruin-and-recreate search."""

    costs: FloatArray  # (N, N + SPARE) finite
    reverse: FloatArray  # (N, N + SPARE) of the transpose
    into: FloatArray  # (m, N) cheapest arc from each cluster to each node
    onto: FloatArray  # (m, N) cheapest arc from each node to each cluster
    offsets: IntArray  # (m + 1,) with m at least 3
    near: IntArray  # (m, k) clusters by distance
    between: FloatArray  # (m, k) these distances
    max_removed: int  # Clusters that a round removes at most, at most m - 2
    blink: float  # Fraction of places that an insertion overlooks
    reach: int  # Neighbours that a segment swap tries
    symmetric: bool  # True if a reversed segment costs the same


class TourState(NamedTuple):
    """State of a search; all of it is changed."""

    current: IntArray  # (m,) order, the root (a small cluster) first
    current_nodes: IntArray  # (m,) its nodes
    best: IntArray  # (m,) best order so far
    best_nodes: IntArray  # (m,) its nodes
    values: FloatArray  # (2,) costs of both
    slack: FloatArray  # (2, N) what tours cost more by through each node: the least, and the sum
    random: IntArray  # (1,) state of the random numbers


@kernel(allocates=True)
def search_tours(
    problem: TourProblem, found: TourState, temperature: float, tolerance: float, rounds: int
) -> None:
    """Some rounds of simulated annealing; costs within the tolerance count as equal."""
    (
        costs,
        reverse,
        into,
        onto,
        offsets,
        near,
        between,
        max_removed,
        blink,
        reach,
        symmetric,
    ) = problem
    current, current_nodes, best, best_choice, values, slack, state = found
    count = len(offsets) - 1
    root = current[0]
    tour = make_layers(costs, reverse, into, onto, offsets, root)
    layers = np.empty((count, tour.ahead.shape[1] + SPARE))
    order = np.empty(count, np.int64)
    nodes = np.empty(count, np.int64)
    removed = np.empty(count, np.int64)
    gone = np.zeros(count, np.int64)
    seen = np.zeros(count + 1, np.int64)
    values[0] = build(tour, current, current_nodes[0])
    for now in range(rounds):
        tour.touched[0] = 0
        target = 1 + below(state, max_removed)
        taken, change = _ruin(tour, near, removed, gone, target, root, now, tolerance, state)
        turn = below(state, 4)
        for i in range(taken):
            if turn >= 2:
                _bring_forward(near, between, removed, gone, i, taken, turn == 2)
            c = removed[i]
            place = _cheapest_place(tour, near, gone, seen, c, root, blink, state)
            gone[c] = 0
            change += link_in(tour, c, place, root, now, tolerance)
        if change >= -temperature * np.log(1.0 - draw(state)):
            undo(tour)
        else:
            values[0] += change
        fresh = now + 1 == rounds or (now + 1) % FRESH_ROUNDS == 0
        if values[0] >= values[1] - tolerance and not fresh:
            continue
        c = root
        for p in range(count):
            order[p] = c
            c = tour.after[c]
        cost = best_nodes(costs, offsets, order, count, nodes, layers)
        if cost < values[1] - tolerance and improve_by_swaps(
            costs, near[:, :reach], order, nodes, symmetric, tolerance
        ):
            _to_front(order, root, removed)
            cost = best_nodes(costs, offsets, order, count, nodes, layers)
        if cost < values[1] - tolerance:
            values[1] = cost
            copy_into(best, order)
            copy_into(best_choice, nodes)
        copy_into(current, order)
        copy_into(current_nodes, nodes)
        values[0] = build(tour, order, nodes[0])
    _note_slack(tour, slack)


@kernel
def _note_slack(tour: Layers, slack: FloatArray) -> None:
    """Take down what the tour would cost more by through each node."""
    for c in range(len(tour.size)):
        for v in range(tour.size[c]):
            node = tour.at[c] + v
            extra = tour.ahead[c, v] + tour.behind[c, v]
            slack[0, node] = min(slack[0, node], extra)
            slack[1, node] += extra
