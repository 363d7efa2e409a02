"""`StagedController`: plans that turn on the spot or go back, for controllers that drive ahead."""

from __future__ import annotations

import functools
import math
from abc import ABC, abstractmethod
from dataclasses import replace

import numpy as np

from pushplan.control.episode_clock import EpisodeClock
from pushplan.control.limits import approach_speed, clamp_twist, ramp_twist
from pushplan.control.tracking import Progress
from pushplan.world import GoalPose, Plan, RobotModel, Stage, Twist, World
from pushplan.world.checks import expect

_WINDOW = 2.0  # of its progress [circumscribed radii]
_CUT = 0.02  # distance by which it may cut a corner [circumscribed radii]
_RESPONSE = 0.3  # time in which an omnidirectional robot drives off an error [s]


class StagedController(ABC):
    """Drives a plan stage by stage: turns by itself, the rest as its kind of controller does.

    Of a stage that goes back `_follow` sees the mirror image: a robot whose front is its rear, on a
    path that it drives ahead. Before a stage that another one follows is over, and before a pose
    that is the robot's goal, it slows down so that it comes to a stand there. Of a plan of one
    stage that is driven ahead it sees the plan as it is. An omnidirectional robot
    moves along its plan at the headings of the poses, whatever the kind of controller.
    """

    @abstractmethod
    def _follow(self, world: World, plan: Plan) -> Twist:
        """The velocity on a plan that is driven ahead."""

    @abstractmethod
    def _begin(self) -> None:
        """Forget what was learned on the way, before another stage."""

    def _hold_commands(self, period: float) -> None:
        """Begin with the first command held for a period [s]."""
        self._clock = EpisodeClock(period)
        self._forget_stage()

    def _forget_stage(self) -> None:
        self._whole: Plan | None = None
        self._part: Plan | None = None
        self._stage: Stage | None = None
        self._direction: int | None = None
        self._place: Progress | None = None

    def reset(self, world: World) -> None:
        """See `pushplan.world.Controller`."""
        expect("world", world, World)
        self._clock.reset()
        self._forget_stage()
        self._begin()

    def command(self, world: World, plan: Plan) -> Twist:
        """See `pushplan.world.Controller`; within the accelerations of the robot.

        Past the end of the plan the robot stops; a constant-speed robot drives on along the last
        heading.
        """
        expect("world", world, World)
        expect("plan", plan, Plan)
        return self._clock.command_for(world, lambda _: self._by_stages(world, plan))

    def _by_stages(self, world: World, plan: Plan) -> Twist:
        simple = len(plan.stages) == 1 and plan.stages[0].direction == 1
        if simple and not (isinstance(world.goal, GoalPose) or world.robot.slides):
            self._take_up(1)
            return self._follow(world, plan)
        robot = world.robot
        window = _WINDOW * robot.circumscribed_radius
        if self._place is None or self._place.window != window:
            self._place = Progress(window)
        self._place.update(plan, world.robot_pose)
        stage = self._place.stage
        if plan is not self._whole or stage != self._stage:
            self._take_up(stage.direction)
            self._whole = plan
            self._stage = stage
            self._part = None
        wanted = self._on_stage(world, plan, stage, self._place)
        last = self._clock.command
        held = self._clock.held
        return ramp_twist(robot, last, wanted.linear, wanted.angular, held, wanted.lateral)

    def _take_up(self, direction: int) -> None:
        """Begin anew where another direction begins."""
        if self._direction is not None and direction != self._direction:
            self._begin()
        self._direction = direction

    def _on_stage(self, world: World, plan: Plan, stage: Stage, progress: Progress) -> Twist:
        robot = world.robot
        held = self._clock.held
        if stage.direction == 0:
            side = math.copysign(1.0, float(plan.turn_rates[stage.first]))
            left = progress.left_to_turn
            return Twist(0.0, side * approach_speed(left, robot.max_turn_acceleration, held))
        if robot.slides:
            return _slide(world, plan, progress, held)
        if self._part is None:
            self._part = _part(plan, stage)
        if stage.direction < 0:
            twist = self._follow(_mirrored(world), self._part)
            wanted = Twist(-twist.linear, twist.angular)
        else:
            wanted = self._follow(world, self._part)
        if progress.is_last and not (world.robot.can_stop and isinstance(world.goal, GoalPose)):
            return wanted
        fastest = approach_speed(progress.left_of_stage, robot.max_acceleration, held)
        if abs(wanted.linear) <= fastest:
            return wanted
        slower = fastest / abs(wanted.linear)
        return Twist(slower * wanted.linear, slower * wanted.angular)


