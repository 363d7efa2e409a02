"""`ObstacleGuard`: the robot stops before what is static or fixed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import shapely

from pushplan.control import waiting_twist
from pushplan.control.limits import ramp_twist
from pushplan.control.stopping import add_arc, stopping_path
from pushplan.core import motion as core
from pushplan.motion.collision import footprint, obstacles
from pushplan.runtime.noise_allowance import NoiseAllowance
from pushplan.world import Plan, StaticMap, Twist, World
from pushplan.world.checks import FloatArray
from pushplan.world.outline import flatten, outline_boxes

_CLEARANCE = 0.02  # kept from what is new, beside the noise [circumscribed radii]
_BETWEEN = 0.003  # by which the robot may come nearer between two poses of a path [radii]
_RESUMED = 1.5  # times the clearance where the robot has stood, so that noise moves it nowhere
_DEEPER = 1e-6  # by how much the robot may get nearer to what it is too near to [radii]
_SLOWER = (1.0, 0.75, 0.5, 0.25, 0.1)
"""Fractions of the wanted velocity that are tried in turn; then the robot brakes."""
_HELD = 2.0  # for how long each command may be driven before the next one comes [periods]
_TURNING_STEPS = 25  # in which a turn begins at most
_FINE = 0.25  # distance between poses of circles, in that of other paths
_MOVED = 4.0  # distance from its place at which something fixed may be seen [clearances]
_ANYWHERE = StaticMap.build(bounds=(-1e9, -1e9, 1e9, 1e9))


class ObstacleGuard:
    """Looks at each command: the robot has to be able to stop before what is static or fixed.

    From what is new, which was not so in each world since the start, the robot keeps a clearance.
    What was known at the start it may pass as closely as its plan does, which was made for it. A
    robot that is too near already may drive wherever it comes no nearer. One that cannot stop has
    to be able to drive a circle, or what its plan does next, from where it is; what was known at
    the start is left to its policy, since no circle fits between walls.

    Args:
        allowance: noise of the poses.
        period: time between two commands [s].
    """

    def __init__(self, allowance: NoiseAllowance, period: float) -> None:
        self._allowance = allowance
        self._period = period

    def reset(self, world: World) -> None:
        """Take all that a world holds as known."""
        self._static: StaticMap | None = None
        self._known = {part.tobytes() for part in world.static.convex_parts}
        self._known_fixed = _fixed(world)
        self._stands = False
        self._side = 0  # side with room for a robot that cannot stop: 1 left, -1 right, 0 unknown
        self.observe(world)

    def observe(self, world: World) -> World:
        """Take a snapshot.

        Returns:
            It, with a margin that keeps plans at twice the clearance from what is new.
        """
        if world.static is not self._static:
            self._static = world.static
            keys = [part.tobytes() for part in world.static.convex_parts]
            self._known &= set(keys)
            self._is_new = np.array([key not in self._known for key in keys], dtype=np.bool_)
        clearance = self._clearance(world)
        fixed = _fixed(world)
        self._known_fixed = {
            label: pose
            for label, pose in self._known_fixed.items()
            if label in fixed and math.dist(pose[:2], fixed[label][:2]) <= _MOVED * clearance
        }
        self._new_fixed = fixed.keys() - self._known_fixed.keys()
        if not self._is_new.any() and not self._new_fixed:
            return world
        return replace(world, margin=max(world.margin, 2.0 * clearance))

    def limited(
        self, world: World, before: Twist, wanted: Twist, held: float, plan: Plan | None = None
    ) -> tuple[Twist, str]:
        """The velocity to command, and why it is not the wanted one; empty where it is.

        Args:
            world: the scene when the command takes effect.
            before: the velocity that is driven then.
            wanted: what the policy asks for.
            held: time since the last command [s].
            plan: of the policy, if it shows one.
        """
        robot = world.robot
        twist = ramp_twist(robot, before, wanted.linear, wanted.angular, held, wanted.lateral)
        new, known = self._near(world, before, twist)
        if not new and not known:
            self._stands = False
            self._side = 0
            return twist, ""
        grown = self._clearance(world) * (_RESUMED if self._stands else 1.0)
        least = _BETWEEN * robot.circumscribed_radius
        closeness = [
            _Closeness(footprint(robot, margin), world.robot_pose, outlines)
            for margin, outlines in ((grown, new), (least, known))
            if outlines
        ]
        for fraction in _SLOWER if robot.can_stop else (1.0,):
            slower = ramp_twist(
                robot,
                before,
                fraction * wanted.linear,
                fraction * wanted.angular,
                held,
                fraction * wanted.lateral,
            )
            for side, path in self._paths(world, slower, plan):
                if all(one.allows(path) for one in closeness):
                    self._stands = False
                    self._side = side
                    if fraction == 1.0:
                        return slower, ""
                    return slower, _reason(world, new, known, "slows down")
        rest = waiting_twist(world.with_fixed_as_static())
        turn = self._side * robot.max_turn_rate or rest.angular
        self._stands = robot.can_stop
        reason = _reason(world, new, known, "stops" if robot.can_stop else "turns away")
        return ramp_twist(robot, before, rest.linear, turn, held), reason

    def _paths(self, world: World, twist: Twist, plan: Plan | None) -> list[tuple[int, FloatArray]]:
        """Return the paths (N, 3) of a command, each with the side on which it turns.

        One to a stand, or, where the robot cannot stop, around the circle of either side, and one
        that goes on as the plan does, if that is long enough.
        """
        robot = world.robot
        held = _HELD * self._period
        if robot.can_stop:
            return [(0, stopping_path(robot, world.robot_pose, twist, held, self._period))]
        paths = [(side, self._circle(world, twist, side)) for side in (1, -1)]
        if plan is not None:
            planned = self._planned(world, twist, plan)
            if planned is not None:
                paths.append((0, planned))
        return paths

    def _planned(self, world: World, twist: Twist, plan: Plan) -> FloatArray | None:
        """(N, 3) poses of a command, and of what the plan does next.

        None if it ends before the length of a circle, and not at the goal.
        """
        fine = _FINE * world.robot.circumscribed_radius
        poses = [np.array(world.robot_pose)]
        held = _HELD * self._period
        add_arc(poses, twist.linear * held, twist.angular * held, fine)
        offsets = plan.poses[:, :2] - poses[-1][:2]
        left = math.tau * world.robot.turning_radius
        for k in range(int(np.hypot(*offsets.T).argmin()), len(plan.times) - 1):
            span = float(plan.times[k + 1] - plan.times[k])
            step = float(plan.speeds[k]) * span
            add_arc(poses, step, float(plan.turn_rates[k]) * span, fine)
            left -= abs(step)
            if left <= 0.0:
                break
        else:
            if not world.moved(robot_pose=plan.poses[-1]).goal_reached:
                return None
        return np.array(poses)

    def _circle(self, world: World, twist: Twist, side: int) -> FloatArray:
        """(N, 3) poses of a command, and of the tightest circle to the left (1) or right (-1)."""
        robot = world.robot
        held = _HELD * self._period
        rate = side * world.robot.max_turn_rate
        step = max(self._period, abs(rate) / robot.max_turn_acceleration / _TURNING_STEPS)
        fine = _FINE * robot.circumscribed_radius
        poses = [np.array(world.robot_pose)]
        while twist.angular != rate:
            add_arc(poses, twist.linear * held, twist.angular * held, fine)
            held = step
            twist = ramp_twist(robot, twist, robot.max_speed, rate, held)
        add_arc(poses, robot.turning_radius * math.tau, side * math.tau, fine)
        return np.array(poses)

    def _near(
        self, world: World, before: Twist, twist: Twist
    ) -> tuple[list[FloatArray], list[FloatArray]]:
        """Outlines within reach of what is new, and of what was known at the start."""
        robot = world.robot
        objects = world.movables
        outlines = list(world.static.convex_parts)
        is_new = self._is_new.tolist()
        boxes = world.static.boxes
        for k in np.flatnonzero(objects.fixed).tolist():
            parts = objects.parts_world(k)
            outlines += parts
            is_new += [int(objects.ids[k]) in self._new_fixed] * len(parts)
            boxes = np.concatenate([boxes, outline_boxes(*flatten(parts))])
        speed = max(abs(before.course[0]), abs(twist.course[0]))
        reach = robot.circumscribed_radius + 2.0 * _RESUMED * self._clearance(world)
        reach += speed * (_HELD * self._period + speed / robot.max_acceleration)
        if not robot.can_stop:
            reach += math.tau * robot.turning_radius
        place = world.robot_pose[:2]
        near = (boxes[:, 2:] >= place - reach) & (boxes[:, :2] <= place + reach)
        found = np.flatnonzero(near.all(axis=1)).tolist()
        new = [outlines[k] for k in found if is_new[k]]
        known = [outlines[k] for k in found if not is_new[k] and robot.can_stop]
        return new, known

    def _clearance(self, world: World) -> float:
        reach = world.robot.circumscribed_radius
        return self._allowance.noise_margin(world.robot) + _CLEARANCE * reach


class _Closeness:
    """Tells whether a path comes nearer to something than it should, or than the robot is.

    Args:
        shape: the footprint, grown by the clearance.
        pose: (3,) where the robot is.
        outlines: what is near.
    """

    def __init__(self, shape: core.Footprint, pose: FloatArray, outlines: list[FloatArray]) -> None:
        self._too_near: list[tuple[core.CollisionChecker, float]] = []
        self._clear = core.CollisionChecker(shape, obstacles(_ANYWHERE, tuple(outlines)))
        if self._clear.is_free(pose):
            return
        clear = []
        for outline in outlines:
            one = core.CollisionChecker(shape, obstacles(_ANYWHERE, (outline,)))
            depth = one.depth(pose)
            if depth > 0.0:
                self._too_near.append((one, depth + _DEEPER * shape.radius))
            else:
                clear.append(outline)
        self._clear = core.CollisionChecker(shape, obstacles(_ANYWHERE, tuple(clear)))

    def allows(self, path: FloatArray) -> bool:
        """Tell whether a path (N, 3) may be driven."""
        if self._clear.first_blocked(path) < len(path):
            return False
        return all(one.depth(pose) <= depth for one, depth in self._too_near for pose in path)


def _fixed(world: World) -> dict[int, FloatArray]:
    """Poses (3,) of the objects that are held not to move, by their ids."""
    objects = world.movables
    held = np.flatnonzero(objects.fixed)
    return dict(zip(objects.ids[held].tolist(), objects.poses[held], strict=True))


def _reason(world: World, new: list[FloatArray], known: list[FloatArray], what: str) -> str:
    """The robot does something because of the nearest outline."""
    at = shapely.Point(world.robot_pose[:2])
    near = [*new, *known]
    away = shapely.distance(shapely.polygons([shapely.linearrings(part) for part in near]), at)
    k = int(np.argmin(away))
    x, y = near[k].mean(axis=0)
    kind = "new" if k < len(new) else "static"
    return f"the robot {what} because something {kind} is in its way, at ({x:.2f}, {y:.2f})"
