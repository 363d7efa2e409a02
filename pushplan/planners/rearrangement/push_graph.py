"""`PushGraph`: candidate pushes, what they deliver, and what lies between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from pushplan.planners.rearrangement.approach import (
    ApproachTree,
    approach_tree,
    arrivals_at,
    search_approaches,
)
from pushplan.planners.rearrangement.candidates import delivering_pushes, partial_pushes
from pushplan.planners.rearrangement.cost_to_go_kernels import MAX_OBJECTS
from pushplan.planners.rearrangement.gtsp_reduction import GtspReduction, reduce_to_gtsp
from pushplan.planners.rearrangement.pose_search_kernels import least_costs
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.push_simulator import PushSimulator
from pushplan.planners.rearrangement.relocation import relocating_pushes
from pushplan.world.checks import FloatArray, IntArray

if TYPE_CHECKING:
    import networkx as nx

_MOST_APPROACHES = 150
"""Ends of pushes from which approaches are searched for; up to 50 objects have no more."""


@dataclass(frozen=True, eq=False)
class DeliverySets:
    """What the pushes of a graph deliver, as sets in machine words.

    Args:
        objects: ids of the objects, in the order of the bits.
        masks: (N,) sets.
    """

    objects: tuple[int, ...]
    masks: IntArray

    def mask(self, ids: tuple[int, ...]) -> int:
        """The set of some objects; those that nothing delivers are left out."""
        return sum(1 << b for b, i in enumerate(self.objects) if i in ids)


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
    def delivery_sets(self) -> DeliverySets:
        """What its pushes deliver; an object that can only be relocated counts as delivered."""
        reachable = [n for n in range(len(self.pushes)) if np.isfinite(self.costs[-1, n])]
        objects = tuple(sorted({i for n in reachable for i in self.pushes[n].serves})[:MAX_OBJECTS])
        sets = DeliverySets(objects, np.zeros(0, dtype=np.int64))
        masks = np.array([sets.mask(push.serves) for push in self.pushes], dtype=np.int64)
        return DeliverySets(objects, masks)

    def to_gtsp(self) -> GtspReduction:
        """The choice and the order of its pushes as a generalised travelling salesman problem."""
        sets = self.delivery_sets
        return reduce_to_gtsp(self.costs, sets.masks.tolist(), len(sets.objects))

    def to_networkx(self) -> nx.DiGraph[int]:
        """The same problem as a graph that `solve_gtsp` takes.

        Node 0 is where the robot is. Each other node is a push, for one of the objects that it
        takes along.

        Returns:
            A graph whose nodes have the attributes ``cluster``, an object's id or ``"robot"``, and
            ``push``, a place in `pushes` or -1; the ``weight`` of an edge is its cost [m].
        """
        import networkx as nx

        problem, objects = self.to_gtsp(), self.delivery_sets.objects
        graph: nx.DiGraph[int] = nx.DiGraph()
        for cluster, nodes in zip((*objects, "robot"), problem.clusters, strict=True):
            for node in nodes:
                graph.add_node(node, cluster=cluster, push=problem.pushes[node])
        for a, b in np.argwhere(np.isfinite(problem.costs)).tolist():
            graph.add_edge(a, b, weight=float(problem.costs[a, b]))
        return graph


def no_penalty(push: Push) -> float:
    """Nothing."""
    return 0.0


def build_push_graph(
    scene: PushScene,
    penalty: Callable[[Push], float] = no_penalty,
    *,
    onward: bool = False,
    relocations: int = 0,
    thorough: bool = False,
) -> PushGraph:
    """Make the candidate pushes of a scene and their costs.

    Args:
        scene: the scene.
        penalty: what to add to the cost of a push [m].
        onward: whether pushes are wanted too that only bring an object nearer to its goal.
        relocations: for how many objects, the nearest ones first, drives that only bring them to
            where they can be pushed home from are wanted too.
        thorough: whether to look for ones that cost much more than the best one.
    """
    approach = approach_tree(scene)
    simulator = PushSimulator(scene)
    pushes = candidate_pushes(scene, simulator, approach, onward, relocations, thorough)
    row = least_costs(approach.costs, arrivals_at(scene.fine, pushes))
    extra = np.array([penalty(push) for push in pushes])
    pushes, keep = _best(scene, pushes, row + extra)
    row = row[keep]
    push_costs = np.array([push.cost for push in pushes]) + extra[keep]
    costs = _between(scene, pushes)
    costs = np.vstack([costs, row[None]]) + push_costs[None] if len(pushes) else np.zeros((1, 0))
    delivered = {i for n, push in enumerate(pushes) if np.isfinite(row[n]) for i in push.serves}
    infeasible = {
        int(i): "no push for it was found that the robot can get to"
        for i in scene.world.movables.ids[~scene.done].tolist()
        if i not in delivered
    }
    return PushGraph(tuple(pushes), costs, approach, infeasible)


def candidate_pushes(
    scene: PushScene,
    simulator: PushSimulator,
    approach: ApproachTree,
    onward: bool = False,
    relocations: int = 0,
    thorough: bool = False,
) -> list[Push]:
    """All candidates of a scene; the arguments are those of `build_push_graph`."""
    away = np.hypot(*(scene.poses[:, :2] - scene.world.robot_pose[:2]).T)
    objects = sorted(simulator.left.tolist(), key=lambda k: (float(away[k]), k))
    pushes = delivering_pushes(simulator, objects)
    if onward:
        pushes += [push for k in objects for push in partial_pushes(simulator, k)]
    for k in objects:
        if not relocations or scene.budget.is_used_up:
            break
        found = relocating_pushes(simulator, k, approach, thorough)
        pushes += found
        relocations -= bool(found)
    return pushes


def _best(
    scene: PushScene, pushes: Sequence[Push], row: FloatArray
) -> tuple[list[Push], list[int]]:
    """The best few pushes for each object, of those that the robot can get to."""
    keep: set[int] = set()
    order = sorted(
        (n for n in range(len(pushes)) if np.isfinite(row[n])),
        key=lambda n: (pushes[n].cost / max(1, len(pushes[n].delivers)), n),
    )
    near = sorted(order, key=lambda n: (row[n] + pushes[n].cost) / max(1, len(pushes[n].delivers)))
    ids = scene.world.movables.ids[~scene.done].tolist()
    count = min(scene.config.per_object, max(2, scene.config.max_pushes // max(1, len(ids))))
    for i in ids:
        mine = [n for n in order if i in pushes[n].serves]
        keep.update(mine[:count])
        keep.update([n for n in near if i in pushes[n].serves][: count // 2])
    index = sorted(keep)
    return [pushes[n] for n in index], index


def _between(scene: PushScene, pushes: Sequence[Push]) -> FloatArray:
    """(N, N) cost of the approach from the end of each push to the start of each other [m].

    What cannot be got to from there, as far as one can say now, is put off rather than ruled out:
    otherwise one object would be enough for there to be no order at all.
    """
    contact_grid, ids = scene.coarse, scene.world.movables.ids
    bounds = scene.world.static.bounds
    far = scene.config.far * float(np.hypot(*(bounds[2:] - bounds[:2])))
    arrivals = arrivals_at(contact_grid, pushes)
    out = np.full((len(pushes), len(pushes)), np.inf)
    known: dict[tuple[object, ...], FloatArray] = {}
    step = 2.0 * contact_grid.grid.step
    for n, push in enumerate(pushes):
        key = (
            push.delivers,
            *np.round(push.end[:2] / step).tolist(),
            round(float(push.end[2]) / 0.8),
        )
        if key not in known and (len(known) == _MOST_APPROACHES or scene.budget.is_over):
            out[n] = far
            continue
        if key not in known:
            gone = np.flatnonzero(np.isin(ids, push.delivers))
            found = search_approaches(
                scene,
                contact_grid,
                push.end,
                scene.config.later_fraction,
                gone,
                until=arrivals.nodes,
            )
            known[key] = least_costs(found.costs, arrivals)
        out[n] = np.minimum(known[key], far)
    np.fill_diagonal(out, np.inf)
    return out
