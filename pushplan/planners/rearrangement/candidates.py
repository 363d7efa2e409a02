"""Candidate pushes: where to begin, and what comes of it by the interaction model."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_poses import (
    SHIFTS,
    heading_axes,
    initial_heading,
    pose_behind,
)
from pushplan.planners.rearrangement.push_simulator import PushSimulator
from pushplan.planners.rearrangement.wall_pushes import curved_pushes, partial_pushes
from pushplan.world import ClearanceArea
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import path_length

TILTS = tuple(math.radians(tilt) for tilt in (0.0, 20.0, -20.0, 40.0, -40.0))
"""Directions of line pushes against the normal of an edge [rad]."""
_PARTNERS = 4  # how many others are looked at that an object could be collected with
_HARD = 3  # how many objects that no simple push gets home, the nearest ones, are looked at closely
_PATHS = ((1.08, False), (0.0, False), (1.08, True))
"""Paths of a target object: clearance in half widths of the bumper, 0 for its own; whether it goes
to the middle of a receptacle."""


def simple_pushes(simulator: PushSimulator, *, thorough: bool = True) -> list[Push]:
    """Pushes from behind, after which something is where it belongs, or nearer.

    Args:
        simulator: for the scene.
        thorough: false to know no more than whether there is a push; none that only bring an
            object nearer are looked for then.
    """
    left = simulator.left.tolist()
    if isinstance(simulator.scene.world.goal, ClearanceArea):
        pushes = area_pushes(simulator)
        delivered = {i for push in pushes for i in push.delivers}
        ids = simulator.scene.world.movables.ids
        hard = [k for k in left if int(ids[k]) not in delivered]
        return pushes + path_following_pushes(simulator, hard, thorough=thorough)
    following = path_following_pushes(simulator, left, thorough=thorough)
    return following + collecting_pushes(simulator, left) if thorough else following


def area_pushes(simulator: PushSimulator) -> list[Push]:
    """Line pushes out of a clearance area: across every open edge, of one object or several."""
    scene = simulator.scene
    goal = scene.world.goal
    assert isinstance(goal, ClearanceArea)
    corners = goal.polygon
    found: list[Push] = []
    nearest = scene.remaining_now
    for a, b, is_open in zip(corners, np.roll(corners, -1, axis=0), goal.open_edges, strict=True):
        if not is_open:
            continue
        along = (b - a) / np.hypot(*(b - a))
        normal = np.array([along[1], -along[0]])
        far = (a - scene.poses[:, :2]) @ normal
        reach = [
            k for k in simulator.left.tolist() if far[k] <= 1.3 * nearest[k] + 2.0 * scene.size
        ]
        for tilt in TILTS:
            heading = math.atan2(normal[1], normal[0]) + tilt
            u, _ = heading_axes(heading)
            hits = []
            for k in reach:
                out = scene.poses[k, :2] + far[k] / float(u @ normal) * u - a
                if 0.0 <= float(out @ along) <= float(np.hypot(*(b - a))):
                    hits.append(k)
            found += _sweeps(simulator, heading, hits, tilt != 0.0)
    return found


def _sweeps(simulator: PushSimulator, heading: float, boxes: list[int], single: bool) -> list[Push]:
    """Line pushes with one heading, behind and beside each of the given objects."""
    scene, movables = simulator.scene, simulator.scene.world.movables
    u, v = heading_axes(heading)
    half, slack = scene.half, scene.config.slack * scene.size
    outlines = [movables.outline_world(k) for k in range(len(movables))]
    low = np.array([float((o @ v).min()) for o in outlines])
    high = np.array([float((o @ v).max()) for o in outlines])
    back = np.array([float((o @ u).min()) for o in outlines])
    middle, at = scene.poses[:, :2] @ v, scene.poses[:, :2] @ u
    seen: dict[tuple[int, frozenset[int]], list[float]] = {}
    found: list[Push] = []
    for k in boxes:
        options = [float(middle[k])]
        if not single:
            options += [float(low[k]) + half, float(high[k]) - half]
            for j in boxes:
                span = max(high[k], high[j]) - min(low[k], low[j])
                if j != k and at[j] >= at[k] and span <= 2.3 * half:
                    options.append(0.5 * float(max(high[k], high[j]) + min(low[k], low[j])))
        for c in options:
            if abs(middle[k] - c) > 0.92 * half:
                continue
            inside = frozenset(
                j
                for j in boxes
                if at[j] > at[k] - 1e-9 and low[j] < c + half and high[j] > c - half
            )
            known = seen.setdefault((k, inside), [])
            if len(known) >= 2 or any(abs(c - other) < 0.12 * half for other in known):
                continue
            start = np.array([*(c * v + (back[k] - scene.front - slack) * u), heading])
            if not scene.fits(start):
                continue
            known.append(c)
            limit = simulator.longest
            found += simulator.simulate(start, k, wanted=sorted(inside | {k}), limit=limit)
    return found


def path_following_pushes(
    simulator: PushSimulator, boxes: Iterable[int], *, thorough: bool = True
) -> list[Push]:
    """Pushes of an object along its path to the goal, beside it on either side.

    Args:
        simulator: for the scene.
        boxes: indices of the objects.
        thorough: see `simple_pushes`.
    """
    scene = simulator.scene
    found: list[Push] = []
    hard: dict[int, list[FloatArray]] = {}
    for k in boxes:
        radius = float(scene.world.movables.radii[k])
        paths: list[FloatArray] = []
        own: list[Push] = []
        for clearance, deep in _PATHS if thorough else _PATHS[:2]:
            away = clearance * scene.half if clearance > 0.0 else 0.75 * radius
            path = None if len(own) > 1 and not deep else scene.object_path(k, away, deep)
            if path is None or any(_alike(path, other, radius) for other in paths):
                continue
            paths.append(path)
            for fraction in SHIFTS if len(own) < 2 else SHIFTS[:1]:
                own += _path_push(simulator, k, path, fraction * scene.half)
        found += own
        if not own:
            hard[k] = paths
    away = np.hypot(*(scene.poses[:, :2] - scene.world.robot_pose[:2]).T)
    for n, k in enumerate(sorted(hard, key=lambda k: (float(away[k]), k))):
        if n >= _HARD and found:
            break
        own = []
        for path in hard[k]:
            if thorough or not own:
                own += curved_pushes(simulator, k, path)
        if thorough and not own:
            own = [push for path in hard[k] for push in partial_pushes(simulator, k, path)]
        found += own
    return found


def _alike(a: FloatArray, b: FloatArray, radius: float) -> bool:
    return a.shape == b.shape and float(np.abs(a - b).max()) < 0.2 * radius


def _path_push(
    simulator: PushSimulator, k: int, path: FloatArray, shift: float, wanted: Sequence[int] = ()
) -> list[Push]:
    scene = simulator.scene
    start = pose_behind(scene, k, initial_heading(path, 0.5 * scene.size), shift)
    if not scene.fits(start):
        return []
    length = path_length(path)
    limit = 1.5 * length + 4.0 * scene.size
    return simulator.simulate(start, k, path=path, shift=shift, limit=limit, wanted=wanted)


def collecting_pushes(simulator: PushSimulator, boxes: Iterable[int]) -> list[Push]:
    """Path-following pushes of one object that take another along, side by side on the bumper."""
    scene = simulator.scene
    movables, found = scene.world.movables, []
    clearance = 1.08 * scene.half
    boxes = list(boxes)
    paths = {k: scene.object_path(k, clearance) for k in boxes}
    for k in boxes:
        own = paths[k]
        if own is None:
            continue
        own_length = path_length(own)
        away = np.hypot(*(scene.poses[:, :2] - scene.poses[k, :2]).T)
        for j in sorted(boxes, key=lambda j: (float(away[j]), j))[: _PARTNERS + 1]:
            other = paths[j]
            if j == k or other is None:
                continue
            width = 0.75 * float(movables.radii[j] + movables.radii[k])
            if (
                float(away[j]) + path_length(other) > own_length + 1.5 * scene.size
                or width > 1.3 * scene.half
            ):
                continue
            heading = initial_heading(other, scene.size)
            _, v = heading_axes(heading)
            for side in (1.0, -1.0):
                beside = scene.poses[j, :2] - side * width * v
                approach = beside - scene.poses[k, :2]
                turn = math.atan2(approach[1], approach[0]) - heading
                if abs(math.remainder(turn, 2.0 * math.pi)) > 1.0:
                    continue
                points = [scene.poses[k, :2], beside, *other[1:]]
                path = np.ascontiguousarray(np.array(points))
                shift = side * 0.5 * width
                found += _path_push(simulator, k, path, shift, wanted=(k, j))
    return found
