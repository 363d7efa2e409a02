"""Sampling-based predictive control, decision after decision: `MppiPolicy`, `mppi`, `cem`."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np

from pushplan.control import EpisodeClock, ImmediateExecutor, waiting_twist
from pushplan.control.limits import driven_twist, ramp_twist
from pushplan.geometry import Path
from pushplan.interaction import InteractionModel
from pushplan.planners.arguments import check_pusher
from pushplan.planners.mppi.approach_grid import (
    CLEARANCE,
    Approach,
    approach_to,
    object_ways,
    place_behind,
)
from pushplan.planners.mppi.costs import RolloutCost, manipulation_costs, navigation_costs
from pushplan.planners.mppi.mppi import Decision, Mppi
from pushplan.planners.mppi.mppi_config import MppiConfig
from pushplan.planners.mppi.rollout_model import SPEED, TURN, ControlSequence, step_length
from pushplan.world import (
    GoalDisc,
    GoalLine,
    PendingResult,
    Plan,
    PlanningExecutor,
    PlanResult,
    Stop,
    Twist,
    World,
)
from pushplan.world.checks import FloatArray

_PERIOD = 0.1  # for which the first command is taken to be held [s]
_LOGGED = 10_000  # decisions that are kept
_GAIN = 0.25  # by how much the way has to get shorter to count as progress [R]
_PUSHED = 3.0  # weight of a metre of the object, relative to one of the robot


class MppiPolicy:
    """Decides every few steps, and drives the newest controls in between.

    With an executor that takes time (`plan_with`) it decides beside driving: controls are known
    for times, so those for the time that a decision has taken are left out.

    Args:
        planner: makes the decisions.
        stop: stop rule of each decision; `MppiConfig.iterations` alone if None.
    """

    actions = ("velocity", "turn_rate")

    def __init__(self, planner: Mppi | None = None, stop: Stop | None = None) -> None:
        self.planner = planner or Mppi()
        self.stop = stop
        self._forget(np.random.default_rng(0))

    def _forget(self, rng: np.random.Generator) -> None:
        self.plan_log: deque[PlanResult] = deque(maxlen=_LOGGED)
        """The newest decisions since the last reset."""
        self.current_plan: Plan | None = None
        self.plan_with(ImmediateExecutor())
        self._rng = rng
        self._clock = EpisodeClock(_PERIOD)
        self._controls: ControlSequence | None = None
        self._pending: PendingResult[Decision] | None = None
        self._decided_at = -math.inf
        self._targets = TargetChoice(self.config)
        self._started = False

    @property
    def config(self) -> MppiConfig:
        """Settings."""
        return self.planner.config

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Forget the last episode; decisions are made at once until `plan_with` says otherwise."""
        if self._pending is not None:
            self._pending.abandon()
        self._forget(rng)
        self._clock.command = driven_twist(world)
        self._started = True

    def plan_with(self, executor: PlanningExecutor) -> None:
        """See `pushplan.world.PlansBesideDriving`."""
        self._executor: PlanningExecutor = executor

    def act(self, world: World, observation: Any = None) -> Twist:
        """The velocity for this step.

        Raises:
            InvalidInputError: if objects have a goal and the drive is not differential.
        """
        if not isinstance(world.goal, GoalDisc | GoalLine):
            check_pusher(world)
        if not self._started:
            self.reset(world, self._rng)
        return self._clock.command_for(world, self._act)

    def _act(self, world: World) -> Twist:
        last = self._clock.command
        held = self._clock.held
        wanted = self._wanted(world, held)
        return ramp_twist(world.robot, last, wanted.linear, wanted.angular, held)

    def _wanted(self, world: World, held: float) -> Twist:
        """The newest controls at the middle of the next step."""
        if world.goal_reached:
            return waiting_twist(world)
        self._receive(world)
        due = self._decided_at + self.config.period * step_length(world, self.config)
        if self._pending is None and world.time >= due - 1e-9:
            self._ask(world)
            self._receive(world)
        if self._controls is None:
            return waiting_twist(world)
        controls = self._controls.at(np.array([world.time + 0.5 * held]))[0]
        robot = world.robot
        return Twist(controls[SPEED] * robot.max_speed, controls[TURN] * robot.max_turn_rate)

    def _ask(self, world: World) -> None:
        """Have a decision made."""
        planner = self.planner
        rng = self._rng
        nominal = self._controls
        targets = self._targets

        def decide(stop: Stop | None) -> Decision:
            costs = _costs(world, planner.config, targets)
            return planner.decide(world, costs, nominal, stop=stop, rng=rng)

        self._decided_at = world.time
        self._pending = self._executor.submit(decide, world.time, self.stop)

    def _receive(self, world: World) -> None:
        """Take up a decision that is there."""
        if self._pending is None or not self._pending.ready(world.time):
            return
        pending = self._pending
        self._pending = None
        decision = pending.result()
        self._controls = decision.controls
        self.plan_log.append(decision.result)
        self.current_plan = decision.result.plan


