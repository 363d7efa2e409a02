"""`GreedyPusher`: the nearest box that is not done, pushed straight towards its goal."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np

from pushplan.control import LegFollower, Legs, Recovery
from pushplan.geometry import VisibilityGraph
from pushplan.planners.pushing import PushPath
from pushplan.planners.rearrangement.push_controllers import GeometricPusher, PathPush
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.push_starts import heading_axes, initial_heading
from pushplan.planners.rearrangement.rearrangement_policy import RearrangementPolicy
from pushplan.world import StaticMap, Twist, World
from pushplan.world.checks import FloatArray

_OPTIONS = 8  # places to push a box from that are tried before the first comes again
_RETREAT = 0.6  # distance that the robot backs off after a push [circumscribed radii]
_WAIT = 1.5  # time after which it looks again where it can get at no box [s]
_STARTS = sorted(
    (
        (math.radians(turn), shift)
        for turn in (0, 30, -30, 60, -60, 90, -90)
        for shift in (0.0, 0.35, -0.35, 0.7, -0.7)
    ),
    key=lambda option: 2.0 * abs(option[0]) + abs(option[1]),
)
"""Starts of a push, in order of preference: turn against the shortest path [rad], and offset of the
robot's middle to the left of the object's, as a fraction of half the bumper's width."""
_PATHS = ((0.7, False), (0.0, False), (0.0, True))
"""Paths of an object: the clearance that it keeps where there is room [radii of the object], and
whether it goes to the middle of a receptacle."""
_TURNING_ROOM = 1.05  # length of the last leg, before which it turns [circumscribed radii]
_LEANS = tuple(math.radians(lean) for lean in (0, 20, -20, 40, -40))
"""Directions of the last leg against the heading of the push [rad]."""


@dataclass
class _Attempt:
    """One push: of which box, how the robot gets behind it, and whether it is there."""

    box: int
    driver: LegFollower
    push: PathPush
    pushing: bool = False


class GreedyPusher(RearrangementPolicy):
    """Takes the nearest box that is not done, drives behind it and pushes until it is done.

    Behind means opposite to the box's shortest path around static things to its goal; where the
    robot does not fit there it stands aside or begins at an angle, beside a wall for instance.
    Other boxes are not looked at. A box that cannot be got at or got on with is put off until the
    others have had their turn. No chance is involved.

    Args:
        config: settings; of these, ``response`` counts.
    """

    def _forget(self) -> None:
        super()._forget()
        self._attempt: _Attempt | None = None
        self._failures: Counter[int] = Counter()
        self._wait_until = -math.inf

    def _act(self, world: World) -> Twist:
        command = self._recover(world) or self._work(PushScene(world, self.config))
        return command or self._recover(world) or Twist(0.0, 0.0)

    def _work(self, scene: PushScene) -> Twist | None:
        """The next command of the attempt in hand or of a new one; None where it has ended."""
        world = scene.world
        response = self.config.response
        self._attempt = attempt = self._attempt or self._choose(scene)
        if attempt is None:
            return None
        done = attempt.box not in world.movables.ids[~scene.done]
        command = None if done else self._drive(attempt, scene)
        if command is None:
            if not done:  # it is the box's fault, which comes last from now on
                self._failures[attempt.box] += 1
            self._attempt = None
            recovery = Recovery(world, _RETREAT * scene.size, response=response, looks=False)
            self._recovery = recovery.command
        return command

    def _drive(self, attempt: _Attempt, scene: PushScene) -> Twist | None:
        """Get behind the box, and then push it; None where that fails."""
        if not attempt.pushing:
            pose = scene.world.robot_pose
            time = scene.world.time
            command = attempt.driver.command(pose, time, self._clock.held)
            attempt.pushing = attempt.driver.arrived
            if not attempt.pushing:
                return command
        return attempt.push.command(scene, self._clock.held)

    def _choose(self, scene: PushScene) -> _Attempt | None:
        """The nearest box that the robot can get behind, of those that failed least often."""
        world = scene.world
        failures = self._failures
        if world.time < self._wait_until:
            return None
        away = np.hypot(*(scene.poses[:, :2] - world.robot_pose[:2]).T)
        ids = world.movables.ids.tolist()
        for k in sorted(scene.left, key=lambda k: (failures[ids[k]], away[k], k)):
            skip = failures[ids[k]] % _OPTIONS
            place = line_up(scene, k, skip)
            if place is not None:
                driver = LegFollower(world.robot, place.legs, response=self.config.response)
                pusher = GeometricPusher(scene.controller, place.shift)
                return _Attempt(ids[k], driver, PathPush(world.robot, ids[k], place.path, pusher))
            failures[ids[k]] += 1
        self._wait_until = world.time + _WAIT
        return None


