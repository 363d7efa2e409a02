"""Candidate pushes: the table of primitives tried at the objects, in the interaction model."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.push_simulator import PushAttempt, simulate
from pushplan.planners.rearrangement.push_starts import heading_axes, initial_heading
from pushplan.planners.rearrangement.rearrangement_config import PushPrimitive
from pushplan.planners.rearrangement.search_budget import SearchBudget
from pushplan.world import ClearanceArea
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import path_length

_HARD_OBJECTS = 3
"""So many objects that no simple push gets home, the nearest ones, are looked at closely."""
_EARLY = 0.6
"""Distance before a failure at which a push ends that does not deliver its object [circumscribed
radii]."""
_NEXT_PUSH = 2.0  # least cost of the push that follows a partial one [circumscribed radii]
_LENGTH_FACTOR = 1.5
_EXTRA_LENGTH = 4.0
_TURN_LENGTH = 2.0
"""Greatest length of a push along a path: times that of the path, and more [circumscribed radii];
one that begins at an angle has some more to turn."""
_PARTNER_SPACING = 0.75  # distance of two objects side by side [sum of their radii]
_PARTNER_WIDTH = 1.3  # greatest such distance [half widths of the bumper]
_PARTNER_DETOUR = 1.5  # by so much longer the path past a partner may be [circumscribed radii]
_PARTNER_TURN = 1.0  # greatest turn at the partner [rad]
_OWN_CLEARANCE = 0.75
"""Clearance of an object's path where the table gives none [radii of the object]."""
_DETOUR = 1.3
"""Greatest distance to an edge across which an object is pushed out of an area, in distances to the
nearest edge."""
GAIN = 1.0
"""By how much less has to be left to be done for a push to help that does not get its object home
[circumscribed radii]."""


Found = tuple[tuple[int, int], list[Push]]
"""Pushes of one attempt, after the row of the table and the number of the attempt."""


class PushPool:
    """Pushes that are found one attempt after the other, as long as there is time.

    Args:
        source: of the pushes.

    Attributes:
        complete: there are no more.
    """

    def __init__(self, source: Iterator[Found]) -> None:
        self._source = source
        self._found: list[Found] = []
        self.complete = False

    def fill(self, budget: SearchBudget) -> list[Push]:
        """Go on until there are no more or the budget ends it; all pushes so far, in order."""
        while not self.complete and not budget.no_more_candidates:
            found = next(self._source, None)
            if found is None:
                self.complete = True
            else:
                self._found.append(found)
        self._found.sort(key=lambda one: one[0])
        return [push for _, pushes in self._found for push in pushes]


def delivering_pushes(scene: PushScene, objects: Sequence[int]) -> Iterator[Found]:
    """Pushes after which an object is where it belongs, row by row of the table.

    Of a row, those that may be the cheapest of their objects come first.

    Args:
        scene: the scene.
        objects: indices of those to push, the most urgent first.
    """
    ids = scene.movables.ids.tolist()
    here = scene.world.robot_pose[:2]
    counts: Counter[int] = Counter()
    found = False
    for number, row in enumerate(scene.config.primitives):
        if row.controller == "arc":
            continue
        few = [k for k in objects if counts[ids[k]] < row.below]
        tried: list[tuple[int, float, int, PushAttempt]] = []
        for k in few[:_HARD_OBJECTS] if row.below == 1 and found else few:
            first = len(tried)
            own: list[tuple[float, int, PushAttempt]] = []
            for attempt in attempts(scene, k, row):
                bound = math.dist(here, attempt.start[:2])
                bound += (1.0 + float(scene.weights[k])) * attempt.least
                own.append((bound, first + len(own), attempt))
            own.sort(key=lambda one: one[:2])
            tried += [(rank, *one) for rank, one in enumerate(own)]
            yield (number, -1), []
        for _, _, index, attempt in sorted(tried, key=lambda one: one[:3]):
            pushes = simulate(scene, attempt)
            if all(
                simulate(scene, replace(attempt, friction=friction))
                for friction in (row.frictions if pushes else ())
            ):
                found = found or bool(pushes)
                counts.update(i for push in pushes for i in push.delivers)
                yield (number, index), pushes
            else:
                yield (number, index), []


def partial_pushes(scene: PushScene, k: int) -> Iterator[Found]:
    """Pushes of an object along its path that end before something goes wrong, and what is left.

    Each costs what is left to be done, and a radius or two for another push.
    """
    costs = scene.push_cost_to_go(k)
    now = costs.at(scene.poses[k])
    for number, row in enumerate(scene.config.primitives):
        if row.controller != "path" or row.deep or row.partners:
            continue
        for index, attempt in enumerate(attempts(scene, k, row)):
            pushes = []
            for whole in simulate(scene, replace(attempt, relocates=True)):
                limit = whole.length - _EARLY * scene.size
                for push in simulate(scene, replace(attempt, relocates=True, limit=limit)):
                    left = costs.at(push.object_poses[k])
                    if left < now - GAIN * scene.size:
                        cost = push.cost + left + _NEXT_PUSH * scene.size
                        pushes.append(replace(push, cost=cost))
            yield (number, index), pushes


