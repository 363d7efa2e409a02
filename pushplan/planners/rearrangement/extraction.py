"""Extraction primitives: short drives that get an object out of a tight place.

Behind an object in a gap, in a corner or flat at a wall there is no clearance for the robot. But
the end of its bumper may reach in and hook it out backwards, or turn it. Such drives are searched
with the interaction model: from many places round the object, along arcs forward, backward and on
the spot, one after another where one is not enough (a beam search over poses of robot and object).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pushplan.planners.rearrangement.arc_kernels import sweep_arcs
from pushplan.planners.rearrangement.pre_relocation import can_deliver
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_poses import (
    distance_to_bounds,
    distance_to_obstacles,
    initial_heading,
    pose_distance,
)
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.push_simulator import PushSimulator
from pushplan.planners.rearrangement.rollout_cache import Primitive
from pushplan.world.checks import FloatArray

_STARTS = 300  # from how many places round the object an extraction primitive may begin
_DRAWS = 3000  # how many places are looked at for that
_LENGTH = 1.6  # of an arc [circumscribed radii]
_ROUNDS = 3  # how many arcs follow one another at most
_BEAM = 60  # how many states are driven on from
_TRIALS = 15
"""In how many places, after each round, it is looked whether the object can be pushed home."""
_ENOUGH = 3  # after so many places that an object can be delivered from no more are looked for
_SIDES = 20  # how many of them are kept, all sides from which they begin counted
_SHAKEN = ((0.0, 0.0, 0.0), (0.08, 0.08, 0.15), (-0.08, 0.08, -0.15), (0.0, -0.1, 0.0))
"""Errors of the prediction with which that has to succeed [circumscribed radii, rad]."""
_LEAST = 0.15  # by how much an object has to be moved for it to count [circumscribed radii]
_NEARLY = (0.0, 0.6, -0.6)
"""Directions in which a push brings an object nearer to its goal, against the way there [rad]."""
_NEAR = 8.0  # what is farther from the object does not count for a search [circumscribed radii]
_SEARCHES = 24  # how often they are searched until something is done; bounds the time of an episode
_CURVATURES = (0.0, 0.7, -0.7, 1.6, -1.6)  # of the arcs, times the robot's circumscribed radius
_SPREAD = np.array([0.8191725134, 0.6710436067, 0.5497004779])
"""Steps of an additive recurrence that fills a cube evenly (Roberts 2018)."""


def extraction_primitives(simulator: PushSimulator, k: int) -> list[Push]:
    """Drives after which object ``k`` can be pushed home, or else lies less tightly than now."""
    scene, found = simulator.scene, None
    movables = scene.world.movables
    near = np.hypot(*(scene.poses[:, :2] - scene.poses[k, :2]).T) < _NEAR * scene.size
    key = movables.ids[near].tobytes() + scene.poses[near].tobytes()
    if scene.cache is not None:
        found = scene.cache.primitives(int(movables.ids[k]), key)
        if found is None and scene.cache.searches >= _SEARCHES:
            return []
    if found is None:
        found = _search(scene, k)
        if scene.cache is not None:
            scene.cache.keep_primitives(int(movables.ids[k]), key, found)
    return [
        replace(push, cost=push.cost + extra)
        for path, extra in found
        for push in simulator.simulate_primitive(path, k)
    ]


def _search(scene: PushScene, k: int) -> list[Primitive]:
    """The primitives of the first round that has any; else those that loosen the object."""
    search = _ExtractionSearch(scene, k)
    level = [_BeamNode(start[None], scene.poses, -1) for start in _starts(scene, k)]
    best: list[_BeamNode] = []
    for _ in range(_ROUNDS):
        if not level:
            break
        states = search.drive_on(level)
        found = search.delivering(states)
        if found:
            return found
        best = search.from_all_sides(sorted([*best, *states], key=lambda state: state.cost))
        level = search.selected(states)
    return search.loosened(best)


@dataclass(frozen=True, eq=False)
class _BeamNode:
    """Where some arcs have led to.

    Args:
        path: (N, 3) of the robot, from the start on.
        poses: (K, 3) of the objects.
        arc: the arc driven last, -1 for none.
        cost: by which states are compared [m].
    """

    path: FloatArray
    poses: FloatArray
    arc: int
    cost: float = math.inf


class _ExtractionSearch:
    """What the rounds of one search have in common."""

    def __init__(self, scene: PushScene, k: int) -> None:
        self._scene, self._k = scene, k
        self._directions: dict[tuple[int, int], float] = {}
        self._tight = float(self._tightness(scene.poses[[k], :2])[0])
        self._arcs = _arcs(scene)
        self._steps = max(2, math.ceil(_LENGTH * scene.size / scene.controller.step))

    def _tightness(self, points: FloatArray) -> FloatArray:
        """The clearance that the robot lacks for work on the object at points (N, 2) [m].

        Between columns that is clearance on every side; at the walls, clearance behind the object,
        that is where the robot would push it towards its goal from, or nearly so.
        """
        scene = self._scene
        depth = scene.front + float(scene.world.movables.radii[self._k])
        towards = np.array([self._towards(point) for point in points])
        missing = np.full(len(points), np.inf)
        for turn in _NEARLY:
            u = np.column_stack([np.cos(towards + turn), np.sin(towards + turn)])
            clearance = np.minimum(
                distance_to_bounds(scene.world.static, points - depth * u) / (1.05 * scene.half),
                distance_to_bounds(scene.world.static, points - (depth + scene.front) * u)
                / scene.size,
            )
            missing = np.minimum(missing, scene.size * np.maximum(1.0 - clearance, 0.0))
        between = 1.05 * scene.half - distance_to_obstacles(scene.world.static, points)
        out: FloatArray = missing + np.maximum(between, 0.0)
        return out

    def _towards(self, point: FloatArray) -> float:
        """Direction of the path of the object from a point (2,) [rad]."""
        unit = 0.1 * self._scene.size
        key = round(float(point[0]) / unit), round(float(point[1]) / unit)
        if key not in self._directions:
            pose = np.array([*point, 0.0])
            path = self._scene.object_path(self._k, 0.0, pose=pose)
            ahead = 0.5 * self._scene.size
            self._directions[key] = math.nan if path is None else initial_heading(path, ahead)
        return self._directions[key]

    def drive_on(self, level: list[_BeamNode]) -> list[_BeamNode]:
        """All that comes of driving on from some states along an arc, best first."""
        scene, k = self._scene, self._k
        found: list[_BeamNode] = []
        for state in level:
            # copies may be written to: one kernel for all
            start, before = np.array(state.path[-1]), np.array(state.poses)
            tracks, poses, reached = sweep_arcs(
                start, before, self._arcs, self._steps, scene.bodies, scene.settings
            )
            for a, (track, after, count) in enumerate(zip(tracks, poses, reached, strict=True)):
                for end in _news(after[:count, k], scene.size) if a != state.arc else ():
                    path = np.concatenate([state.path, track[1 : end + 1]])
                    found.append(_BeamNode(path, after[end].copy(), a))
        if not found:
            return []
        tight = self._tightness(np.array([state.poses[k, :2] for state in found]))
        driven = 0.05 * scene.controller.step * np.array([len(state.path) - 1 for state in found])
        return [
            replace(found[n], cost=float(tight[n] + driven[n]))
            for n in np.argsort(tight + driven, kind="stable").tolist()
        ]

    def delivering(self, states: list[_BeamNode]) -> list[Primitive]:
        """Drives to the first few places from which the object can be pushed home.

        From several sides each: which is nearest to the robot is for others to say.
        """
        scene, k = self._scene, self._k
        good: dict[tuple[int, ...], list[_BeamNode]] = {}
        seen: set[tuple[int, ...]] = set()
        for state in states:
            cell = self._cell(state.poses[k], 0.2, 0.5)
            if cell in good:
                good[cell].append(state)
            if cell in seen or pose_distance(state.poses[k], scene.poses[k], scene.size) < _LEAST:
                continue
            if len(seen) >= _TRIALS or len(good) >= _ENOUGH:
                continue
            seen.add(cell)
            if all(can_deliver(scene, k, state.poses, state.path[-1], by) for by in _SHAKEN):
                good[cell] = [state]
        found = [state for alike in good.values() for state in self.from_all_sides(alike)]
        return [(state.path, 0.0) for state in found[:_SIDES]]

    def from_all_sides(self, states: list[_BeamNode]) -> list[_BeamNode]:
        """The first few states with drives that begin in different places."""
        sides: dict[tuple[int, ...], _BeamNode] = {}
        for state in states:
            sides.setdefault(self._cell(state.path[0], 0.8, 0.8), state)
        return list(sides.values())[:_SIDES]

    def loosened(self, states: list[_BeamNode]) -> list[Primitive]:
        """Drives to states in which the object lies much less tightly than it did."""
        scene = self._scene
        found: list[Primitive] = []
        for state in states:
            tight = float(self._tightness(state.poses[[self._k], :2])[0])
            if tight < self._tight - 0.08 * scene.size:
                found.append((state.path, 3.0 * tight + 2.0 * scene.size))
        return found

    def selected(self, states: list[_BeamNode]) -> list[_BeamNode]:
        """The best states to drive on from, no two of them alike."""
        chosen: dict[tuple[int, ...], _BeamNode] = {}
        for state in states:
            if len(chosen) >= _BEAM:
                break
            pair = (
                *self._cell(state.poses[self._k], 0.2, 0.5),
                *self._cell(state.path[-1], 0.3, 0.5),
            )
            chosen.setdefault(pair, state)
        return list(chosen.values())

    def _cell(self, pose: FloatArray, side: float, turn: float) -> tuple[int, ...]:
        """A box of poses, sides in circumscribed radii and [rad]."""
        units = (side * self._scene.size, side * self._scene.size, turn)
        return tuple(round(float(value) / unit) for value, unit in zip(pose, units, strict=True))


def _arcs(scene: PushScene) -> FloatArray:
    """(A, 2) distance [m], negative backward, and turn [rad] of one step of each arc."""
    step = scene.controller.step
    signs = (1.0, -1.0) if scene.world.robot.min_speed != 0.0 else (1.0,)
    arcs = [
        (sign * step, curvature * step / scene.size) for sign in signs for curvature in _CURVATURES
    ]
    out = np.array([*arcs, (0.0, 0.1), (0.0, -0.1)])
    out[:, 1] = np.clip(out[:, 1], -scene.controller.turn, scene.controller.turn)
    return out


def _starts(scene: PushScene, k: int) -> list[FloatArray]:
    """Poses (3,) round object ``k`` that touch nothing, evenly spread."""
    box, radius = scene.poses[k], float(scene.world.movables.radii[k])
    fraction = np.mod(0.5 + np.outer(np.arange(1, _DRAWS + 1), _SPREAD), 1.0)
    away = 0.3 * radius + scene.size * (0.2 + 1.1 * fraction[:, 0])
    bearing, heading = 2.0 * np.pi * fraction[:, 1], 2.0 * np.pi * fraction[:, 2] - np.pi
    x, y = box[0] + away * np.cos(bearing), box[1] + away * np.sin(bearing)
    found: list[FloatArray] = []
    for pose in np.column_stack([x, y, heading]):
        if scene.fits(pose) and scene.is_clear(pose):
            found.append(pose)
            if len(found) == _STARTS:
                break
    return found


def _news(poses: FloatArray, size: float) -> list[int]:
    """Indices at which an object (N, 3) has moved on since the last of them."""
    found, last = [], poses[0]
    for n in range(1, len(poses)):
        if pose_distance(poses[n], last, size) >= 0.05:
            found.append(n)
            last = poses[n]
    return found
