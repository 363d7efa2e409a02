"""`MppiPolicy`: sampling-based predictive control, decision after decision."""

from __future__ import annotations

import math
from collections import deque
from typing import Any

import numpy as np

from pushplan.control import EpisodeClock, ImmediateExecutor, waiting_twist
from pushplan.control.limits import driven_twist, ramp_twist
from pushplan.planners.arguments import check_pusher
from pushplan.planners.mppi.control_sequence import SPEED, TURN, ControlSequence
from pushplan.planners.mppi.costs import RolloutCost, manipulation_costs, navigation_costs
from pushplan.planners.mppi.mppi import Decision, Mppi
from pushplan.planners.mppi.mppi_config import MppiConfig
from pushplan.planners.mppi.rollout_model import step_length
from pushplan.planners.mppi.target_choice import TargetChoice
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

_PERIOD = 0.1  # for which the first command is taken to be held [s]
_LOGGED = 10_000  # decisions that are kept


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