def attempts(scene: PushScene, k: int, row: PushPrimitive) -> Iterator[PushAttempt]:
    """The pushes of one object by one row of the table."""
    if row.controller == "line":
        yield from _line_attempts(scene, k, row)
        return
    for path, shift_of_path, wanted in _paths(scene, k, row):
        towards = initial_heading(path, scene.controller.ahead)
        extra = _EXTRA_LENGTH
        if row.leans[0]:
            extra += _TURN_LENGTH
        length = path_length(path)
        limit = _LENGTH_FACTOR * length + extra * scene.size
        shifts = [fraction * scene.half for fraction in row.shifts]
        if shift_of_path is not None:
            shifts = [shift_of_path]
        for lean, aside in itertools.product(row.leans, shifts):
            start = scene.starts.behind(k, towards + math.radians(lean), aside)
            if scene.starts.fits(start):
                for gain in row.gains:
                    yield PushAttempt(start, k, limit, path, aside, wanted, gain, least=length)


def open_edges(area: ClearanceArea) -> Iterator[tuple[FloatArray, FloatArray, FloatArray, float]]:
    """The edges that can be crossed: first corner, unit vectors along it and out, length [m]."""
    ends = zip(area.polygon, np.roll(area.polygon, -1, axis=0), area.open_edges, strict=True)
    for a, b, is_open in ends:
        if is_open:
            length = np.hypot(*(b - a))
            along = (b - a) / length
            yield a, along, np.array([along[1], -along[0]]), float(length)


def _line_attempts(scene: PushScene, k: int, row: PushPrimitive) -> Iterator[PushAttempt]:
    """Straight pushes across the open edges of an area that are not much farther than others."""
    goal = scene.world.goal
    box = scene.poses[k, :2]
    nearest = scene.remaining_now[k]
    if not isinstance(goal, ClearanceArea):
        return
    for a, along, normal, length in open_edges(goal):
        far = float((a - box) @ normal)
        if far > _DETOUR * nearest + 2.0 * scene.size:
            continue
        for lean in row.leans:
            heading = math.atan2(normal[1], normal[0]) + math.radians(lean)
            u, v = heading_axes(heading)
            straight = far / float(u @ normal)
            out = box + straight * u - a
            if not 0.0 <= float(out @ along) <= length:
                continue
            tried: list[list[int]] = []
            for shift in row.shifts:
                start = scene.starts.behind(k, heading, shift * scene.half)
                ahead, left = ((scene.poses[:, :2] - box) @ axis for axis in (u, v))
                swept = (ahead > -1e-9) & (np.abs(left - shift * scene.half) < scene.half)
                wanted = [j for j in scene.left if j == k or swept[j]]
                if tried.count(wanted) < 2 and scene.starts.fits(start):
                    tried.append(wanted)
                    yield PushAttempt(start, k, scene.longest, wanted=wanted, least=straight)


def _paths(
    scene: PushScene, k: int, row: PushPrimitive
) -> Iterator[tuple[FloatArray, float | None, tuple[int, ...]]]:
    """Paths of object ``k``, with the shift where it is given [m] and what is to be delivered."""
    box = scene.poses[k, :2]
    radii = scene.movables.radii
    radius = float(radii[k])
    away = row.clearance * scene.half
    if not row.clearance:
        away = _OWN_CLEARANCE * radius
    path = scene.object_paths.path(box, radius, away, row.deep)
    if path is None:
        return
    if not row.partners:
        if row.deep or not row.clearance:  # it may be the path of another row again
            other = scene.object_paths.path(box, radius, PushPrimitive.clearance * scene.half)
            if other is not None and other.shape == path.shape:
                if float(np.abs(other - path).max()) < 0.2 * radius:
                    return
        yield path, None, ()
        return
    length = path_length(path)
    far = np.hypot(*(scene.poses[:, :2] - box).T)
    others = sorted((j for j in scene.left if j != k), key=lambda j: (far[j], j))
    for j in others[: row.partners]:
        other = scene.object_paths.path(scene.poses[j, :2], float(radii[j]), away)
        width = _PARTNER_SPACING * float(radii[j] + radii[k])
        if (
            other is None
            or width > _PARTNER_WIDTH * scene.half
            or float(far[j]) + path_length(other) > length + _PARTNER_DETOUR * scene.size
        ):
            continue
        heading = initial_heading(other, scene.size)
        _, v = heading_axes(heading)
        for side in (1.0, -1.0):
            beside = scene.poses[j, :2] - side * width * v
            approach = beside - box
            turn = math.atan2(approach[1], approach[0]) - heading
            if abs(math.remainder(turn, math.tau)) <= _PARTNER_TURN:
                points = np.array([box, beside, *other[1:]])
                yield np.ascontiguousarray(points), side * 0.5 * width, (k, j)
