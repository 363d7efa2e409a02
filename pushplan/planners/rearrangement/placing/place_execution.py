"""`PlaceExecution`: one push in hand: the way there, contact, the push, and backing off."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from pushplan.control import (
    LegFollower,
    Legs,
    PoseFollower,
    ProgressChecker,
    StallChecker,
    decrease_by,
)
from pushplan.control.limits import approach_speed
from pushplan.planners.pushing import PushingConfig, PushingMpc, PushParameters, PushPath
from pushplan.planners.rearrangement.placing.contact import ahead_of, compose, inverse
from pushplan.planners.rearrangement.placing.curves import Turning
from pushplan.planners.rearrangement.placing.place_order import PlaceChoice
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.world import Plan, RobotModel, Twist, World
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import path_length

_ALIGNED = math.radians(0.4)  # error of a heading that is left where a push begins
_PLACED = 0.004  # error of the place that is left there [circumscribed radii]
_ARRIVED = 0.3  # distance from the end of its way at which the robot is there [the same]
_PASSED = 0.12  # distance at which a corner of the way counts as reached [circumscribed radii]
_ROUGHLY = math.radians(12.0)  # error of the heading with which it sets out for one
_STEP = 0.12  # distance of poses on a straight way [circumscribed radii]
_BRAKING = 0.5  # time in which a push comes to a stop, so that the object does not run ahead [s]
_PROGRESS = 0.01  # by which a push gets on [circumscribed radii]
_PATIENCE = 2.0  # time without getting on after which it is given up [s]
_BEYOND = 30  # poses by which the path of an object is longer than its way
_PRESS = 0.02  # by which the robot drives on into contact [circumscribed radii]
_LOST_GAP = 0.25  # gap between bumper and object at which it is lost [circumscribed radii]
_LOST_ASIDE = 1.2  # offset at which it is [half widths of the bumper]
_LONGER = 1.15  # a curve from where contact was made is good that is longer by less

Follower = Callable[[World, float], Twist | None]
"""From the scene and for how long a command is held [s] to the velocity; None at the end."""


class PlaceExecution:
    """Carries out one push.

    Args:
        choice: the push and the way to it.
        robot: its limits.
        config: settings; ``mpc`` says by which controller the object is pushed.
        grip: friction that is counted on.

    Attributes:
        stuck: the robot did not get to its start.
        slip: how far the object has slid to the left on the bumper during the push [m].
    """

    def __init__(
        self, choice: PlaceChoice, robot: RobotModel, config: RearrangementConfig, grip: float
    ) -> None:
        self.push = choice.push
        self._config = config
        self._grip = grip
        self._robot = robot
        self._goal = choice.push.object_pose
        self._stages: list[Callable[[World], Follower]] = [
            partial(self._on_the_way, choice.way),
            self._into_contact,
            self._along_the_curve,
            self._back,
        ]
        self._follower: Follower | None = None
        self.stuck = False
        self.slip = 0.0
        self._aside = 0.0

    def command(self, world: World, held: float) -> Twist | None:
        """The velocity to drive now; None at the end.

        Args:
            world: the scene now.
            held: for how long the command will be held [s].
        """
        while self._follower is not None or self._stages:
            if self._follower is None:
                self._follower = self._stages.pop(0)(world)
            twist = self._follower(world, held)
            if twist is not None:
                return twist
            self._follower = None
        return None

    def _object(self, world: World) -> FloatArray | None:
        """(3,) pose of the object; None if it has gone."""
        found = np.flatnonzero(world.movables.ids == self.push.label)
        return world.movables.poses[found[0]] if len(found) else None

    def _on_the_way(self, way: Legs | FloatArray, world: World) -> Follower:
        return partial(self._to_start, Transit(self._robot, way, self._config))

    def _to_start(self, transit: Transit, world: World, held: float) -> Twist | None:
        twist = transit.command(world, held)
        if twist is None and not transit.arrived:
            self.stuck = True
            self._stages.clear()
        return twist

    def _into_contact(self, world: World) -> Follower:
        there = self._object(world)
        here = world.robot_pose
        if there is None:
            self._stages.clear()
            return lambda world, held: None
        contact = ahead_of(
            self.push.contact.robot_at(there), _PRESS * self._robot.circumscribed_radius
        )
        return self._through(straight_poses(self._robot, here, contact))

    def _along_the_curve(self, world: World) -> Follower:
        there = self._object(world)
        if there is None or self._is_lost(world, there):
            return lambda world, held: None
        self._aside = self._offset(world, there)
        poses = self._from_here(world.robot_pose, there)
        if len(poses) < 2:  # it is there already
            return lambda world, held: None
        if self._config.mpc:
            return self._by_prediction(world, poses, there)
        return partial(self._while_in_contact, self._through(poses))

    def _while_in_contact(self, follow: Follower, world: World, held: float) -> Twist | None:
        there = self._object(world)
        lost = there is None or self._is_lost(world, there)
        return None if lost else follow(world, held)

    def _from_here(self, here: FloatArray, there: FloatArray) -> FloatArray:
        """(N, 3) poses of the push from where contact was made, with the object as it lies."""
        push = self.push
        step = _STEP * self._robot.circumscribed_radius
        turning = Turning(push.contact.radius, False, step)
        seen = compose(inverse(here), there)
        planned = push.contact.object_pose
        seen[2] = planned[2] + math.remainder(seen[2] - planned[2], math.tau)
        end = compose(self._goal, inverse(seen))
        if not push.final:
            end = compose(here, compose(inverse(push.poses[0]), push.poses[-1]))
        shortest = turning.length(push.poses[0], push.poses[-1])
        if push.length - shortest < 2.0 * step:  # else it leads around something
            if turning.length(here, end) <= _LONGER * push.length + 2.0 * step:
                return turning.poses(here, end)
        return np.vstack([here, push.poses[1:]])

    def _by_prediction(self, world: World, poses: FloatArray, there: FloatArray) -> Follower:
        """Push by `PushingMpc` along the poses that the object has on the way."""
        config = self._config
        poses[:, 2] = np.unwrap(poses[:, 2])
        seen = compose(inverse(poses[0]), there)
        step = compose(inverse(poses[-2]), poses[-1])
        beyond = [poses[-1]]  # else the controller would turn too little at the end
        for _ in range(_BEYOND):
            beyond.append(compose(beyond[-1], step))
        length = path_length(poses_of(poses, seen)[:, :2])
        poses = np.vstack([poses, beyond[1:]])
        path = poses_of(poses, seen)
        path[:, 2] = poses[:, 2]
        plan = PushPath(path).plan(self._robot, self.push.label)
        pusher = PushingMpc(
            PushingConfig(
                parameters=PushParameters(self._grip),
                period=config.response,
                heading=1.0,
            )
        )
        pusher.reset(world)
        progress = ProgressChecker(
            decrease_by(_PROGRESS * self._robot.circumscribed_radius), _PATIENCE
        )
        drive = partial(self._predict, pusher, plan, length, StallChecker(self._robot), progress)
        return partial(self._while_in_contact, drive)

    def _predict(
        self,
        pusher: PushingMpc,
        plan: Plan,
        length: float,
        stall: StallChecker,
        progress: ProgressChecker[float],
        world: World,
        held: float,
    ) -> Twist | None:
        """The next command of a push along a plan, ``length`` [m] of which are the object's way."""
        if stall.update(world.robot_pose, world.time):
            return None
        twist = pusher.command(world, plan)
        left = length - pusher.along
        if left < 1e-6 or not progress.update(left, world.time):
            return None
        braking = min(self._robot.max_acceleration, self._robot.max_speed / _BRAKING)
        slower = min(1.0, approach_speed(left, braking, held) / max(twist.linear, 1e-9))
        twist = Twist(slower * twist.linear, slower * twist.angular)
        stall.send(twist)
        return twist

    def _is_lost(self, world: World, there: FloatArray) -> bool:
        """True if an object at a pose (3,) is not before the bumper."""
        model = self.push.contact.model
        x, y, _ = compose(inverse(world.robot_pose), there).tolist()
        gap = x - model.reach
        wide = abs(y - self.push.contact.object_pose[1]) > _LOST_ASIDE * model.bumper.half
        return wide or bool(gap > _LOST_GAP * self._robot.circumscribed_radius)

    def _offset(self, world: World, there: FloatArray) -> float:
        """Of an object at a pose (3,), to the left of the robot's middle [m]."""
        return float(compose(inverse(world.robot_pose), there)[1])

    def _back(self, world: World) -> Follower:
        push = self.push
        there = self._object(world)
        if there is not None:
            self.slip = self._offset(world, there) - self._aside
        off = float(np.hypot(*(push.end - push.poses[-1])[:2]))
        here = world.robot_pose
        return self._through(straight_poses(self._robot, here, ahead_of(here, -off)))

    def _through(self, poses: FloatArray) -> Follower:
        poses[:, 2] = np.unwrap(poses[:, 2])
        return PoseFollower(self._robot, poses, self._config.response).drive


