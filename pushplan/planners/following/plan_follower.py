"""A planner with a controller and a replanning rule is a policy."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from pushplan.control import (
    EpisodeClock,
    ImmediateExecutor,
    PoseProgressChecker,
    Recovery,
    waiting_twist,
)
from pushplan.control.limits import driven_twist, ramp_twist
from pushplan.control.stopping import stopping_path
from pushplan.interaction import InteractionModel, QuasiStatic
from pushplan.planners.following.plan_controller import PlanController
from pushplan.planners.following.plan_fit import PlanFit, reaction_length
from pushplan.planners.following.planning_call import (
    PendingPlan,
    PlanRequest,
    PreparedPlanner,
    without_predictions,
)
from pushplan.planners.following.replanning import Reason, Replanning
from pushplan.planners.following.splicing import world_ahead
from pushplan.world import (
    Controller,
    Drive,
    GoalDisc,
    GoalLine,
    GoalPose,
    InvalidInputError,
    Plan,
    Planner,
    PlanningExecutor,
    PlanResult,
    PlanStatus,
    RobotModel,
    StaticMap,
    Stop,
    Twist,
    World,
)

_PERIOD = 0.1  # for which the first command is taken to be held [s]
_AT_ONCE = 3  # calls without a plan at one place, after which a jam waits too
_CLOSED = (PlanStatus.GOAL_UNREACHABLE, PlanStatus.WAY_CLOSED)
_DETOUR = 2.0  # times the length of a tight plan that the one in its place may have
_PAUSE = 0.1  # between two plans, of the time for which the robot has not got on
_DISTANCE = 1.0  # by which a recovery takes the robot away [circumscribed radii]
_PLACE = 2.0  # recoveries that are no farther apart are at the same place [circumscribed radii]
_MOST_RECOVERIES = 6  # recoveries at one place
_HERE = 0.5  # size of a place where calls find nothing [circumscribed radii]
_MOST_DOUBLINGS = 5


class PlanFollower:
    """Plans, drives the plan, and plans again when the world departs from the prediction.

    At every step the rest of the plan is swept again from where everything is now; where that
    costs more than was predicted, or jams, or the robot has left the path, or the plan is used
    up, a new plan is made. Where the map changes, or an object turns out fixed, the whole rest is
    checked; a robot that would be there before a new plan stops. If none is found the old one is
    kept, but a robot that can stop stands where it would jam next. A differential drive that does
    not get on, with a plan or without, recovers (`pushplan.control.Recovery`) and plans anew.

    With an executor that takes time (`plan_with`) planning goes on beside driving: a call plans
    from where the robot will be when it is done, and the old plan is driven until then.

    Args:
        planner: makes the plans.
        controller: drives them; by default `pushplan.control.PathFollower`, but
            `pushplan.control.PurePursuit` where the turn rates of a plan do not give its headings.
        replanning: when to plan again.
        interaction: predicts what the rest of a plan will do, or a function that gives the model
            for a world; quasi-static by default.
        stop: stop rule of each planning call; the planner's own default if None.
    """

    actions: tuple[str, ...] = ("turn_rate", "velocity", "omnidirectional")
    goal_kind = "robot"

    def __init__(
        self,
        planner: Planner,
        controller: Controller | None = None,
        *,
        replanning: Replanning | None = None,
        interaction: InteractionModel | Callable[[World], InteractionModel] | None = None,
        stop: Stop | None = None,
    ) -> None:
        self.planner = planner
        self.controller: Controller = PlanController() if controller is None else controller
        self.replanning = Replanning() if replanning is None else replanning
        self.interaction: InteractionModel = QuasiStatic()
        self._model_of: Callable[[World], InteractionModel] | None = None
        if isinstance(interaction, InteractionModel):
            self.interaction = interaction
        else:
            self._model_of = interaction
        self.stop = stop
        self._begun = False
        self._fit: PlanFit
        self._recovery: RecoveryRule
        self._forget(np.random.default_rng(0))

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Forget the last episode; calls run at once until `plan_with` says otherwise."""
        if isinstance(self.planner, PreparedPlanner):
            self.planner.prepare(world)
        world = world.with_fixed_as_static()
        self._abandon()
        self._forget(rng)
        self.controller.reset(world)
        self._clock.command = driven_twist(world)
        self._begun = True
        self._fit = PlanFit(world.robot, self.replanning)
        self._recovery = RecoveryRule(world)

    def plan_with(self, executor: PlanningExecutor) -> None:
        """See `pushplan.world.PlansBesideDriving`."""
        self._executor: PlanningExecutor = executor

    def _forget(self, rng: np.random.Generator) -> None:
        self.plan_log: list[PlanResult] = []
        """Every planning call since the last reset; only the last one keeps its predictions."""
        self.current_plan: Plan | None = None
        self.plan_with(ImmediateExecutor())
        self._clock = EpisodeClock(_PERIOD)
        self._pending: PendingPlan | None = None
        self._rng = rng
        self._planned: World | None = None
        """The snapshot that was there when a plan was last asked for."""
        self._map: StaticMap | None = None
        self._map_has_changed = False
        self._fruitless = FruitlessCalls()

    @property
    def stuck(self) -> bool:
        """True if all recoveries at this place are used up; plans are still made and driven."""
        return self._begun and self._recovery.stuck

    def act(self, world: World, observation: Any = None) -> Twist:
        """The twist for this step; plans first where that is necessary."""
        if not self._begun:
            self.reset(world, self._rng)
        if self._map is not world.static:
            if self._map not in (None, world.static):
                self._map_has_changed = True
                self._fruitless.clear()
            self._map = world.static
        return self._clock.command_for(world, self._act)

    def _act(self, world: World) -> Twist:
        if self._model_of is not None:
            self.interaction = self._model_of(world)  # open water may get its first obstacle
        wanted = self._choose(world)
        last = self._clock.command
        held = self._clock.held
        return ramp_twist(world.robot, last, wanted.linear, wanted.angular, held, wanted.lateral)

    def _choose(self, world: World) -> Twist:
        away = self._recover(world) if self._recovery.is_on else None
        if away is None:
            self._update_plan(world)
            if self._is_waiting(world):
                self._recovery.wait()
            away = self._recover(world)
        if away is not None:
            return away
        plan = self.current_plan
        if plan is None:
            return waiting_twist(world)
        stops_at_end = world.robot.can_stop or self._pending is None
        if not stops_at_end and self._fit.is_used_up(world, plan):
            return waiting_twist(world)
        return self.controller.command(world, plan)

    def _update_plan(self, world: World) -> None:
        """Ask for a plan where one is wanted, and take up the one that is there."""
        self._receive(world)
        if self._pending is None:
            reason = self._needs_plan(world)
            if reason is not None:
                self._ask(world, reason)
                self._receive(world)

    def _is_waiting(self, world: World) -> bool:
        """Return True if the robot may stand: it is at the goal, or its first plan is pending."""
        if self.current_plan is None:
            found_none = bool(self.plan_log) and self.plan_log[-1].plan is None
            by_itself = self._map_has_changed and world.unseen is None  # not by looking
            if found_none and by_itself and self.plan_log[-1].status in _CLOSED:
                return True  # it waits before a door, and does not get free
            return self._pending is not None and not found_none
        there = isinstance(world.goal, GoalDisc | GoalLine) and world.goal_reached
        return there or self.replanning.never

    def _recover(self, world: World) -> Twist | None:
        """The next velocity of a recovery, after which nothing is left of the old plan."""
        away = self._recovery.command(world, self._clock.held)
        if away is not None:
            self._abandon()
            self.current_plan = None
            self.controller.reset(world)
        return away

    def _abandon(self) -> None:
        """Wait no longer for a plan that was asked for."""
        if self._pending is not None:
            self._pending.call.abandon()
        self._pending = None

    def _ask(self, world: World, reason: Reason) -> None:
        """Call the planner; its plan is there after the time that the call takes."""
        latency = self._latency()
        plan = self.current_plan
        now = 0.0
        if plan is not None and latency > 0.0:
            now = self._fit.time_on(world, plan)
        if plan is None and reason is Reason.BLOCKED:
            held = self._clock.held
            path = stopping_path(world.robot, world.robot_pose, driven_twist(world), held, held)
            world = world.moved(robot_pose=path[-1], robot_twist=np.zeros(3))  # after braking
        off = reason is Reason.OFFSET
        start, stretch = world_ahead(world, plan, now, latency, self.interaction, off_plan=off)
        self._planned = world
        comparison = None
        if plan is not None and not reason.urgent:
            weight = self.replanning.weight(self.planner)
            comparison = self._fit.comparison(world, plan, self.interaction, weight)
        planning = PlanRequest(self.planner, start, stretch, self._rng, comparison)
        call = self._executor.submit(planning, world.time, self.stop)
        self._pending = PendingPlan(call, start, reason, world.time)

    def _receive(self, world: World) -> None:
        """Take up a plan that is there."""
        pending = self._pending
        if pending is None or not pending.call.ready(world.time):
            return
        self._pending = None
        answer = pending.call.result()
        result = answer.result
        if self.plan_log:
            self.plan_log[-1] = without_predictions(self.plan_log[-1])
        self.plan_log.append(result)
        if answer.plan is None:
            self._fruitless.add(world)
            if pending.reason is Reason.BLOCKED and world.robot.can_stop:
                self.current_plan = None
            return
        self._fruitless.clear()
        old = self.current_plan
        kept = answer.kept
        # from a tight curve into a pose a new plan may have to come round again
        leaves = pending.reason is Reason.TIGHT and not isinstance(world.goal, GoalPose)
        if leaves and kept is not None and answer.plan.length <= _DETOUR * kept.length:
            kept = None
        if kept is not None and old is not None and self._fit.free_length(world, old) == math.inf:
            self.current_plan = pending.from_now_on(kept, world)
            return
        self.current_plan = pending.from_now_on(answer.plan, world)
        tight = result.stats.detail.get("tight", 0.0) > 0.0
        self._fit.take_up(pending.start.static, tight=tight)

    def _needs_plan(self, world: World) -> Reason | None:
        plan = self.current_plan
        rule = self.replanning
        planned = self._planned
        waited = math.inf if planned is None else world.time - planned.time
        size = world.robot.circumscribed_radius
        pause = rule.interval * size / world.robot.max_speed * self._fruitless.delay(world)
        # a robot that stays stuck thinks less and less often, so that the episode ends in time
        pause = max(pause, _PAUSE * self._recovery.idle)
        rested = waited >= pause - 1e-9
        if plan is None or planned is None:
            return Reason.NO_PLAN if rested else None
        if not (rule.never or np.array_equal(world.movables.ids, planned.movables.ids)):
            return Reason.OBJECTS  # something was delivered, lost or found
        at_once = self._fruitless.count(world) < _AT_ONCE
        left = self._fit.free_length(world, plan)
        if left <= reaction_length(world, self._latency()):
            if world.robot.can_stop:
                self.current_plan = None  # it brakes at once
                return Reason.BLOCKED
            return Reason.BLOCKED if rested or at_once else None
        if rested and left < math.inf:
            return Reason.JAM
        if rule.never:
            return None
        at_once = at_once and self._recovery.idle <= self._recovery.patience
        return self._fit.reason(world, plan, planned, self.interaction, pause, at_once)

    def _latency(self) -> float:
        """Time that the next planning call will take [s]."""
        latency = self.replanning.latency
        if latency is None:
            return self._executor.expected(self.stop)
        return latency


