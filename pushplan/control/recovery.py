"""Drives of a robot that is stuck (`Recovery`) or has no plan yet (`waiting_twist`)."""

from __future__ import annotations

import math

import numpy as np

from pushplan.control.limits import arc_twist, clamp_twist
from pushplan.control.progress_checker import ProgressChecker, StallChecker, decrease_by
from pushplan.core import control as core
from pushplan.core import geometry, motion
from pushplan.motion.collision import footprint, obstacles
from pushplan.motion.room_ahead import recovery_path
from pushplan.world import Drive, RobotModel, Twist, World
from pushplan.world.checks import FloatArray, array, expect, number

_STEP_PATIENCE = 3.0
"""Time that may pass without getting on, in times that a step takes at full speed."""
_PROGRESS = 0.01  # by which a robot that gets on comes nearer to a pose [circumscribed radii]
_REACHED = 0.3  # of a step may be left when the next one begins, so that it does not slow down


class PoseFollower:
    """Drives along poses that are a step of the path apart, ahead or back.

    Args:
        robot: its limits.
        poses: (N, 3) where to go.
        response: time in which an error is driven off [s].
    """

    def __init__(self, robot: RobotModel, poses: FloatArray, response: float) -> None:
        self._robot = expect("robot", robot, RobotModel)
        self._poses: FloatArray = array("poses", poses, (None, 3))
        self._response = response
        self._next = 1
        self._stall = StallChecker(robot)
        self._progress: ProgressChecker[float] | None = None

    def drive(self, world: World, held: float) -> Twist | None:
        """`command` for where and when the robot is in a world."""
        return self.command(world.robot_pose, world.time, held)

    def command(self, pose: FloatArray, time: float, held: float) -> Twist | None:
        """The velocity to drive now; None when it is there, or does not get there.

        Args:
            pose: (3,) of the robot.
            time: [s].
            held: for how long the command will be held [s].
        """
        robot = self._robot
        size = self._robot.circumscribed_radius
        if self._stall.update(pose, time):
            return None
        seconds = max(held, self._response)
        while self._next < len(self._poses):
            before = self._poses[self._next - 1]
            target = self._poses[self._next]
            c = math.cos(float(pose[2]))
            s = math.sin(float(pose[2]))
            dx, dy = (float(value) for value in target[:2] - pose[:2])
            ahead = c * dx + s * dy
            aside = c * dy - s * dx
            turn = math.remainder(float(target[2] - pose[2]), math.tau)
            moves = float(c * (target[0] - before[0]) + s * (target[1] - before[1]))
            turns = abs(float(target[2] - before[2]))
            off = size * abs(turn)
            if moves:
                off = ahead * math.copysign(1.0, moves)
            if self._progress is None:
                lasts = abs(moves) / robot.max_speed + turns / robot.max_turn_rate
                patience = _STEP_PATIENCE * max(lasts, 2.0 * seconds)
                self._progress = ProgressChecker(decrease_by(_PROGRESS * size), patience)
            reached = off < _REACHED * (abs(moves) + size * turns)
            if reached or not self._progress.update(off, time):
                self._next += 1
                self._progress = None
                continue
            if moves:
                turn += (aside / size) * math.copysign(1.0, ahead)
            command = arc_twist(robot, ahead, turn, seconds)
            self._stall.send(command)
            return command
        return None


_WAYS = ((-1.0, 0.0), (-0.5, 1.0), (-0.5, -1.0), (1.0, 0.0), (0.5, 1.0), (0.5, -1.0))
"""Speed and turn rate, as fractions of the greatest, that are tried in turn."""
_PATIENCE = 0.5  # time after which another way is tried where something stops the robot [s]
_TURNED = 1.0  # a turn by more is as good as the distance [rad]
_FREED = 0.03  # a way that has moved the robot by less has not freed it [circumscribed radii]
# distance ahead in which walls are looked for [circumscribed radii], and how often
_LOOK = 0.3
_POSES = 3
_DEEPER = 1e-3  # by how much the robot may get deeper into a wall [circumscribed radii]
_AHEAD = (1.0, 0.5, 0.25, 0.0)
"""Distances straight ahead at which circles are tried [circumscribed radii]."""
_TURNS = (0.0, 0.5, -0.5, 1.0, -1.0)
"""Turn rates of the arcs tried where no circle fits, as fractions of the greatest; first wins."""
_SPACING = 0.15  # distance between the poses that are looked at [circumscribed radii]