@dataclass(frozen=True)
class LineUp:
    """Start of a push, and the legs that lead there.

    Args:
        path: of the object.
        shift: of the robot's middle to the left of the object's [m].
        legs: that lead there.
    """

    path: PushPath
    shift: float
    legs: Legs


def shortest_path(scene: PushScene, k: int) -> FloatArray | None:
    """(M, 2) the shortest path of object ``k`` to where it is done, and on [m]; None if none is.

    It keeps about half the object's width from static things where it can.
    """
    radius = float(scene.movables.radii[k])
    found = (
        scene.object_paths.path(scene.poses[k, :2], radius, clearance * radius, deep)
        for clearance, deep in _PATHS
    )
    return next((path for path in found if path is not None), None)


def line_up(scene: PushScene, k: int, skip: int = 0) -> LineUp | None:
    """A place behind object ``k``, for the best option to push it that allows one.

    Args:
        scene: the scene.
        k: index of the object.
        skip: how many of the best options to pass over, because they have failed before; it begins
            anew where there are no more.

    Returns:
        None where the object has no path, or the robot fits nowhere, or cannot get there around
        static things and the object itself; other objects are not looked at.
    """
    path = shortest_path(scene, k)
    if path is None:
        return None
    robot = scene.world.robot
    static = scene.world.static
    parts = scene.movables.parts_world(k)
    around = StaticMap((*static.polygons, *parts), static.segments, static.radii, static.bounds)
    towards = initial_heading(path, scene.controller.ahead)
    found = []
    for clearance in (scene.size, 0.5 * (scene.size + robot.inscribed_radius)):
        for turn, fraction in _STARTS:
            heading = towards + turn
            shift = fraction * scene.half
            start = scene.starts.behind(k, heading, shift)
            legs = _legs_to(scene, around, start, clearance)
            if legs is not None:
                found.append(LineUp(PushPath.through(path), shift, legs))
            if len(found) > skip:
                return found[skip]
        if found:
            return found[skip % len(found)]
    return None


def _legs_to(
    scene: PushScene, around: StaticMap, start: FloatArray, clearance: float
) -> Legs | None:
    """Legs that lead to a pose (3,).

    The last leg is straight, from where the robot can turn. Beside a wall it may come from
    farther out, and the robot turns at the end by as much.
    """
    behind = start[:2]
    heading = float(start[2])
    if not scene.starts.fits(start):
        return None
    for lean in _LEANS:
        stop = behind - _TURNING_ROOM * scene.size * heading_axes(heading + lean)[0]
        poses = [
            np.array([*place, heading + angle])
            for place, angle in ((behind, lean), (behind, 0.5 * lean), (stop, lean))
        ]
        if not all(scene.starts.fits(pose) for pose in poses):
            continue
        path = VisibilityGraph(around, clearance).shortest_path(scene.world.robot_pose[:2], stop)
        if math.isfinite(path.length):
            return Legs.ahead(np.concatenate([path.points[1:], [stop, behind]]), heading)
    return None