def _slide(world: World, plan: Plan, progress: Progress, held: float) -> Twist:
    """The velocity of an omnidirectional robot along a stage, at the headings of the plan.

    It is that of the plan and, for what is left of the error, back to the path.
    """
    left = progress.left_of_stage
    speed = float(plan.speeds[progress.index(progress.along)])
    speed = min(speed, approach_speed(left, world.robot.max_acceleration, held))
    place = progress.pose(progress.along)
    reach = min(speed * held, left)
    while _cuts(plan, progress, reach) > _CUT * world.robot.circumscribed_radius:
        reach *= 0.5
    aim = progress.pose(progress.along + reach)
    response = max(held, _RESPONSE)
    ahead = (aim - place) / held
    back = (place - world.robot_pose) / response
    vx, vy = ahead[:2] + back[:2]
    theta = float(world.robot_pose[2])
    turn = math.remainder(float(aim[2] - place[2]), math.tau) / held
    turn += math.remainder(float(place[2]) - theta, math.tau) / response
    most = world.robot.max_turn_rate
    turn = min(max(turn, -most), most)
    middle = theta + 0.5 * turn * held
    c = math.cos(middle)
    s = math.sin(middle)
    return clamp_twist(world.robot, vx * c + vy * s, turn, vy * c - vx * s)


def _cuts(plan: Plan, progress: Progress, reach: float) -> float:
    """Greatest distance [m] of a plan from the straight way to what is ``reach`` [m] ahead."""
    first = progress.index(progress.along) + 1
    last = progress.index(progress.along + reach) + 1
    start = progress.pose(progress.along)[:2]
    along = progress.pose(progress.along + reach)[:2] - start
    off = plan.poses[first:last, :2] - start
    across = np.abs(off[:, 0] * along[1] - off[:, 1] * along[0])
    return float(across.max(initial=0.0)) / max(math.hypot(*along), 1e-12)


def _part(plan: Plan, stage: Stage) -> Plan:
    """A stage that is driven, as a plan of its own that leads ahead."""
    part = slice(stage.first, stage.last + 1)
    poses = plan.poses[part]
    if stage.direction < 0:
        poses = poses + np.array([0.0, 0.0, np.pi])
    speeds = np.abs(plan.speeds[part])
    turn_rates = plan.turn_rates[part].copy()
    if len(speeds) > 1:  # what the last pose says belongs to the next stage
        speeds[-1] = speeds[-2]
        turn_rates[-1] = 0.0
    return Plan(
        times=plan.times[part] - plan.times[stage.first],
        poses=poses,
        speeds=speeds,
        turn_rates=turn_rates,
        travel_cost=0.0,
    )


def _mirrored(world: World) -> World:
    """The same scene with a robot whose front is its rear."""
    pose = world.robot_pose + np.array([0.0, 0.0, np.pi])
    return replace(world, robot=_turned_round(world.robot), robot_pose=pose)


@functools.lru_cache(maxsize=8)
def _turned_round(robot: RobotModel) -> RobotModel:
    return replace(
        robot,
        parts=tuple(-part for part in robot.parts),
        max_speed=-robot.min_speed,
        min_speed=-robot.max_speed,
    )
