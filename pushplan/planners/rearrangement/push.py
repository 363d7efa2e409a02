"""`Push`: one candidate push, what it is predicted to do, and which ones have been tried."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np

from pushplan.control import Legs
from pushplan.core import rearrangement as core
from pushplan.geometry.angles import wrap_angle
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.world import Plan, SubTask, World
from pushplan.world.checks import ArrayRecord, FloatArray
from pushplan.world.polyline import arc_lengths, goes_back, step_lengths

_FAILURE_COST = 3.0  # of a push, for each time that it has failed [circumscribed radii]
_RELOCATION_COST = 1.0
"""Of a relocation, for each one of its object since something was done [circumscribed radii]."""
_SAME_HEADING = 0.3
_SAME_ARC = 0.6
"""Headings that differ by less may have one `signature`, of pushes and of relocations [rad]."""
_BOX_INSCRIBED = 0.7  # inscribed over circumscribed radius of a box
_ON_THE_SPOT = 1e-6  # a step that is shorter turns on the spot [circumscribed radii]


@dataclass(frozen=True, eq=False)
class Push(ArrayRecord):
    """A push, from a place behind an object to where nothing is left to be done with it.

    Args:
        delivers: ids of the objects that are done by it.
        target: id of the object that it begins at.
        controller: how the robot drives, as in `PushPrimitive`: ``"line"`` straight ahead,
            ``"path"`` so that the target follows ``object_path``, ``"arc"`` along ``poses``
            themselves, ahead, back and on the spot.
        poses: (N, 3) the robot's path, from the start of the push on.
        length: of that path [m].
        work: sum of mass times path length over all objects [kg m].
        cost: what it costs in metres of the robot's path, work and remaining paths included [m].
        object_poses: (K, 3) where the objects are predicted to end.
        object_path: (M, 2) of the target object [m].
        shift: how far the robot's middle is to the left of the target object [m].
        gain: of the pushing controller, see `PushingController`.
        relocates: it only brings its target to where it can be pushed from, or nearer home.
    """

    delivers: tuple[int, ...]
    target: int
    controller: str
    poses: FloatArray
    length: float
    work: float
    cost: float
    object_poses: FloatArray
    object_path: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    shift: float = 0.0
    gain: float = 1.5
    relocates: bool = False

    @property
    def serves(self) -> tuple[int, ...]:
        """Ids of the objects that it does something for: those done, or its target."""
        return self.delivers or (self.target,)

    @property
    def start(self) -> FloatArray:
        """(3,) where the push begins."""
        start: FloatArray = self.poses[0]
        return start

    @property
    def end(self) -> FloatArray:
        """(3,) where it ends."""
        end: FloatArray = self.poses[-1]
        return end


@runtime_checkable
class PushCost(Protocol):
    """A term of the cost by which pushes are chosen."""

    def __call__(self, world: World, push: Push) -> float:
        """Cost of a push [m], beside those of driving and pushing; inf rules the push out.

        Args:
            world: the snapshot that the push is chosen for.
            push: with its prediction.
        """
        ...


def signature(push: Push) -> tuple[object, ...]:
    """Return the key by which a failed push is recognised."""
    heading = math.remainder(float(push.start[2]), math.tau)
    if push.controller == "arc":
        return push.target, push.controller, round(heading / _SAME_ARC)
    return (
        push.target,
        push.controller,
        round(heading / _SAME_HEADING),
        round(push.shift, 2),
        push.gain,
    )


@dataclass
class PushHistory:
    """Record of what has been tried since the last success, and its penalties on costs.

    Args:
        failures: how often a push has failed, or was a relocation that is not to come next again,
            by `signature`.
        relocations: how often an object has been relocated, by id.
    """

    failures: Counter[tuple[object, ...]] = field(default_factory=Counter)
    relocations: Counter[int] = field(default_factory=Counter)

    def penalty(self, push: Push, config: RearrangementConfig) -> float:
        """Return the penalty on the cost of a push [circumscribed radii]."""
        failures = self.failures[signature(push)]
        relocations = self.relocations[push.target] if push.relocates else 0
        if failures >= config.max_failures or relocations >= config.max_relocations:
            return math.inf
        return failures * _FAILURE_COST + relocations * _RELOCATION_COST

    def count_relocation(self, push: Push) -> None:
        """An object was relocated: what has failed with it before may succeed from there."""
        self.relocations[push.target] += 1
        for key in list(self.failures):
            if key[0] == push.target and key[1] != push.controller:
                del self.failures[key]

    def count_progress(self, config: RearrangementConfig) -> None:
        """Something was done, or has come back: what was ruled out is tried once more."""
        for key, count in self.failures.items():
            self.failures[key] = min(count, config.max_failures - 1)
        self.relocations.clear()


def push_plan(world: World, route: Legs | FloatArray | None, push: Push) -> Plan:
    """The route to a push and the push itself, at full speed and turn rate.

    A push is predicted at its end only: in between, ``object_poses`` follow the straight line from
    where the objects are, as far as the robot has pushed. An object that leaves the world ends in
    front of the robot.

    Args:
        world: the snapshot from which the robot starts, with the objects that the push knows.
        route: to the start of the push, as legs or (N, 3) poses; None if the robot is there.
        push: the push.
    """
    robot = world.robot
    approach = _route_poses(world, route)
    poses = np.concatenate([approach, push.poses])
    along = arc_lengths(poses)
    first = len(approach)
    lengths = step_lengths(poses)
    turns = wrap_angle(np.diff(poses[:, 2]))
    signs = np.where(goes_back(poses, robot.circumscribed_radius), -1.0, 1.0)
    steps = np.maximum(lengths / robot.max_speed, np.abs(turns) / robot.max_turn_rate)
    speeds = signs * robot.max_speed
    turn_rates = np.zeros(len(poses))
    moving = steps > 0.0
    np.divide(signs[:-1] * lengths, steps, out=speeds[:-1], where=moving)
    speeds[:-1][lengths < _ON_THE_SPOT * robot.circumscribed_radius] = 0.0
    np.divide(turns, steps, out=turn_rates[:-1], where=moving)
    done = np.maximum(along - along[first], 0.0) / max(float(along[-1] - along[first]), 1e-12)
    start = world.movables.poses
    ends = np.array(push.object_poses)
    gone = ends[:, 0] >= 0.5 * core.REMOVED
    ahead = np.max(robot.vertices[:, 0]) + _BOX_INSCRIBED * world.movables.radii[gone]
    x, y, theta = poses[-1]
    ends[gone, 0] = x + ahead * np.cos(theta)
    ends[gone, 1] = y + ahead * np.sin(theta)
    moves = ends - start
    moves[:, 2] = wrap_angle(moves[:, 2])
    return Plan(
        times=np.concatenate([[0.0], np.cumsum(steps)]),
        poses=poses,
        speeds=speeds,
        turn_rates=turn_rates,
        travel_cost=robot.mass * float(along[-1]),
        interaction_cost=push.work,
        object_poses=start + done[:, None, None] * moves,
        subtasks=(SubTask(push.serves, first, len(poses) - 1),),
    )


def _route_poses(world: World, route: Legs | FloatArray | None) -> FloatArray:
    """(N, 3) poses before and after each turn on the spot of a route, from where the robot is."""
    if isinstance(route, np.ndarray):
        return route
    poses = [np.array(world.robot_pose)]
    if route is not None:
        for point, sign in zip(route.points, route.signs, strict=True):
            move = point - poses[-1][:2]
            heading = np.arctan2(move[1], move[0]) + (np.pi if sign < 0.0 else 0.0)
            poses += [np.array([*poses[-1][:2], heading]), np.array([*point, heading])]
    return np.array(poses)
