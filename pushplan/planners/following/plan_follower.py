"""A planner with a controller and a replanning rule is a policy."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Protocol, runtime_checkable

import numpy as np

from pushplan.control import EpisodeClock, ImmediateExecutor, waiting_twist
from pushplan.control.limits import driven_twist, ramp_twist
from pushplan.control.stopping import stopping_path
from pushplan.control.tracking import Progress
from pushplan.interaction import InteractionModel, QuasiStatic
from pushplan.planners.following.plan_controller import PlanController
from pushplan.planners.following.recovery_timing import FruitlessCalls, RecoveryRule
from pushplan.planners.following.replanning import (
    Reason,
    Replanning,
    cost_of_rest,
    free_length,
    rest_of,
    sweep_rest,
)
from pushplan.planners.following.splicing import joined, passed, world_ahead
from pushplan.world import (
    Controller,
    GoalDisc,
    GoalLine,
    InvalidInputError,
    PendingResult,
    Plan,
    Planner,
    PlanningExecutor,
    PlanResult,
    PlanStatus,
    StaticMap,
    Stop,
    Twist,
    World,
)
from pushplan.world.checks import expect
from pushplan.world.polyline import path_lengths

_PERIOD = 0.1  # for which the first command is taken to be held [s]
_NEAR = 3  # so many poses ahead a jam lets nothing wait
_AT_ONCE = 3  # calls without a plan at one place, after which a jam waits too
_CLOSED = (PlanStatus.GOAL_UNREACHABLE, PlanStatus.WAY_CLOSED)
_PAUSE = 0.1  # between two plans, of the time for which the robot has not got on


@runtime_checkable
class PreparedPlanner(Protocol):
    """A planner that makes what depends on the robot alone before its first call."""

    def prepare(self, world: World) -> None:
        """Make it; it is kept."""
        ...


@dataclass(frozen=True)
class _PendingPlan:
    """A planning call whose plan may not be there yet."""

    call: PendingResult[PlanResult]
    start: World
    """The snapshot that it plans from."""
    stretch: Plan | None
    reason: Reason
    made: float
    """When it was asked for, by the clock of the world [s]."""


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

    actions = ("turn_rate", "velocity")
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
        self._progress: Progress
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
        self._progress = Progress(window=2.0 * world.robot.circumscribed_radius)
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
        self._pending: _PendingPlan | None = None
        self._rng = rng
        self._planned: World | None = None
        """The snapshot that was there when a plan was last asked for."""
        self._tight = False
        self._map: StaticMap | None = None
        self._map_has_changed = False
        self._fits: StaticMap | None = None
        """Static map that the present plan is known to be clear of."""
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
        return ramp_twist(world.robot, last, wanted.linear, wanted.angular, held)

    def _choose(self, world: World) -> Twist:
        away = self._recover(world) if self._recovery.is_on else None
        if away is None:
            self._update_plan(world)
            if self._is_waiting(world):
                self._recovery.wait()
            away = self._recover(world)
        if away is not None:
            return away
        if self.current_plan is None or self._is_past(world, self.current_plan):
            return waiting_twist(world)
        return self.controller.command(world, self.current_plan)

    def _is_past(self, world: World, plan: Plan) -> bool:
        """Return True if a robot that cannot stop is at the end of its plan, the next pending."""
        if world.robot.can_stop or self._pending is None:
            return False
        return self._progress.update(plan, world.robot_pose) >= self._progress.total - 1e-9

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
            if found_none and self._map_has_changed and self.plan_log[-1].status in _CLOSED:
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
            self._progress.update(plan, world.robot_pose)
            now = self._progress.time
        if plan is None and reason is Reason.BLOCKED:
            held = self._clock.held
            path = stopping_path(world.robot, world.robot_pose, driven_twist(world), held, held)
            world = world.moved(robot_pose=path[-1], robot_twist=np.zeros(3))  # after braking
        start, stretch = world_ahead(world, plan, now, latency, self.interaction)
        self._planned = world
        call = self._executor.submit(
            partial(_timed_call, self.planner, start, self._rng), world.time, self.stop
        )
        self._pending = _PendingPlan(call, start, stretch, reason, world.time)

    def _receive(self, world: World) -> None:
        """Take up a plan that is there."""
        pending = self._pending
        if pending is None or not pending.call.ready(world.time):
            return
        self._pending = None
        result = pending.call.result()
        if self.plan_log:
            self.plan_log[-1] = _without_predictions(self.plan_log[-1])
        self.plan_log.append(result)
        if result.plan is None:
            self._fruitless.add(world)
            if pending.reason is Reason.BLOCKED and world.robot.can_stop:
                self.current_plan = None
            return
        self._fruitless.clear()
        _check(result.plan, pending.start)
        new = joined(pending.stretch, result.plan)
        if world.time > pending.made:
            new = rest_of(new, passed(world, new, world.time - pending.made), None)
        if self._keeps_old(world, new, pending.reason):
            return
        self.current_plan = new
        self._fits = pending.start.static
        self._tight = result.stats.detail.get("tight", 0.0) > 0.0

    def _keeps_old(self, world: World, new: Plan, reason: Reason) -> bool:
        """Return True if the new plan is not enough better than the rest of the old one."""
        old = self.current_plan
        margin = self.replanning.margin
        if margin is None or reason.urgent or old is None:
            return False
        if self._free_length(world, old) < math.inf:
            return False
        index = self._progress.index(self._progress.along)
        weight = self.replanning.weight(self.planner)
        swept, path = sweep_rest(world, old, index, self.interaction)
        old_cost = cost_of_rest(world, path, swept, weight)
        swept_new, path = sweep_rest(world, new, 0, self.interaction)
        new_cost = cost_of_rest(world, path, swept_new, weight)
        robot = world.robot
        if new_cost < old_cost - margin * robot.circumscribed_radius * robot.mass:
            return False
        if np.isinf(old_cost):
            return False
        # what is expected of it from now on
        self.current_plan = rest_of(old, index, swept.object_poses)
        self._progress.update(self.current_plan, world.robot_pose)
        return True

    def _needs_plan(self, world: World) -> Reason | None:
        plan = self.current_plan
        rule = self.replanning
        size = world.robot.circumscribed_radius
        planned = self._planned
        waited = math.inf if planned is None else world.time - planned.time
        pause = rule.interval * size / world.robot.max_speed * self._fruitless.delay(world)
        # a robot that stays stuck thinks less and less often, so that the episode ends in time
        pause = max(pause, _PAUSE * self._recovery.idle)
        rested = waited >= pause - 1e-9
        if plan is None or planned is None:
            return Reason.NO_PLAN if rested else None
        if not (rule.never or np.array_equal(world.movables.ids, planned.movables.ids)):
            return Reason.OBJECTS  # something was delivered, lost or found
        left = self._free_length(world, plan)
        if left <= self._reaction(world):
            if world.robot.can_stop:
                self.current_plan = None  # it brakes at once
                return Reason.BLOCKED
            return Reason.BLOCKED if rested or self._fruitless.count(world) < _AT_ONCE else None
        if rested and left < math.inf:
            return Reason.JAM
        if rule.never:
            return None
        x, y = (float(value) for value in world.robot_pose[:2])
        along = self._progress.update(plan, world.robot_pose)
        index = self._progress.index(along)
        here = self._progress.pose(along)
        if rested and np.hypot(x - here[0], y - here[1]) > rule.offset * size:
            return Reason.OFFSET
        if along >= self._progress.total - 1e-9:
            return Reason.USED_UP if rested else None
        if self._tight and waited >= 4.0 * pause:
            return Reason.TIGHT  # there may be a plan that keeps its distance
        driven = np.hypot(*(world.robot_pose[:2] - planned.robot_pose[:2]))
        if waited >= rule.every_seconds - 1e-9 or driven >= rule.renewal * size:
            return Reason.PERIOD
        end = None
        if np.isfinite(rule.look_ahead):
            end = self._progress.index(along + rule.look_ahead * size) + 2
        return self._surprise(world, plan, slice(index, end), rested)

    def _free_length(self, world: World, plan: Plan) -> float:
        """Return the length of the plan's rest before static obstacles that are new to it [m]."""
        if self._fits is world.static:
            return math.inf
        index = self._progress.index(self._progress.update(plan, world.robot_pose))
        path = np.concatenate([world.robot_pose[None], plan.poses[index + 1 :]])
        free = math.inf if self._fits == world.static else free_length(world, path)
        if free == math.inf:
            self._fits = world.static
        return free

    def _reaction(self, world: World) -> float:
        """Return the distance driven until a plan that is asked for now can be followed [m]."""
        robot = world.robot
        speed = abs(driven_twist(world).linear)
        braking = 0.5 * speed * speed / robot.max_acceleration
        return self._latency() * speed + braking + robot.circumscribed_radius

    def _latency(self) -> float:
        """Time that the next planning call will take [s]."""
        latency = self.replanning.latency
        return self._executor.expected(self.stop) if latency is None else latency

    def _surprise(self, world: World, plan: Plan, part: slice, rested: bool) -> Reason | None:
        """Return a reason to replan if a part of the plan would not do what was predicted."""
        surprise = self.replanning.surprise
        if np.isinf(surprise) and not world.static.convex_parts:
            return None  # nothing can jam
        predicted = plan.object_poses
        if predicted is None or predicted.shape[1] != len(world.movables) or not predicted.size:
            return None
        now, _ = sweep_rest(world, plan, part.start, self.interaction, part.stop)
        if now.jammed_at >= 0:
            if now.jammed_at > _NEAR:
                return Reason.JAM if rested else None
            gets_on = self._recovery.idle <= self._recovery.patience
            at_once = gets_on and self._fruitless.count(world) < _AT_ONCE
            return Reason.BLOCKED if rested or at_once else None
        expected = float(path_lengths(predicted[part]) @ world.movables.masses)
        allowed = surprise * world.robot.circumscribed_radius * world.robot.mass
        return Reason.SURPRISE if rested and now.work - expected > allowed else None


