"""`SubTaskGraph`: candidate pushes, what they cover, and what lies between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pushplan.planners.rearrangement import pose_search
from pushplan.planners.rearrangement.approach import Approach, approach_from, arrivals_at, ways_from
from pushplan.planners.rearrangement.candidates import simple_pushes
from pushplan.planners.rearrangement.extraction import maneuvers
from pushplan.planners.rearrangement.pre_relocation import freeing_pushes
from pushplan.planners.rearrangement.push import Push, signature
from pushplan.planners.rearrangement.runner import Runner
from pushplan.planners.rearrangement.scene import Scene
from pushplan.world.checks import FloatArray

FREED = 2
"""For how many objects, the nearest ones, freeing pushes are looked for if there are no others."""

_FAR = 5.0
"""Price of getting to what cannot be got to later [diagonals of the floor]."""


@dataclass(frozen=True, eq=False)
class SubTaskGraph:
    """The pushes of one scene with their costs.

    Args:
        pushes: N candidates.
        costs: (N + 1, N) cost [m] of each push after each other, approach included; the last row
            from where the robot is. inf where there is no way.
        approach: from where the robot is.
        infeasible: why there is no push for an object, by id.
    """

    pushes: tuple[Push, ...]
    costs: FloatArray
    approach: Approach
    infeasible: dict[int, str]


def build_graph(
    scene: Scene,
    penalties: dict[tuple[object, ...], float] | None = None,
    *,
    freeing: int = 0,
) -> SubTaskGraph:
    """Make the candidate pushes of a scene and price them.

    Args:
        scene: the scene.
        penalties: what to add to the price of a push, by `signature` [m].
        freeing: for how many objects, the nearest ones first, pushes that only free them are wanted
            too; where there are no others they are in any case.
    """
    approach = approach_from(scene)
    runner = Runner(scene)
    pushes = candidate_pushes(scene, runner, freeing)
    row = pose_search.least_costs(approach.costs, arrivals_at(scene.fine, pushes))
    extra = np.array([(penalties or {}).get(signature(push), 0.0) for push in pushes])
    pushes, keep = _best(scene, pushes, row + extra)
    row = row[keep]
    prices = np.array([push.price for push in pushes]) + extra[keep]
    costs = _between(scene, pushes)
    costs = np.vstack([costs, row[None]]) + prices[None] if len(pushes) else np.zeros((1, 0))
    covered = {i for n, push in enumerate(pushes) if np.isfinite(row[n]) for i in push.serves}
    infeasible = {
        int(i): "no push for it was found that the robot can get to"
        for i in scene.world.movables.ids[~scene.done].tolist()
        if i not in covered
    }
    return SubTaskGraph(tuple(pushes), costs, approach, infeasible)


def candidate_pushes(scene: Scene, runner: Runner, freeing: int = 0) -> list[Push]:
    """All candidates of a scene; ``freeing`` see `build_graph`."""
    pushes = simple_pushes(runner)
    if freeing or not pushes:  # what is hard to get at is often freed by what is done before
        freed = 0
        away = np.hypot(*(scene.poses[:, :2] - scene.world.robot_pose[:2]).T)
        for k in sorted(runner.left.tolist(), key=lambda k: (float(away[k]), k)):
            found, is_freed = freeing_pushes(runner, k)
            if not is_freed:  # a maneuver takes longer to find
                found += maneuvers(runner, k)
            pushes += found
            freed += bool(found)
            if freed >= max(freeing, FREED):
                break
    return pushes


def _best(scene: Scene, pushes: Sequence[Push], row: FloatArray) -> tuple[list[Push], list[int]]:
    """The best few pushes for each object, of those that the robot can get to."""
    keep: set[int] = set()
    order = sorted(
        (n for n in range(len(pushes)) if np.isfinite(row[n])),
        key=lambda n: (pushes[n].price / max(1, len(pushes[n].covers)), n),
    )
    near = sorted(order, key=lambda n: (row[n] + pushes[n].price) / max(1, len(pushes[n].covers)))
    ids = scene.world.movables.ids[~scene.done].tolist()
    count = min(scene.config.per_box, max(2, scene.config.most // max(1, len(ids))))
    for i in ids:
        mine = [n for n in order if i in pushes[n].serves]
        keep.update(mine[:count])
        keep.update([n for n in near if i in pushes[n].serves][: count // 2])
    index = sorted(keep)
    return [pushes[n] for n in index], index


def _between(scene: Scene, pushes: Sequence[Push]) -> FloatArray:
    """(N, N) cost of the approach from the end of each push to the start of each other [m].

    What cannot be got to from there, as far as one can say now, is put off rather than ruled out:
    otherwise one object would be enough for there to be no order at all.
    """
    ground, ids = scene.coarse, scene.world.movables.ids
    bounds = scene.world.static.bounds
    far = _FAR * float(np.hypot(*(bounds[2:] - bounds[:2])))
    arrivals = arrivals_at(ground, pushes)
    out = np.full((len(pushes), len(pushes)), np.inf)
    known: dict[tuple[object, ...], FloatArray] = {}
    step = 2.0 * ground.floor.step
    for n, push in enumerate(pushes):
        key = (
            push.covers,
            *np.round(push.end[:2] / step).tolist(),
            round(float(push.end[2]) / 0.8),
        )
        if key not in known:
            gone = np.flatnonzero(np.isin(ids, push.covers))
            found = ways_from(
                scene, ground, push.end, scene.config.later, gone, targets=arrivals.nodes
            )
            known[key] = pose_search.least_costs(found.costs, arrivals)
        out[n] = np.minimum(known[key], far)
    np.fill_diagonal(out, np.inf)
    return out
