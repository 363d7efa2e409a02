"""`PathFollower` drives a smooth plan exactly, `PurePursuit` one with corners."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pushplan.control.limits import TwistLimiter, approach_speed, clamp_twist, driven_twist
from pushplan.control.staged_controller import StagedController
from pushplan.control.tracking import Progress
from pushplan.world import Drive, Plan, RobotModel, Twist, World
from pushplan.world.checks import number

_LEAST_SCALE = 0.2
"""Bound of 1 - κ d, which is 0 in the middle of the path's own arc."""
_MOST_ASKED = 0.6
"""Sine of the angle to the path, at most, that an offset asks for."""


@dataclass
class PathFollower(StagedController):
    """The plan's own curvature, plus feedback on offset and heading.

    With offset d (left of the path positive), heading error ψ and path curvature κ the command is
    ω = v (κ cos ψ / (1 - κ d) - d / l² - 2 sin ψ / l): a critically damped return to the path over
    the distance l (the chained-form path follower of Samson, 1995, linearised). The curvature is
    taken half a control period ahead, since a command is held for one. The feedback turns no
    faster than the robot can stop turning by the time that the error is gone, so that limits of
    its turn acceleration bring no oscillation. Ruckig keeps speed and turn rate within the limits.

    Args:
        distance: l, in units of the robot's circumscribed radius.
        period: time for which the first command is held [s]; later ones are held for as long as
            the clock of the world shows.
    """

    distance: float = 0.8
    period: float = 0.1

    def __post_init__(self) -> None:
        number("distance", self.distance, low=0.0, open_low=True)
        self._hold_commands(self.period)
        self._limiter: TwistLimiter | None = None

    def _begin(self) -> None:
        self._limiter = None

    def _follow(self, world: World, plan: Plan) -> Twist:
        robot = world.robot
        size = robot.circumscribed_radius
        progress = self._prepare(world)
        x, y, theta = (float(value) for value in world.robot_pose)
        along = progress.update(plan, world.robot_pose)
        path_x, path_y, path_theta = (float(value) for value in progress.pose(along))
        index = progress.index(along)
        speed = float(plan.speeds[index])
        over = along >= progress.total - 1e-9
        if over and robot.can_stop:
            return self._limit(Twist(0.0, 0.0))
        ahead = progress.index(min(along + 0.5 * self._clock.held * speed, progress.total))
        curvature = 0.0
        if not over:
            curvature = float(plan.turn_rates[ahead]) / max(plan.speeds[ahead], 1e-9)
        offset = math.cos(path_theta) * (y - path_y) - math.sin(path_theta) * (x - path_x)
        error = (theta - path_theta + math.pi) % (2.0 * math.pi) - math.pi
        length = self.distance * size
        own = curvature * math.cos(error) / max(1.0 - curvature * offset, _LEAST_SCALE)
        # a large offset asks for a heading across the path, not for ever sharper turns
        asked = max(min(0.5 * offset / length, _MOST_ASKED), -_MOST_ASKED)
        left = math.sin(error) + asked
        wanted = own - 2.0 * left / length
        if abs(error) > math.pi / 2:
            left = error
            wanted = -math.copysign(math.inf, error)
        if robot.drive is Drive.DIFFERENTIAL:
            if abs(error) > math.pi / 4:
                turn = self._approach(robot, abs(error))
                return self._limit(clamp_twist(robot, 0.0, math.copysign(turn, -error)))
        elif robot.drive is Drive.CAR:
            sharpest = 1.0 / robot.min_turning_radius
            wanted = max(min(wanted, sharpest), -sharpest)
        if robot.can_stop:
            speed = min(speed, robot.max_turn_rate / max(abs(wanted), 1e-9))
        turn = max(min(speed * wanted, robot.max_turn_rate), -robot.max_turn_rate)
        back = turn - speed * own
        most = self._approach(robot, abs(left))
        return self._limit(Twist(speed, speed * own + max(min(back, most), -most)))

    def _approach(self, robot: RobotModel, left: float) -> float:
        """The turn rate from which the robot can stop turning within an angle."""
        return approach_speed(left, robot.max_turn_acceleration, self._clock.held)

    def _prepare(self, world: World) -> Progress:
        """Start afresh in a new episode, or where the robot is another one."""
        robot = world.robot
        if self._limiter is None or self._limiter.robot != robot:
            self._progress = Progress(window=2.0 * robot.circumscribed_radius)
            self._limiter = TwistLimiter(robot)
            driven = driven_twist(world)
            self._limiter.reset(driven.linear, driven.angular)
        return self._progress

    def _limit(self, wanted: Twist) -> Twist:
        assert self._limiter is not None
        return self._limiter.step(wanted, self._clock.held)


@dataclass
class PurePursuit(StagedController):
    """Pure pursuit (Coulter, CMU-RI-TR-92-01): the arc through a point ahead on the path.

    Good for paths with corners, which it rounds; it cuts curves by about l² κ / 8. Where a plan is
    smooth and its turn rates matter, use `PathFollower`.

    Args:
        lookahead: l, in units of the robot's circumscribed radius.
    """

    lookahead: float = 1.0

    def __post_init__(self) -> None:
        number("lookahead", self.lookahead, low=0.0, open_low=True)
        self._hold_commands(1.0)
        self._progress: Progress | None = None

    def _begin(self) -> None:
        self._progress = None

    def _follow(self, world: World, plan: Plan) -> Twist:
        robot = world.robot
        reach = self.lookahead * robot.circumscribed_radius
        progress = self._progress = self._progress or Progress(window=2.0 * reach)
        x, y, theta = (float(value) for value in world.robot_pose)
        along = progress.update(plan, world.robot_pose)
        if robot.can_stop and along >= progress.total - 1e-9:
            return clamp_twist(robot, 0.0, 0.0)
        aim = progress.pose(min(along + reach, progress.total))
        dx = float(aim[0]) - x
        dy = float(aim[1]) - y
        overrun = along + reach - progress.total
        if overrun > 0.0:  # continue the last heading beyond the end
            dx += overrun * math.cos(aim[2])
            dy += overrun * math.sin(aim[2])
        bearing = (math.atan2(dy, dx) - theta + math.pi) % (2.0 * math.pi) - math.pi
        speed = float(plan.speeds[progress.index(along)])
        if robot.drive is Drive.DIFFERENTIAL and abs(bearing) > math.pi / 4:
            return clamp_twist(robot, 0.0, math.copysign(robot.max_turn_rate, bearing))
        curvature = 2.0 * math.sin(bearing) / max(math.hypot(dx, dy), 1e-9)
        if robot.drive is Drive.CAR:
            sharpest = 1.0 / robot.min_turning_radius
            curvature = max(min(curvature, sharpest), -sharpest)
        if robot.can_stop and abs(curvature) * speed > robot.max_turn_rate:
            speed = robot.max_turn_rate / abs(curvature)
        if abs(bearing) > math.pi / 2:  # the point is behind: turn as fast as possible
            return clamp_twist(robot, speed, math.copysign(robot.max_turn_rate, bearing))
        return clamp_twist(robot, speed, speed * curvature)