def _timed_call(
    planner: Planner, start: World, rng: np.random.Generator, stop: Stop | None
) -> PlanResult:
    """Return the result of a planner, with the time that it took by our clock."""
    began = time.perf_counter()
    result = planner.plan(start, stop=stop, rng=rng)
    took = time.perf_counter() - began
    result = expect("what the planner returns", result, PlanResult)
    return replace(result, stats=replace(result.stats, wall_time_s=took))


def _without_predictions(result: PlanResult) -> PlanResult:
    """The same result without the objects' predicted poses, which take most of its memory."""
    if result.plan is None or result.plan.object_poses is None:
        return result
    return replace(result, plan=replace(result.plan, object_poses=None))


def _check(plan: Plan, start: World) -> None:
    """Refuse a plan that is not one for this snapshot.

    Raises:
        InvalidInputError: if it begins elsewhere, or predicts other objects.
    """
    (x, y) = plan.poses[0, :2].tolist()
    (x0, y0) = start.robot_pose[:2].tolist()
    most = start.robot.circumscribed_radius
    if math.hypot(x - x0, y - y0) > most:
        raise InvalidInputError(
            f"plan.poses must begin within {most:g} m of the robot, which is at [{x0:g}, {y0:g}], "
            f"got [{x:g}, {y:g}]"
        )
    count = len(start.movables)
    if plan.object_poses is not None and plan.object_poses.shape[1] != count:
        raise InvalidInputError(
            f"plan.object_poses must be ({len(plan.poses)}, {count}, 3) for the {count} objects of "
            f"the world, got {plan.object_poses.shape}"
        )


def policy_for(planner: Planner) -> PlanFollower:
    """The default policy around a planner: follow its plans, plan again when they do not fit.

    Raises:
        InvalidInputError: if the object has no ``plan`` method.
    """
    if not isinstance(planner, Planner):
        raise InvalidInputError(
            f"a planner needs a method plan(world, *, stop, rng), {type(planner).__name__} has none"
        )
    return PlanFollower(planner)
