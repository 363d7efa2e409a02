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

from pushplan.planners.rearrangement.approach import ApproachTree, arrival_poses
from pushplan.planners.rearrangement.arc_kernels import sweep_arcs
from pushplan.planners.rearrangement.candidates import can_deliver
from pushplan.planners.rearrangement.goal_kernels import REMOVED
from pushplan.planners.rearrangement.primitives import SHIFTS
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_pose_kernels import missing_clearance
from pushplan.planners.rearrangement.push_poses import (
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
_EXPANSIONS = 400  # how many states are driven on from
_ALIKE = 3  # from how many states with the object in the same place
_ENOUGH = 8  # after so many sides from which a drive helps no more are looked for
_SIDES = 20  # how many drives are kept, all sides from which they begin counted
_ERRORS = ((0.0, 0.0, 0.0), (0.08, 0.08, 0.15), (-0.08, 0.08, -0.15), (0.0, -0.1, 0.0))
"""Errors of the prediction that a push home afterwards stands [circumscribed radii, rad]."""
_MARGINS = (1.0, 2.0, 3.0)
"""Factors on them; a drive costs a circumscribed radius more for each that it does not stand."""
_LEAST = 0.15  # by how much an object has to be moved for it to count [circumscribed radii]
_NEARLY = np.radians([0.0, 30.0, -30.0])
"""Directions in which a push brings an object nearer to its goal, against the way there [rad]."""
_BESIDE = np.array(SHIFTS[:3])
_NEWS = 0.05  # how far an object moves on until it is looked at anew [circumscribed radii]
_LACKING = 3.0  # cost of clearance that the robot lacks behind the object
_FARTHEST = 4.0  # clearance is looked for so far [circumscribed radii]
_GAIN = 0.3  # by how much less has to be left to be done for a drive to help [circumscribed radii]
_NEAR = 8.0  # what is farther from the object does not count for a search [circumscribed radii]
_CURVATURES = (0.0, 0.7, -0.7, 1.6, -1.6)  # of the arcs, times the robot's circumscribed radius
_SPREAD = np.array([0.8191725134, 0.6710436067, 0.5497004779])
"""Steps of an additive recurrence that fills a cube evenly (Roberts 2018)."""


def relocating_pushes(simulator: PushSimulator, k: int, approach: ApproachTree) -> list[Push]:
    """Drives after which object ``k`` can be pushed home, or else lies better than now."""
    scene, found = simulator.scene, None
    movables = scene.world.movables
    near = np.hypot(*(scene.poses[:, :2] - scene.poses[k, :2]).T) < _NEAR * scene.size
    robot = np.round(scene.world.robot_pose[:2] / (2.0 * scene.size))
    key = movables.ids[near].tobytes() + scene.poses[near].tobytes() + robot.tobytes()
    if scene.cache is not None:
        found = scene.cache.primitives(int(movables.ids[k]), key)
    if found is None:
        found = _RelocationSearch(scene, k, approach).run()
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
        away: what it costs to get to the start [m].
        rest: what is left to be done with the object [m].
        cost: of the drive, and of what it leaves to be done [m].
    """

    path: FloatArray
    poses: FloatArray
    depth: int
    away: float
    rest: float
    cost: float


class _RelocationSearch:
    """The search for one object of a scene."""

    def __init__(self, scene: PushScene, k: int, approach: ApproachTree) -> None:
        self._scene, self._k, self._approach = scene, k, approach
        self._rests: dict[tuple[int, ...], float] = {}
        self._arcs = _arcs(scene)
        self._steps = max(2, math.ceil(_LENGTH * scene.size / scene.controller.step))
        self._open: list[tuple[float, int, _State]] = []
        self._states: list[_State] = []
        self._order = itertools.count()

    def run(self) -> list[Primitive]:
        """Drives, each with the cost of what it leaves to be done [m]."""
        scene, k = self._scene, self._k
        now = self._rest(scene.poses[k])
        for start in itertools.chain(self._behind(), self._around()):
            away = self._approach_cost(start)
            if math.isfinite(away):
                state = _State(start[None], scene.poses, 0, away, now, away + now)
                heapq.heappush(self._open, (state.cost, next(self._order), state))
        tried: dict[tuple[int, ...], int] = {}
        expanded: Counter[tuple[int, ...]] = Counter()
        sides: set[tuple[int, ...]] = set()
        while self._open and expanded.total() < _EXPANSIONS and len(sides) < _ENOUGH:
            state = heapq.heappop(self._open)[2]
            if not state.depth:
                expanded[()] += 1
                self._expand(state)
                continue
            place = self._cell(state.poses[k], 0.2, 0.5)
            if not self._has_moved(state) or expanded[place] >= _ALIKE:
                continue
            if place not in tried:
                tried[place] = self._margins_left(state)
            if not tried[place]:
                sides.add(self._side(state))
            elif state.depth < _DEPTH:
                expanded[place] += 1
                self._expand(state)
        self._states.sort(key=lambda state: state.cost)
        good = []
        for state in self._states:
            margins = tried.get(self._cell(state.poses[k], 0.2, 0.5), len(_MARGINS))
            if margins < len(_MARGINS):
                good.append((margins * scene.size, state))
        if good:
            good.sort(key=lambda entry: entry[0] + entry[1].cost)
            extra = {id(state): more for more, state in good}
            return [
                (state.path, extra[id(state)])
                for state in self._from_all_sides(state for _, state in good)
            ]
        better = [state for state in self._states if state.rest < now - _GAIN * scene.size]
        return [
            (state.path, state.rest - self._left(state) + 2.0 * scene.size)
            for state in self._from_all_sides(better)
        ]

    def _left(self, state: _State) -> float:
        """Shortest path of the object from where a state has it [m]."""
        return float(self._scene.remaining(state.poses[[self._k]])[0])

    def _approach_cost(self, start: FloatArray) -> float:
        """What it costs to get to a start (3,) [m]."""
        nodes, extra = arrival_poses(self._scene.fine, start)
        return float((self._approach.costs[nodes] + extra).min()) if len(nodes) else math.inf

    def _expand(self, state: _State) -> None:
        """Drive on from a state along every arc; each place that the object gets to is a state."""
        scene, k = self._scene, self._k
        # copies may be written to: one kernel for all
        start, before = np.array(state.path[-1]), np.array(state.poses)
        tracks, poses, marks = sweep_arcs(
            start,
            before,
            self._arcs,
            self._steps,
            k,
            scene.size,
            _NEWS,
            scene.bodies,
            scene.settings,
        )
        for a, end in marks.tolist():
            path, after = np.concatenate([state.path, tracks[a, 1 : end + 1]]), poses[a, end]
            rest = self._rest(after[k])
            cost = state.away + scene.controller.step * (len(path) - 1) + rest
            found = _State(path, after, state.depth + 1, state.away, rest, cost)
            self._states.append(found)
            heapq.heappush(self._open, (cost, next(self._order), found))

    def _has_moved(self, state: _State) -> bool:
        scene, k = self._scene, self._k
        return pose_distance(state.poses[k], scene.poses[k], scene.size) >= _LEAST

    def _margins_left(self, state: _State) -> int:
        """How many of the margins a push home from where a state has the object does not stand."""
        for n, margin in enumerate(_MARGINS):
            if not all(self._delivers(state, margin * np.array(by)) for by in _ERRORS[n > 0 :]):
                return len(_MARGINS) - n
        return 0

    def _delivers(self, state: _State, by: FloatArray) -> bool:
        """Whether a push gets the object home from where it is in a state, moved by an error."""
        scene, k = self._scene, self._k
        there = state.poses[:, 0] < 0.5 * REMOVED
        world, index = scene.world, int(there[:k].sum())
        moved = state.poses[there]
        moved[index] += by * np.array([scene.size, scene.size, 1.0])
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
            sides.setdefault(self._side(state), state)
            if len(sides) == _SIDES:
                break
        return list(sides.values())

    def _side(self, state: _State) -> tuple[int, ...]:
        """The box of poses that a drive begins in."""
        return self._cell(state.path[0], 0.8, 0.8)

    def _cell(self, pose: FloatArray, side: float, turn: float) -> tuple[int, ...]:
        """A box of poses, sides in circumscribed radii and [rad]."""
        units = (side * self._scene.size, side * self._scene.size, turn)
        return tuple(round(float(value) / unit) for value, unit in zip(pose, units, strict=True))

    def _rest(self, pose: FloatArray) -> float:
        """What is left to be done with the object at a pose (3,), or near it [m].

        Its shortest path, and clearance that the robot lacks behind it: how much farther along its
        path, or nearly so, the object would have to be for the robot to fit there.
        """
        scene, k = self._scene, self._k
        key = self._cell(pose, 0.1, 0.5)
        if key not in self._rests:
            path = scene.object_path(k, 0.0, pose=pose)
            if path is None:
                return _LACKING * _FARTHEST * scene.size
            towards = initial_heading(path, scene.size)
            outline = scene.world.movables.outline(k)
            reach, limit = scene.front + scene.config.slack * scene.size, _FARTHEST * scene.size
            lack = missing_clearance(
                np.array(pose),
                outline,
                towards + _NEARLY,
                scene.half * _BESIDE,
                reach,
                limit,
                *scene.fit,
            )
            self._rests[key] = _LACKING * lack + path_length(path)
        return self._rests[key]

    def _behind(self) -> Iterator[FloatArray]:
        """Poses (3,) behind and beside the object, by the rows of arcs of the table."""
        scene, k = self._scene, self._k
        path = scene.object_path(k, 0.0)
        if path is None:
            return
        towards = initial_heading(path, 0.5 * scene.size)
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
