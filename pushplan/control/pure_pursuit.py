"""`PurePursuit`: steer at a point on the path a fixed distance ahead."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pushplan.control.limits import clamp_twist
from pushplan.control.staged_controller import StagedController
from pushplan.control.tracking import Progress
from pushplan.world import Drive, Plan, Twist, World
from pushplan.world.checks import number


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
