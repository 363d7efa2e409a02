"""The order of pushes to places, and the way to the first of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pushplan.control import Legs
from pushplan.gtsp import solve_gtsp
from pushplan.planners.rearrangement.placing.curves import way_around
from pushplan.planners.rearrangement.placing.place_push import PlacePush
from pushplan.planners.rearrangement.placing.placing_scene import PlacingScene
from pushplan.world import MaxIterations
from pushplan.world.checks import FloatArray

_LATER = 1e3  # cost of beginning with a push that is not free [m]
_TRIES = 30  # pushes that are tried as the first, until there is a way to one
_ITERATIONS = 200
_LONGEST = 80.0  # way to a push [circumscribed radii]


@dataclass(frozen=True, eq=False)
class PlaceChoice:
    """Choice of what to do next.

    Args:
        push: the first push.
        way: to its start: `Legs` for a robot that turns on the spot, else (N, 3) poses.
        order: all pushes in order, `push` first.
    """

    push: PlacePush
    way: Legs | FloatArray
    order: tuple[PlacePush, ...]


def first_push(
    scene: PlacingScene, pushes: list[PlacePush], order: str, rng: np.random.Generator
) -> PlaceChoice | None:
    """The push to begin with, and the way there; None where the robot can get at none.

    Args:
        scene: the scene.
        pushes: of which one is chosen for each object.
        order: ``"gtsp"`` for the shortest tour of one push of each object, a generalised travelling
            salesman problem; ``"nearest"`` for the push with the nearest start; ``"random"``.
        rng: of the random order.
    """
    if not pushes:
        return None
    free = [push.free for push in pushes]
    early = np.array([push.early for push in pushes])
    costs = _costs(scene, pushes)
    for _ in range(min(_TRIES, sum(free))):
        tour = _tour(pushes, costs, np.where(free, early, _LATER), order, rng)
        first = pushes[tour[0]]
        if not free[tour[0]]:
            return None
        way = way_to(scene, first.start)
        if way is not None:
            return PlaceChoice(first, way, tuple(pushes[n] for n in tour))
        free[tour[0]] = False
    return None


def _tour(
    pushes: list[PlacePush],
    costs: FloatArray,
    later: FloatArray,
    order: str,
    rng: np.random.Generator,
) -> list[int]:
    """Numbers of the pushes to make, one for each object."""
    count = len(pushes)
    objects = sorted({push.k for push in pushes})
    clusters = [[n for n in range(count) if pushes[n].k == k] for k in objects]
    if order == "gtsp":
        matrix = np.full((count + 1, count + 1), np.inf)
        matrix[:count, :count] = costs[:count]
        matrix[count, :count] = costs[count] + later
        matrix[:count, count] = 0.0
        tour = list(solve_gtsp(matrix, [*clusters, [count]], stop=MaxIterations(_ITERATIONS)).nodes)
        at = tour.index(count)
        return [int(n) for n in tour[at + 1 :] + tour[:at]]
    cheapest = [min(own, key=lambda n: (pushes[n].cost + later[n], n)) for own in clusters]
    if order == "random":
        ranks = rng.permutation(len(cheapest))
        return [n for _, n in sorted(zip(ranks + later[cheapest], cheapest, strict=True))]
    reach = costs[count] - [push.cost for push in pushes]
    return sorted(cheapest, key=lambda n: (reach[n] + later[n], n))


def _costs(scene: PlacingScene, pushes: list[PlacePush]) -> FloatArray:
    """(N + 1, N) cost [m] of a push after another, or after the robot's pose in the last row."""
    starts = np.array([push.start for push in pushes])
    ends = np.vstack([[push.finish for push in pushes], scene.world.robot_pose])
    own = np.array([push.cost for push in pushes])
    return np.asarray(scene.drive_costs(ends, starts) + own)


def way_to(scene: PlacingScene, target: FloatArray) -> Legs | FloatArray | None:
    """The way around all objects to a pose (3,); None if there is none."""
    here = scene.world.robot_pose
    if scene.is_car:
        bounds = scene.world.static.bounds
        most = _LONGEST * scene.size
        for checker in (scene.alone_wide, scene.alone(-1)):
            way = way_around(scene.drives, here, target, checker, bounds, most)
            if way is not None:
                return way
        return None
    robot = scene.robot
    for clearance in (scene.size, 0.5 * (scene.size + robot.inscribed_radius)):
        path = scene.graph(clearance).shortest_path(here[:2], target[:2])
        if math.isfinite(path.length):
            points = path.points[min(1, len(path.points) - 1) :]
            return Legs.ahead(points, float(target[2]))
    return None