def policy_for(planner: Planner, stop: Stop | None = None) -> PlanFollower:
    """The default policy around a planner: follow its plans, plan again when they do not fit.

    Args:
        planner: whose plans are followed.
        stop: stop rule of each planning call; the planner's own default if None.

    Raises:
        InvalidInputError: if the object has no ``plan`` method.
    """
    if not isinstance(planner, Planner):
        raise InvalidInputError(
            f"a planner needs a method plan(world, *, stop, rng), {type(planner).__name__} has none"
        )
    return PlanFollower(planner, stop=stop)


class RecoveryRule:
    """Begins a recovery where the robot does not get on, each time in another way at one place.

    A robot that has recovered as often as there are ways, and is still at the same place, is
    `stuck`: it stays with its plans alone until they bring it elsewhere. A constant-speed robot
    cannot recover, nor can a car that does not reverse.

    Args:
        world: at the start of the episode.
    """

    def __init__(self, world: World) -> None:
        self._checker = PoseProgressChecker(world.robot)
        self._recovery: Recovery | None = None
        self._place = world.robot_pose
        self._count = 0
        self._told = 0.0
        self._held = math.inf

    @property
    def idle(self) -> float:
        """Time for which the robot has not got on [s]."""
        return self._checker.idle

    @property
    def patience(self) -> float:
        """Time without getting on after which a recovery begins [s]."""
        return self._checker.patience

    @property
    def stuck(self) -> bool:
        """True if all recoveries at this place are used up."""
        return self._count >= _MOST_RECOVERIES

    @property
    def is_on(self) -> bool:
        """True while a recovery is in progress."""
        return self._recovery is not None

    def wait(self) -> None:
        """Take it that the robot stands because it has to: that is no lack of progress."""
        self._checker.reset()

    def command(self, world: World, held: float) -> Twist | None:
        """The velocity of a recovery; None where there is none, or it has just ended.

        Args:
            world: the scene now.
            held: for how long the last command was held [s]. Where that is more than twice as
                long as before, the rule was not asked meanwhile, and the rest is nobody's delay.
        """
        self._told += min(held, 2.0 * self._held)
        self._held = held
        size = world.robot.circumscribed_radius
        if math.dist(world.robot_pose[:2], self._place[:2]) > _PLACE * size:
            self._place = world.robot_pose
            self._count = 0
        gets_on = self._checker.update(world.robot_pose, self._told)
        if self._recovery is None:
            if gets_on or self.stuck or not _can_back_off(world.robot):
                return None
            self._recovery = Recovery(world, _DISTANCE * size, skip=self._count)
            self._count += 1
        command = self._recovery.command(world, held)
        if command is None:
            self._recovery = None
            self._checker.reset()
        return command


def _can_back_off(robot: RobotModel) -> bool:
    if robot.drive is Drive.CAR:
        return robot.min_speed < 0.0
    return robot.drive is Drive.DIFFERENTIAL


class FruitlessCalls:
    """Counts the calls that found nothing since the robot is where it is."""

    def __init__(self) -> None:
        self._count = 0
        self._place = (math.nan, math.nan)

    def add(self, world: World) -> None:
        """Another call from here has found nothing."""
        self._count = 1 + self.count(world)
        if self._count == 1:
            x, y, _ = world.robot_pose.tolist()
            self._place = x, y

    def clear(self) -> None:
        """A call has found a plan."""
        self._count = 0

    def count(self, world: World) -> int:
        """Number of calls in a row that have found no plan since the robot is at this place."""
        away = math.dist(world.robot_pose[:2].tolist(), self._place)
        if away <= _HERE * world.robot.circumscribed_radius:
            return self._count
        return 0

    def delay(self, world: World) -> float:
        """Factor of the time before the next call; planners without randomness search the same."""
        return 2.0 ** min(max(self.count(world) - 1, 0), _MOST_DOUBLINGS)