class Transit:
    """The drive along a way of `way_to`, without an object.

    Args:
        robot: its limits.
        way: `Legs`, of which only the last ends precisely, or (N, 3) poses.
        config: settings.

    Attributes:
        arrived: the robot is at its end.
    """

    def __init__(
        self, robot: RobotModel, way: Legs | FloatArray, config: RearrangementConfig
    ) -> None:
        size = robot.circumscribed_radius
        response = config.response
        self.arrived = False
        self._end: FloatArray
        self._near = _ARRIVED * size
        self._drivers: list[LegFollower | PoseFollower]
        if not isinstance(way, Legs):
            self._end = way[-1, :2]
            self._drivers = [PoseFollower(robot, way, response)]
            return
        self._end = way.points[-1]
        near = _PLACED * size + config.position_noise
        aligned = _ALIGNED + config.heading_noise
        last = Legs.ahead(way.points[-1:], way.heading)
        self._drivers = [LegFollower(robot, last, near=near, aligned=aligned, response=response)]
        if len(way.points) > 1:
            corners = Legs.ahead(way.points[:-1])
            near = max(_PASSED * size, near)
            driver = LegFollower(robot, corners, near=near, aligned=_ROUGHLY, response=response)
            self._drivers.insert(0, driver)

    def command(self, world: World, held: float) -> Twist | None:
        """The velocity to drive now; None when it is there, or does not get there."""
        while self._drivers:
            driver = self._drivers[0]
            twist = driver.command(world.robot_pose, world.time, held)
            if twist is not None:
                return twist
            if isinstance(driver, LegFollower) and not driver.arrived:
                return None
            self._drivers.pop(0)
        self.arrived = math.dist(world.robot_pose[:2], self._end) < self._near
        return None


def poses_of(poses: FloatArray, seen: FloatArray) -> FloatArray:
    """(N, 3) poses of an object that a robot at poses (N, 3) sees at a pose (3,)."""
    return np.array([compose(pose, seen) for pose in poses])


def straight_poses(robot: RobotModel, start: FloatArray, end: FloatArray) -> FloatArray:
    """(N, 3) poses between two (3,), the headings the shorter way."""
    end = np.append(end[:2], start[2] + math.remainder(end[2] - start[2], math.tau))
    step = _STEP * robot.circumscribed_radius
    count = max(2, math.ceil(math.dist(start[:2], end[:2]) / step))
    return np.linspace(start, end, count + 1)
