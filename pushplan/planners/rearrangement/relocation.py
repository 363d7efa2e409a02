"""Relocations: short drives after which an object can be pushed home.

Behind an object in a gap, in a corner or flat at a wall there is no clearance for the robot. But it
may be nudged along the wall, or the end of the bumper reaches in and hooks it out backwards, or
turns it. `RelocationSearch` finds such drives; what it found counts again while nothing has moved.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pushplan.planners.rearrangement.approach import ApproachTree
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.push_simulator import simulate_primitive
from pushplan.planners.rearrangement.relocation_search import RelocationSearch
from pushplan.planners.rearrangement.rollout_cache import Asked

_NEARBY = 8.0
"""Distance from the object beyond which nothing counts for the search [circumscribed radii]."""


def relocating_pushes(
    scene: PushScene, k: int, approach: ApproachTree, thorough: bool = False
) -> list[Push]:
    """Drives after which object ``k`` can be pushed home, or else lies better than now.

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
