"""Ways of objects to where a goal wants them, for goals of all kinds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pushplan.geometry.convex import convex_penetration
from pushplan.geometry.shortest_path import goal_distances
from pushplan.world import AreaGoal, GoalDisc, ManipulationGoal, ObjectGoals, StaticMap, World
from pushplan.world.checks import FloatArray, IntArray
from pushplan.world.goals import least_pairing
from pushplan.world.outline import transform

Ways = Callable[[AreaGoal | GoalDisc, FloatArray], FloatArray]
"""From an area or a disc, and (N, 2) points [m], to the (N,) ways from them [m], inf for none."""


def object_ways(
    static: StaticMap, goal: ManipulationGoal, ids: IntArray, places: FloatArray
) -> FloatArray:
    """`shared_ways` that are shortest paths of a point around what is static."""

    def ways(goal: AreaGoal | GoalDisc, points: FloatArray) -> FloatArray:
        distances = goal_distances(static, goal)
        return np.array([distances.path_from(point).length for point in points])

    return shared_ways(goal, ids, places, ways)


def shared_ways(
    goal: ManipulationGoal, ids: IntArray, places: FloatArray, ways: Ways
) -> FloatArray:
    """(K,) way of each object's middle to where it belongs [m], 0 for one that belongs nowhere.

    Objects that may take one another's places share them so that the sum of their ways is least.

    Args:
        goal: of the objects.
        ids: (K,) of the objects.
        places: (K, 2) of their middles [m].
        ways: lengths of the ways to an area, or to the disc of a place.
    """
    if not isinstance(goal, ObjectGoals):
        return ways(goal, places)
    found = np.zeros(len(ids))
    for group in np.unique(goal.groups):
        own = np.flatnonzero(goal.groups == group)
        k = np.flatnonzero(np.isin(ids, goal.ids[own]))
        lengths = np.column_stack([ways(goal.places[g], places[k]) for g in own.tolist()])
        found[k] = lengths[np.arange(len(k)), least_pairing(lengths)]
    return found


def blocked_places(world: World) -> dict[int, float]:
    """Depth of blocked places inside static obstacles [m], by the id of the object.

    Objects that fit somewhere within the tolerances of their places are left out, and all of them
    where the goal is not one of `ObjectGoals`.
    """
    found: dict[int, float] = {}
    goal = world.goal
    objects = world.movables
    static = world.static
    if not isinstance(goal, ObjectGoals):
        return found
    for k, place in enumerate(goal.assigned(objects.ids, objects.poses).tolist()):
        if place < 0:
            continue
        pose = goal.poses[place]
        reach = objects.radii[k] * np.array([-1.0, -1.0, 1.0, 1.0])
        box = np.tile(pose[:2], 2) + reach
        near = ((static.boxes[:, :2] < box[2:]) & (static.boxes[:, 2:] > box[:2])).all(axis=1)
        depths = [
            convex_penetration(static.convex_parts[wall], transform(pose, part))[0]
            for wall in np.flatnonzero(near)
            for part in objects.parts(k)
        ]
        deepest = max(depths, default=0.0)
        # no point of the object moves farther within the tolerances
        if deepest > goal.radii[place] + objects.radii[k] * goal.heading_tolerances[place]:
            found[int(objects.ids[k])] = deepest
    return found