class Recovery:
    """Drives straight back, or whichever way is free; where none is, along a searched path.

    It ends when the robot has got away, and when nothing is left to try; each part of it ends where
    something stops the robot. The path is that of `recovery_path`; a car has the ways alone.

    Args:
        world: where the robot is stuck; a differential drive, or a car that reverses.
        distance: to get away by [m]; a turn by 1 rad is as good.
        skip: how many ways to leave to the end, because they have not helped before.
        response: time in which an error from the path is driven off [s].
        looks: leave out ways into what is static; else a way is tried until something stops the
            robot. Objects are never looked at: backing away from them frees a jam.
        searches: search a path where no way is left.
    """

    def __init__(
        self,
        world: World,
        distance: float,
        *,
        skip: int = 0,
        response: float = 0.2,
        looks: bool = True,
        searches: bool = True,
    ) -> None:
        robot = expect("world", world, World).robot
        self._distance = number("distance", distance)
        self._response = response
        self._looks = looks
        self._searches = searches and robot.drive is Drive.DIFFERENTIAL  # it turns on the spot
        self._from = self._tried_from = world.robot_pose
        shape = footprint(robot)
        self._radius = shape.radius
        self._bounds = world.static.bounds
        self._walls = motion.CollisionChecker(shape, obstacles(world.static))
        skip %= len(_WAYS)
        commands = (
            clamp_twist(robot, speed * robot.max_speed, turn * robot.max_turn_rate)
            for speed, turn in (*_WAYS[skip:], *_WAYS[:skip])
        )
        self._ways = [way for way in commands if way.linear or way.angular]
        self._stall = StallChecker(robot, _PATIENCE)
        self._path: PoseFollower | None = None

    def command(self, world: World, held: float) -> Twist | None:
        """The velocity to drive now; None when it is over.

        Args:
            world: the scene now.
            held: for how long the command will be held [s].
        """
        pose = world.robot_pose
        if self._path is None:
            if self._has_got_away(pose):
                self._ways = []
                self._searches = False
            way = self._way(world)
            if way is not None:
                return way
            path = recovery_path(world, 0.0) if self._searches else None
            self._searches = False
            if path is None:
                return None
            self._path = PoseFollower(world.robot, path, self._response)
        return self._path.command(pose, world.time, held)

    def _has_got_away(self, pose: FloatArray) -> bool:
        turned = abs(math.remainder(float(pose[2] - self._from[2]), math.tau))
        return math.dist(pose[:2], self._from[:2]) >= self._distance or turned > _TURNED

    def _way(self, world: World) -> Twist | None:
        """The first way that nothing is known to be in."""
        pose = world.robot_pose
        stopped = bool(self._ways) and self._stall.update(pose, world.time)
        while self._ways and (stopped or (self._looks and self._is_closed(pose, self._ways[0]))):
            self._give_up_way(world)
            self._stall.reset()
            self._stall.update(pose, world.time)
            stopped = False
        if not self._ways:
            return None
        self._stall.send(self._ways[0])
        return self._ways[0]

    def _give_up_way(self, world: World) -> None:
        """Take the next way; straight back once more if the last one has freed the robot."""
        robot = world.robot
        pose = world.robot_pose
        tried = self._ways.pop(0)
        freed = math.dist(pose[:2], self._tried_from[:2]) > _FREED * robot.circumscribed_radius
        if freed and self._ways:
            back = clamp_twist(robot, -robot.max_speed, 0.0)
            if back.linear and tried != back:
                self._ways.insert(0, back)
        self._tried_from = pose

    def _is_closed(self, pose: FloatArray, way: Twist) -> bool:
        """Return True if a motion leads deeper into static obstacles than the robot is."""
        size = self._radius
        here = np.array(pose)
        x_min, y_min, x_max, y_max = self._bounds
        seconds = _LOOK * size / (abs(way.linear) + size * abs(way.angular))
        allowed = self._walls.depth(here) + _DEEPER * size
        for part in np.linspace(0.0, seconds, _POSES + 1)[1:]:
            there = np.array(geometry.arc_step(here, way.linear * part, way.angular * part))
            inside = x_min <= there[0] <= x_max and y_min <= there[1] <= y_max
            if not inside or self._walls.depth(there) > allowed:
                return True
        return False


def waiting_twist(world: World) -> Twist:
    """Stand still; a robot that cannot drives where it can go on for longest.

    It goes straight as long as there is room a little ahead for the tightest circle that it can
    drive, and then drives that. Where no circle fits it takes the arc that stays clear of what is
    static for longest.

    Args:
        world: the scene now.
    """
    robot = expect("world", world, World).robot
    if robot.can_stop:
        return Twist(0.0, 0.0)
    shape = footprint(robot)
    walls = obstacles(world.static)
    circle = math.tau * robot.turning_radius
    step = min(_SPACING * shape.radius, circle / 16.0)

    def clear(twist: Twist, length: float, ahead: float = 0.0) -> float:
        """Return the clear length of an arc, up to ``length``, that begins straight ahead."""
        turn = step * twist.angular / twist.linear
        first = math.ceil(ahead / step)
        most = math.ceil((ahead + length) / step)
        at = world.robot_pose
        return step * core.clear_steps(step, turn, first, most, shape, walls, at) - ahead

    arcs = [clamp_twist(robot, robot.max_speed, share * robot.max_turn_rate) for share in _TURNS]
    for ahead in _AHEAD:
        for arc in arcs[-2:]:
            if clear(arc, circle, ahead * shape.radius) >= circle:
                return arcs[0] if ahead else arc
    return max(arcs, key=lambda arc: clear(arc, circle + shape.radius))