def _costs(world: World, config: MppiConfig, targets: TargetChoice) -> list[RolloutCost]:
    """Return the terms of the task that a decision minimises."""
    if isinstance(world.goal, GoalDisc | GoalLine):
        return navigation_costs(world, config)
    return manipulation_costs(world, config, targets.approach(world))


def mppi(
    config: MppiConfig | None = None,
    interaction: InteractionModel | None = None,
    stop: Stop | None = None,
    costs: Sequence[RolloutCost] = (),
) -> MppiPolicy:
    """Model predictive path integral control: samples weighted by exp(-cost / temperature)."""
    return MppiPolicy(Mppi(config or MppiConfig(), interaction, costs), stop)


def cem(
    config: MppiConfig | None = None,
    interaction: InteractionModel | None = None,
    stop: Stop | None = None,
    costs: Sequence[RolloutCost] = (),
) -> MppiPolicy:
    """The cross-entropy method: mean and spread of the best samples, over three iterations."""
    return mppi(
        config or MppiConfig(update="cem", samples=64, iterations=3), interaction, stop, costs
    )


class TargetChoice:
    """Keeps to one object until it is done, or until nothing is gained any more.

    The next one is the nearest that can be got behind, of those that were given up least often.

    Args:
        config: settings.
    """

    def __init__(self, config: MppiConfig) -> None:
        self.config = config
        self._target = -1
        self._failures: dict[int, int] = {}
        self._best = math.inf
        self._since = 0.0

    def approach(self, world: World) -> Approach | None:
        """The way to behind the object that is to be pushed now; None if there is none."""
        movables = world.movables
        completed = world.completed
        ids = movables.ids.tolist()
        left = [k for k in range(len(ids)) if not completed[k]]
        if not left:
            return None
        if self._target in ids and ids.index(self._target) in left:
            k = ids.index(self._target)
            place = self._behind(world, k)
            if place is not None and self._gets_on(world, k, place):
                return approach_to(world, self.config, k, place)
            self._failures[self._target] = self._failures.get(self._target, 0) + 1
        found = {k: place for k in left if (place := self._behind(world, k)) is not None}
        if not found:
            return None
        k = min(
            found, key=lambda k: (self._failures.get(ids[k], 0), _way(world, k, found[k]), ids[k])
        )
        self._target = ids[k]
        self._best = math.inf
        self._since = world.time
        return approach_to(world, self.config, k, found[k])

    def _behind(self, world: World, k: int) -> FloatArray | None:
        """(3,) pose behind an object on its way to the goal; None if there is no way."""
        movables = world.movables
        robot = world.robot
        points = _way_of_object(world, k).points
        steps = np.hypot(*(points - points[:1]).T)
        ahead = np.flatnonzero(steps > 0.02 * robot.circumscribed_radius)
        if not len(ahead):
            return None
        dx, dy = points[ahead[0]] - points[0]
        failed = self._failures.get(int(movables.ids[k]), 0)
        return place_behind(world, k, math.atan2(dy, dx), failed)

    def _gets_on(self, world: World, k: int, place: FloatArray) -> bool:
        """Return True if the paths to the object and of the object have become shorter lately."""
        robot = world.robot
        size = robot.circumscribed_radius
        now = _way(world, k, place) + _PUSHED * _way_of_object(world, k).length
        if now < self._best - _GAIN * size:
            self._best = now
            self._since = world.time
        return world.time - self._since < self.config.patience * size / robot.max_speed


def _way_of_object(world: World, k: int) -> Path:
    """The way of an object to where it is done."""
    radius = float(world.movables.radii[k])
    ways = object_ways(world.static, world.area_goal, radius, CLEARANCE * radius)
    return ways.path_from(world.movables.poses[k, :2])


def _way(world: World, k: int, place: FloatArray) -> float:
    """About how far the robot drives to a pose behind an object, around it [m]."""
    x, y, _ = world.robot_pose.tolist()
    way = math.hypot(x - place[0], y - place[1])
    ox, oy = world.movables.poses[k, :2].tolist()
    in_front = (x - ox) * math.cos(place[2]) + (y - oy) * math.sin(place[2])
    around = math.hypot(place[0] - ox, place[1] - oy)
    return way + (around if in_front > 0.0 else 0.0)
