"""`PushGraph`: the candidate pushes of a scene, what they deliver, and what lies between them.

**Reduction.** To deliver all objects is a problem of set covering. As a generalised travelling
salesman problem, each object is a cluster. A push that takes one object along is one node. A push
that takes several becomes one copy for each of them, one in each of their clusters, chained by free
arcs: the chain is entered only at its first copy and left only at its last, so a tour that uses one
of the copies uses them all, one after the other, and every cluster is visited once. As some of what
a push takes along may have gone before, it stands for every part of it too, at the same cost. The
robot is a cluster of one node to which every chain leads back for nothing, so the tour is an open
path.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from pushplan.core import rearrangement as core
from pushplan.planners.rearrangement.approach import (
    ApproachTree,
    approach_tree,
    arrivals_at,
    search_approaches,
)
from pushplan.planners.rearrangement.candidates import (
    PushPool,
    delivering_pushes,
    partial_pushes,
)
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.push_simulator import simulate_primitive
from pushplan.planners.rearrangement.relocation_search import RelocationSearch
from pushplan.planners.rearrangement.rollout_cache import Asked
from pushplan.world.checks import FloatArray, IntArray

if TYPE_CHECKING:
    import networkx as nx

_MOST_PARTS = 3
"""Pushes that take more than so many objects along stand for all of them and for each one alone."""
_MOST_APPROACHES = 150
"""Ends of pushes from which approaches are searched for; up to 50 objects have no more."""
_SAME_END = 2.0
_SAME_END_TURN = 0.8
"""Sides of the boxes of ends of pushes that share their approaches [cells, rad]."""
_LONGER = 1.5  # length of an approach that is not searched [straight line]
_UNREACHABLE = 5.0  # cost of getting to what cannot be got to later [diagonals of the map]
_NEARBY = 8.0
"""Distance from the object beyond which nothing counts for the search [circumscribed radii]."""


@dataclass(frozen=True, eq=False)
class GtspReduction:
    """A set-covering problem as a GTSP.

    Args:
        costs: (M, M) arcs between nodes, node 0 is the robot.
        clusters: nodes of each object, in order, and last that of the robot.
        pushes: (M,) index of the push that each node stands for, -1 for the robot.
        chains: the nodes of each part of each push.
    """

    costs: FloatArray
    clusters: list[list[int]]
    pushes: list[int]
    chains: list[list[int]]

    def tour(self, order: Sequence[int]) -> list[int] | None:
        """The closed tour that makes pushes in an order, each for what is left when it comes.

        Returns:
            Nodes; None if pushes are missing or may not follow each other.
        """
        chains: dict[int, list[list[int]]] = {}
        for chain in sorted(self.chains, key=len, reverse=True):
            chains.setdefault(self.pushes[chain[0]], []).append(chain)
        owners = {node: c for c, nodes in enumerate(self.clusters) for node in nodes}
        left = set(range(len(self.clusters) - 1))
        found = [0]
        for n in order:
            for chain in chains.get(n, []):
                served = {owners[node] for node in chain}
                if served <= left:
                    left -= served
                    found += chain
        drives = np.isfinite(self.costs[found, np.roll(found, -1)]).all()
        return found if drives and not left else None

    def order(self, nodes: list[int]) -> list[int]:
        """The pushes along a closed tour over nodes, from the robot on."""
        at = nodes.index(0)
        found: list[int] = []
        for node in nodes[at + 1 :] + nodes[:at]:
            if not found or found[-1] != self.pushes[node]:
                found.append(self.pushes[node])
        return found


def reduce_to_gtsp(costs: FloatArray, masks: list[int], objects: int) -> GtspReduction:
    """Write a set-covering problem as a GTSP.

    Args:
        costs: (N + 1, N) cost of each push after each other one, the last row after the start.
        masks: what each push delivers, one bit an object.
        objects: how many objects there are.
    """
    chains: list[list[int]] = []
    clusters: list[list[int]] = [[] for _ in range(objects)]
    owners = [-1]
    count = 1
    for n, mask in enumerate(masks):
        if not np.isfinite(costs[:, n]).any():
            continue
        for part in parts_of(mask):
            nodes = list(range(count, count + len(part)))
            for node, b in zip(nodes, part, strict=True):
                clusters[b].append(node)
            owners += [n] * len(part)
            chains.append(nodes)
            count += len(part)
    out = np.full((count, count), np.inf)
    firsts = [nodes[0] for nodes in chains]
    lasts = [nodes[-1] for nodes in chains]
    which = np.array([owners[node] for node in firsts], dtype=np.int64)
    if len(which):
        out[np.ix_(lasts, firsts)] = costs[np.ix_(which, which)]
        out[0, firsts] = costs[-1, which]
        out[lasts, 0] = 0.0
    for nodes in chains:
        out[nodes[:-1], nodes[1:]] = 0.0
    return GtspReduction(out, [*clusters, [0]], owners, chains)


def parts_of(mask: int) -> list[tuple[int, ...]]:
    """The sets of objects that a push stands for."""
    whole = tuple(b for b in range(mask.bit_length()) if mask >> b & 1)
    if len(whole) > _MOST_PARTS:
        return [whole, *((b,) for b in whole)]
    return [part for size in range(1, len(whole) + 1) for part in combinations(whole, size)]


@dataclass(frozen=True, eq=False)
class PushGraph:
    """The pushes of one scene with their costs.

    Args:
        pushes: N candidates.
        costs: (N + 1, N) cost [m] of each push after each other, approach included; the last row
            from where the robot is. inf where there is no path.
        approach: from where the robot is.
        infeasible: why there is no push for an object, by id.
    """

    pushes: tuple[Push, ...]
    costs: FloatArray
    approach: ApproachTree
    infeasible: dict[int, str]

    @cached_property
    def objects(self) -> tuple[int, ...]:
        """Ids of the objects that it has a push for, in the order of the bits of `masks`."""
        reachable = [n for n in range(len(self.pushes)) if np.isfinite(self.costs[-1, n])]
        return tuple(
            sorted({i for n in reachable for i in self.pushes[n].serves})[: core.MAX_OBJECTS]
        )

    @cached_property
    def masks(self) -> IntArray:
        """(N,) what each push delivers; an object that can only be relocated counts as well."""
        return np.array([self.mask(push.serves) for push in self.pushes], dtype=np.int64)

    def mask(self, ids: tuple[int, ...]) -> int:
        """A set of objects in a machine word; those that nothing delivers are left out."""
        return sum(1 << b for b, i in enumerate(self.objects) if i in ids)

    def to_gtsp(self) -> GtspReduction:
        """The choice and the order of its pushes as a generalised travelling salesman problem."""
        return reduce_to_gtsp(self.costs, self.masks.tolist(), len(self.objects))

    def to_networkx(self) -> nx.DiGraph[int]:
        """The same problem as a graph that `solve_gtsp` takes.

        Node 0 is where the robot is. Each other node is a push, for one of the objects that it
        takes along.

        Returns:
            A graph whose nodes have the attributes ``cluster``, an object's id or ``"robot"``, and
            ``push``, a place in `pushes` or -1; the ``weight`` of an edge is its cost [m].
        """
        import networkx as nx

        problem = self.to_gtsp()
        graph: nx.DiGraph[int] = nx.DiGraph()
        for cluster, nodes in zip((*self.objects, "robot"), problem.clusters, strict=True):
            for node in nodes:
                graph.add_node(node, cluster=cluster, push=problem.pushes[node])
        for a, b in np.argwhere(np.isfinite(problem.costs)).tolist():
            graph.add_edge(a, b, weight=float(problem.costs[a, b]))
        return graph


def build_push_graph(
    scene: PushScene,
    penalty: Callable[[Push], float] = lambda _: 0.0,
    *,
    onward: bool = False,
    relocations: int = 0,
    thorough: bool = False,
) -> PushGraph:
    """Make the candidate pushes of a scene and their costs.

    Args:
        scene: the scene.
        penalty: what to add to the cost of a push [m].
        onward: pushes are wanted too that only bring an object nearer to its goal.
        relocations: for how many objects, the nearest ones first, drives that only bring them to
            where they can be pushed home from are wanted too.
        thorough: look for ones that cost much more than the best one.
    """
    approach = scene.known("approach", lambda: approach_tree(scene))
    away = np.hypot(*(scene.poses[:, :2] - scene.world.robot_pose[:2]).T)
    objects = sorted(scene.left, key=lambda k: (float(away[k]), k))
    budget = scene.budget
    pool = scene.known("delivering", lambda: PushPool(delivering_pushes(scene, objects)))
    pushes = pool.fill(budget)
    for k in objects if onward else ():
        if scene.push_cost_to_go(k).prepare(budget):
            pool = scene.known(("partial", k), partial(_partial_pool, scene, k))
            pushes += pool.fill(budget)
    for k in objects:
        if not relocations or budget.is_used_up:
            break
        found = relocating_pushes(scene, k, approach, thorough)
        pushes += found
        relocations -= bool(found)
    row = core.least_costs(approach.costs, *arrivals_at(scene.fine.grid, pushes))
    extra = np.array([penalty(push) for push in pushes])
    keep = _best(scene, pushes, row + extra)
    pushes = [pushes[n] for n in keep]
    row = row[keep]
    push_costs = np.array([push.cost for push in pushes]) + extra[keep]
    costs = np.zeros((1, 0))
    if pushes:
        costs = np.vstack([_between(scene, pushes), row[None]]) + push_costs[None]
    delivered = {i for n, push in enumerate(pushes) if np.isfinite(row[n]) for i in push.serves}
    infeasible = {
        i: "no push for it was found that the robot can get to"
        for i in scene.movables.ids[scene.left].tolist()
        if i not in delivered
    }
    return PushGraph(tuple(pushes), costs, approach, infeasible)


def _partial_pool(scene: PushScene, k: int) -> PushPool:
    return PushPool(partial_pushes(scene, k))


def _best(scene: PushScene, pushes: Sequence[Push], row: FloatArray) -> list[int]:
    """Indices of the best few pushes for each object, of those that the robot can get to."""
    keep: set[int] = set()
    counts = [max(1, len(push.delivers)) for push in pushes]
    order = sorted(
        (n for n in range(len(pushes)) if np.isfinite(row[n])),
        key=lambda n: (pushes[n].cost / counts[n], n),
    )
    near = sorted(order, key=lambda n: (row[n] + pushes[n].cost) / counts[n])
    ids = scene.movables.ids[scene.left].tolist()
    most = min(scene.config.per_object, max(2, scene.config.max_pushes // max(1, len(ids))))
    for i in ids:
        keep.update([n for n in order if i in pushes[n].serves][:most])
        keep.update([n for n in near if i in pushes[n].serves][: most // 2])
    return sorted(keep)


def _between(scene: PushScene, pushes: Sequence[Push]) -> FloatArray:
    """(N, N) cost of the approach from the end of each push to the start of each other [m].

    What cannot be got to from there, as far as one can say now, is put off rather than ruled out:
    otherwise one object would be enough for there to be no order at all. Where there is no time for
    a search the straight line counts, longer as the approaches that were searched are.
    """
    grid = scene.coarse.grid
    ids = scene.movables.ids
    bounds = scene.world.static.bounds
    far = _UNREACHABLE * float(np.hypot(*(bounds[2:] - bounds[:2])))
    arrivals = arrivals_at(grid, pushes)
    out = np.full((len(pushes), len(pushes)), far)
    known: dict[tuple[object, ...], ApproachTree] = {}
    until = arrivals.nodes
    if scene.budget.seconds < math.inf:  # pushes that are found later need the rest as well
        until = np.zeros(0, dtype=np.int64)
        known = scene.known("between", dict)
    late: list[int] = []
    step = _SAME_END * grid.step
    for n, push in enumerate(pushes):
        key = (
            push.delivers,
            *np.round(push.end[:2] / step).tolist(),
            round(float(push.end[2]) / _SAME_END_TURN),
        )
        if key not in known:
            if scene.budget.no_more_approaches:
                late.append(n)
                continue
            if len(known) == _MOST_APPROACHES:
                continue
            weights = scene.config.later_fraction * scene.contact_weights
            weights[np.isin(ids, push.delivers)] = 0.0
            known[key] = search_approaches(scene, scene.coarse, push.end, weights, until)
        out[n] = np.minimum(core.least_costs(known[key].costs, *arrivals), far)
    if late:
        ends = np.array([push.end[:2] for push in pushes])
        starts = np.array([push.start[:2] for push in pushes])
        straight = np.hypot(*(ends[:, None] - starts).transpose(2, 0, 1))
        searched = np.delete(out, late, axis=0)
        reached = searched < far
        longer = _LONGER
        if reached.any():
            longer = searched[reached].sum() / np.delete(straight, late, axis=0)[reached].sum()
        out[late] = longer * straight[late]
    np.fill_diagonal(out, np.inf)
    return out


def relocating_pushes(
    scene: PushScene, k: int, approach: ApproachTree, thorough: bool = False
) -> list[Push]:
    """Drives after which object ``k`` can be pushed home, or else lies better than now.

    Behind an object in a gap, in a corner or flat at a wall there is no clearance for the robot.
    But it may be nudged along the wall, or hooked out backwards or turned by the end of the bumper.
    What the search found counts again while nothing has moved.

    Args:
        scene: the scene.
        k: index of the object.
        approach: from where the robot is.
        thorough: look for drives that cost much more than the best one too.
    """
    movables = scene.movables
    cache = scene.cache
    found = None
    near = np.hypot(*(scene.poses[:, :2] - scene.poses[k, :2]).T) < _NEARBY * scene.size
    asked = Asked(
        movables.ids[near].tobytes() + scene.poses[near].tobytes(), scene.robot_cell, thorough
    )
    if cache is not None:
        found = cache.relocations(int(movables.ids[k]), asked)
        if found is None and cache.searches >= scene.config.max_searches:
            return []
    if found is None:
        if not scene.push_cost_to_go(k).prepare(scene.budget):
            return []
        search = scene.known(
            ("relocations", k, thorough), lambda: RelocationSearch(scene, k, approach, thorough)
        )
        found = search.run()
        if search.interrupted and scene.budget.stopped:  # the next decision goes on with it
            return []
        if cache is not None and not search.interrupted:
            cache.keep_relocations(int(movables.ids[k]), asked, found)
    key = "relocating", k, thorough
    known, pushes = scene.progress.get(key, (None, []))
    if known is found:
        return list(pushes)
    pushes = []
    for path, extra, moved in found:
        poses = scene.poses.copy()
        for number, pose in moved.items():
            poses[movables.ids == number] = pose
        for push in simulate_primitive(scene, path, k, poses):
            pushes.append(replace(push, cost=push.cost + extra))
    scene.progress[key] = found, pushes
    return list(pushes)
