"""Relocations: short drives after which an object can be pushed home.

Behind an object in a gap, in a corner or flat at a wall there is no clearance for the robot. But
it may be nudged along the wall, or the end of the bumper reaches in and hooks it out backwards, or
turns it. A best-first search over poses of robot and object finds such drives: from behind the
object and from all round it, along arcs ahead, back and on the spot, one after another where one is
not enough, each driven in the interaction model.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from pushplan.planners.rearrangement.arc_kernels import sweep_arcs
from pushplan.planners.rearrangement.candidates import can_deliver
from pushplan.planners.rearrangement.goal_kernels import REMOVED
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_poses import (
    distance_to_bounds,
    distance_to_obstacles,
    initial_heading,
    pose_behind,
    pose_distance,
)
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.push_simulator import PushSimulator
from pushplan.planners.rearrangement.rollout_cache import Primitive
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import path_length

_STARTS = 300  # from how many places round the object a drive may begin
_DRAWS = 3000  # how many places are looked at for that
_LENGTH = 1.6  # of an arc [circumscribed radii]
_DEPTH = 3  # how many arcs follow one another at most
_EXPANSIONS = 120  # how many states are driven on from
_ALIKE = 3  # from how many states with the object in the same place
_TRIALS = 45
"""In how many places it is looked whether the object can be pushed home."""
_ENOUGH = 3  # after so many places that an object can be delivered from no more are looked for
_SIDES = 20  # how many drives are kept, all sides from which they begin counted
_SHAKEN = ((0.0, 0.0, 0.0), (0.08, 0.08, 0.15), (-0.08, 0.08, -0.15), (0.0, -0.1, 0.0))
"""Errors of the prediction with which that has to succeed [circumscribed radii, rad]."""
_LEAST = 0.15  # by how much an object has to be moved for it to count [circumscribed radii]
_NEARLY = (0.0, 0.6, -0.6)
"""Directions in which a push brings an object nearer to its goal, against the way there [rad]."""
_NEAR = 8.0  # what is farther from the object does not count for a search [circumscribed radii]
_CURVATURES = (0.0, 0.7, -0.7, 1.6, -1.6)  # of the arcs, times the robot's circumscribed radius
_SPREAD = np.array([0.8191725134, 0.6710436067, 0.5497004779])
"""Steps of an additive recurrence that fills a cube evenly (Roberts 2018)."""


def relocating_pushes(simulator: PushSimulator, k: int) -> list[Push]:
    """Drives after which object ``k`` can be pushed home, or else lies better than now."""
    scene, found = simulator.scene, None
    movables = scene.world.movables
    near = np.hypot(*(scene.poses[:, :2] - scene.poses[k, :2]).T) < _NEAR * scene.size
    key = movables.ids[near].tobytes() + scene.poses[near].tobytes()
    if scene.cache is not None:
        found = scene.cache.primitives(int(movables.ids[k]), key)
    if found is None:
        found = _RelocationSearch(scene, k).run()
        if scene.cache is not None:
            scene.cache.keep_primitives(int(movables.ids[k]), key, found)
    return [
        replace(push, cost=push.cost + extra)
        for path, extra in found
        for push in simulator.simulate_primitive(path, k)
    ]


@dataclass(frozen=True, eq=False)
class _State:
    """Where some arcs have led to.

    Args:
        path: (N, 3) of the robot, from the start on.
        poses: (K, 3) of the objects.
        depth: how many arcs that were.
        lack: clearance that the object lacks there [m].
        left: how far it has to go from there [m].
        cost: of the drive, and of what it leaves to be done [m].
    """

    path: FloatArray
    poses: FloatArray
    depth: int
    lack: float = math.inf
    left: float = math.inf
    cost: float = math.inf


class _RelocationSearch:
    """The search for one object of a scene."""

    def __init__(self, scene: PushScene, k: int) -> None:
        self._scene, self._k = scene, k
        self._ways: dict[tuple[int, int], tuple[float, float]] = {}
        self._arcs = _arcs(scene)
        self._steps = max(2, math.ceil(_LENGTH * scene.size / scene.controller.step))
        self._open: list[tuple[float, int, _State]] = []
        self._states: list[_State] = []
        self._order = itertools.count()

    def run(self) -> list[Primitive]:
        """Drives, each with the cost of what it leaves to be done [m]."""
        scene, k = self._scene, self._k
        root = self._rated([_State(np.zeros((1, 3)), scene.poses, 0)])[0]
        batches = iter((self._behind, self._around))
        self._push(root)
        tried: dict[tuple[int, ...], bool] = {}
        expanded: Counter[tuple[int, ...]] = Counter()
        while self._open and expanded.total() < _EXPANSIONS:
            state = heapq.heappop(self._open)[2]
            if state is root:
                starts = next(batches, None)
                if starts is not None:
                    for start in starts():
                        self._expand(_State(start[None], scene.poses, 0))
                    self._push(root)
                continue
            place = self._cell(state.poses[k], 0.2, 0.5)
            if not self._has_moved(state) or expanded[place] >= _ALIKE:
                continue
            if place not in tried:
                if len(tried) == _TRIALS:
                    break
                tried[place] = all(self._delivers(state, by) for by in _SHAKEN)
                if sum(tried.values()) == _ENOUGH:
                    break
            if not tried[place] and state.depth < _DEPTH:
                expanded[place] += 1
                self._expand(state)
        self.tried, self.n = tried, expanded.total()
        self._states.sort(key=lambda state: state.cost)
        good = [state for state in self._states if tried.get(self._cell(state.poses[k], 0.2, 0.5))]
        if good:
            return [(state.path, 0.0) for state in self._from_all_sides(good)]
        better = [
            state
            for state in self._states
            if state.lack < root.lack - 0.08 * scene.size
            or (
                state.lack < root.lack + 0.02 * scene.size
                and state.left < root.left - 0.3 * scene.size
            )
        ]
        return [
            (state.path, 3.0 * state.lack + 2.0 * scene.size)
            for state in self._from_all_sides(better)
        ]

    def _push(self, state: _State) -> None:
        heapq.heappush(self._open, (state.cost, next(self._order), state))

    def _expand(self, state: _State) -> None:
        """Drive on from a state along every arc; each place that the object gets to is a state."""
        scene, k = self._scene, self._k
        # copies may be written to: one kernel for all
        start, before = np.array(state.path[-1]), np.array(state.poses)
        tracks, poses, reached = sweep_arcs(
            start, before, self._arcs, self._steps, scene.bodies, scene.settings
        )
        found = [
            _State(np.concatenate([state.path, track[1 : end + 1]]), after[end], state.depth + 1)
            for track, after, count in zip(tracks, poses, reached, strict=True)
            for end in _news(after[:count, k], scene.size)
        ]
        if not found:
            return
        for rated in self._rated(found):
            self._states.append(rated)
            self._push(rated)

    def _rated(self, states: list[_State]) -> list[_State]:
        """States, with what they leave to be done and what they cost."""
        step, points = self._scene.controller.step, np.array([s.poses[self._k, :2] for s in states])
        ways = [self._way_from(point) for point in points]
        lacks = self._lacks(points, np.array([towards for towards, _ in ways])).tolist()
        return [
            replace(
                state,
                lack=lack,
                left=left,
                cost=3.0 * lack + left + step * (len(state.path) - 1),
            )
            for state, lack, (_, left) in zip(states, lacks, ways, strict=True)
        ]

    def _has_moved(self, state: _State) -> bool:
        scene, k = self._scene, self._k
        return pose_distance(state.poses[k], scene.poses[k], scene.size) >= _LEAST

    def _delivers(self, state: _State, by: tuple[float, float, float]) -> bool:
        """Whether a push gets the object home from where it is in a state, moved by an error."""
        scene, k = self._scene, self._k
        there = state.poses[:, 0] < 0.5 * REMOVED
        world, index = scene.world, int(there[:k].sum())
        moved = state.poses[there]
        moved[index] += np.array(by) * np.array([scene.size, scene.size, 1.0])
        movables = world.movables.select(there).moved_to(moved)
        after = PushScene(
            replace(world, movables=movables, robot_pose=state.path[-1]), scene.config
        )
        if after.done[index]:
            return True
        simulator = PushSimulator(after)
        simulator.left = np.array([index])
        return can_deliver(simulator, index)

    def _from_all_sides(self, states: Iterable[_State]) -> list[_State]:
        """The first few states with drives that begin in different places."""
        sides: dict[tuple[int, ...], _State] = {}
        for state in states:
            sides.setdefault(self._cell(state.path[0], 0.8, 0.8), state)
            if len(sides) == _SIDES:
                break
        return list(sides.values())

    def _cell(self, pose: FloatArray, side: float, turn: float) -> tuple[int, ...]:
        """A box of poses, sides in circumscribed radii and [rad]."""
        units = (side * self._scene.size, side * self._scene.size, turn)
        return tuple(round(float(value) / unit) for value, unit in zip(pose, units, strict=True))

    def _lacks(self, points: FloatArray, towards: FloatArray) -> FloatArray:
        """The clearance that the robot lacks for work on the object at points (N, 2) [m].

        Between columns that is clearance on every side; at the walls, clearance behind the object,
        that is where the robot would push it towards its goal from, or nearly so.
        """
        scene = self._scene
        static = scene.world.static
        depth = scene.front + float(scene.world.movables.radii[self._k])
        missing = np.full(len(points), np.inf)
        for turn in _NEARLY:
            u = np.column_stack([np.cos(towards + turn), np.sin(towards + turn)])
            clearance = np.minimum(
                distance_to_bounds(static, points - depth * u) / (1.05 * scene.half),
                distance_to_bounds(static, points - (depth + scene.front) * u) / scene.size,
            )
            missing = np.minimum(missing, scene.size * np.maximum(1.0 - clearance, 0.0))
        between = 1.05 * scene.half - distance_to_obstacles(static, points)
        out: FloatArray = missing + np.maximum(between, 0.0)
        return out

    def _way_from(self, point: FloatArray) -> tuple[float, float]:
        """Direction [rad] and length [m] of the object's path from a point (2,) or near it."""
        unit = 0.1 * self._scene.size
        key = round(float(point[0]) / unit), round(float(point[1]) / unit)
        if key not in self._ways:
            path = self._scene.object_path(self._k, 0.0, pose=np.array([*point, 0.0]))
            if path is None:
                self._ways[key] = math.nan, 0.0
            else:
                self._ways[key] = initial_heading(path, 0.5 * self._scene.size), path_length(path)
        return self._ways[key]

    def _behind(self) -> Iterator[FloatArray]:
        """Poses (3,) behind and beside the object, by the rows of arcs of the table."""
        scene, k = self._scene, self._k
        towards, _ = self._way_from(scene.poses[k, :2])
        if not math.isfinite(towards):
            return
        for row in scene.config.primitives:
            if row.controller == "arc":
                for lean, shift in itertools.product(row.leans, row.shifts):
                    heading = towards + math.radians(lean)
                    pose = pose_behind(scene, k, heading, shift * scene.half)
                    if scene.fits(pose) and scene.is_clear(pose):
                        yield pose

    def _around(self) -> Iterator[FloatArray]:
        """Poses (3,) round the object that touch nothing, evenly spread."""
        scene = self._scene
        box, radius = scene.poses[self._k], float(scene.world.movables.radii[self._k])
        fraction = np.mod(0.5 + np.outer(np.arange(1, _DRAWS + 1), _SPREAD), 1.0)
        away = 0.3 * radius + scene.size * (0.2 + 1.1 * fraction[:, 0])
        bearing, heading = 2.0 * np.pi * fraction[:, 1], 2.0 * np.pi * fraction[:, 2] - np.pi
        x, y = box[0] + away * np.cos(bearing), box[1] + away * np.sin(bearing)
        poses = np.column_stack([x, y, heading])
        free = (pose for pose in poses if scene.fits(pose) and scene.is_clear(pose))
        return itertools.islice(free, _STARTS)


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


def _news(poses: FloatArray, size: float) -> list[int]:
    """Indices at which an object (N, 3) has moved on since the last of them."""
    found, last = [], poses[0]
    for n in range(1, len(poses)):
        if pose_distance(poses[n], last, size) >= 0.05:
            found.append(n)
            last = poses[n]
    return found
