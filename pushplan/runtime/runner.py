"""`Runner`: a planner or policy in a robot's own loop."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable

import numpy as np

from pushplan.control import waiting_twist
from pushplan.control.limits import driven_twist
from pushplan.planners.kernel_warmup import warm_up_policy
from pushplan.runtime.command import Command, CommandStatus
from pushplan.runtime.held_actions import drivable
from pushplan.runtime.interpreter_turns import take_short_turns, take_usual_turns
from pushplan.runtime.noise_allowance import NoiseAllowance
from pushplan.runtime.object_memory import ObjectMemory
from pushplan.runtime.obstacle_guard import ObstacleGuard
from pushplan.runtime.run_log import QuietLog, RunLog
from pushplan.runtime.state_estimator import StateEstimator
from pushplan.runtime.thread_executor import ThreadExecutor
from pushplan.world import (
    Deadline,
    ExpectsNoise,
    GoalDisc,
    GoalLine,
    InvalidInputError,
    LogsPlans,
    OwnBudget,
    Plan,
    Planner,
    PlanningExecutor,
    Policy,
    ShowsPlan,
    Stop,
    Twist,
    World,
)
from pushplan.world.checks import choice, expect, number
from pushplan.world.errors import describe

PLAN_STOP = OwnBudget() | Deadline(1.0)
"""Stop rule of planning calls: the planner's own budget, and never more than a second."""
_SMOOTHING = 0.3  # gain of the filter of noisy poses
_RETRY = 0.25  # time after a failure in which the policy is not asked [s]
_BLIND = 60.0  # for how long a robot that is to continue does so without a world [s]


class Runner:
    """Turns worlds that come in at any rate into commands at the rate of the robot.

    `command` never plans and never waits: planning goes on in another thread, and what was planned
    last is driven until then. Whatever happens there, the robot gets a command; where nothing
    can be driven it is brought to a stop within its accelerations, with a reason. A robot that
    cannot stand circles where there is room: `pushplan.control.waiting_twist`.

    `start` and `command` are called by one thread, the robot's loop; `update` and `cancel` by any.

    Args:
        policy: a policy, a planner, or the name of one of `pushplan.planners.policy_names()`.
        period: time between two calls of `command` [s].
        plan_stop: rule that every planning call has to obey. A call that runs for more than twice
            as long, and half a second more, stops the robot until it has returned.
        max_age: a world that is older stops the robot, or an answer of a policy that plans in one
            go [s].
        on_stale: ``"stop"``, or ``"continue"`` along what is predicted, for a minute at most.
        delay: time between a command and its effect [s].
        position_noise: standard deviation of the places in the worlds, of robot and objects [m].
        heading_noise: the same of the headings [rad].
        observer_gain: how much of the difference between what is predicted and what is seen is
            believed; less than 1 smooths noisy poses. By default 1, and 0.3 where there is noise.
            A policy that `ExpectsNoise` is told what is left.
        margin: distance that plans keep from what is static [m]; if None that of the worlds, and
            twice what noise leaves at the robot's farthest point, whichever is more.
        keep_unseen: for how long an object is taken to be there that is missing in the worlds [s].
        log: keeps worlds, plans and commands.
        executor: runs planning calls; a thread by default, another one for simulation.
        clock: returns seconds, by which planning calls are timed.

    Attributes:
        policy: what is run.
        status: of the last command; None before the first.
        worlds: how many snapshots were taken.
        ignored: how many were not, because a later one was there already.
        failures: how often planning or the policy has failed.

    Raises:
        InvalidInputError: if an argument has no sense, or the policy gives no velocities.
        UnknownNameError: if there is no policy of that name.

    Example:
        >>> with Runner("push-aware", period=0.05) as runner:  # doctest: +SKIP
        ...     runner.start(perception())
        ...     while driving:
        ...         runner.update(perception())  # any thread, any rate
        ...         send(runner.command(now()).twist)
    """

    def __init__(
        self,
        policy: Policy | Planner | str,
        *,
        period: float,
        plan_stop: Stop = PLAN_STOP,
        max_age: float = 0.5,
        on_stale: str = "stop",
        delay: float = 0.0,
        position_noise: float = 0.0,
        heading_noise: float = 0.0,
        observer_gain: float | None = None,
        margin: float | None = None,
        keep_unseen: float = 0.0,
        log: RunLog | None = None,
        executor: PlanningExecutor | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.period = number("period", period, low=0.0, open_low=True)
        self.plan_stop = expect("plan_stop", plan_stop, Stop)  # type: ignore[type-abstract]
        self.max_age = number("max_age", max_age, low=0.0, open_low=True)
        self.on_stale = choice("on_stale", on_stale, ("stop", "continue"))
        self.margin = None if margin is None else number("margin", margin, low=0.0)
        self.keep_unseen = number("keep_unseen", keep_unseen, low=0.0)
        delay = number("delay", delay, low=0.0)
        noise = [
            number("position_noise", position_noise, low=0.0),
            number("heading_noise", heading_noise, low=0.0),
        ]
        if observer_gain is None:
            observer_gain = _SMOOTHING if any(noise) else 1.0
        gain = number("observer_gain", observer_gain, low=0.0, high=1.0, open_low=True)
        self.policy = drivable(policy, self.max_age)
        left = math.sqrt(gain / (2.0 - gain))  # of white noise, after a filter of that gain
        self._allowance = NoiseAllowance(left * noise[0], left * noise[1], self.period, self.margin)
        self._guard = ObstacleGuard(self._allowance, self.period)
        if any(noise) and isinstance(self.policy, ExpectsNoise):
            self.policy.expect_noise(left * noise[0], left * noise[1])
        self._believed = max(self.max_age, _BLIND if self.on_stale == "continue" else 0.0)
        self._estimator = StateEstimator(delay, gain, self._believed)
        self._delay, self._clock, self._log = delay, clock, QuietLog(log)
        self._executor = executor or ThreadExecutor(self.plan_stop, clock)
        self._lock = threading.Lock()
        self._prompt = False
        self._forget()

    def _forget(self) -> None:
        self.status: CommandStatus | None = None
        self.worlds = self.ignored = self.failures = 0
        self._newest: World | None = None
        self._observed: World | None = None
        self._cancelled = ""
        self._last: Command | None = None
        self._plan: Plan | None = None
        self._planned_at = self._retry_at = -math.inf
        self._failure = ""

    def __enter__(self) -> Runner:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def start(self, world: World) -> Command:
        """Begin an episode: load all kernels, and give the first command.

        That may take seconds in a new process, and minutes after an installation; nothing is
        compiled afterwards. The robot is taken to drive as the world says. Until `close` threads
        of this process take shorter turns, and what is in memory now is no matter of Python's
        garbage collector, so that neither delays commands.

        Args:
            world: the first snapshot. Its clock is that of `update` and `command`.

        Raises:
            InvalidInputError: if the policy cannot be used in such a world.
        """
        world = self._allowance.planning_world(world)
        if not self.worlds:  # the first time
            warm_up_policy(self.policy)
        self._estimator.warm_up(world)
        self._estimator.reset()
        self._forget()
        self._estimator.observe(world)
        self._memory = ObjectMemory(self.keep_unseen)
        self._guard.reset(world)
        self._memory.complete(world, world)
        self._begin(world)
        if not self._prompt:
            take_short_turns()
            self._prompt = True
        self._newest = self._observed = world
        self.worlds = 1
        self._log.note("world", world)
        return self.command(world.time)

    def _begin(self, world: World) -> None:
        self.policy.reset(world, np.random.default_rng(0))
        self.policy.plan_with(self._executor)

    def update(self, world: World) -> bool:
        """Take a snapshot, from any thread.

        Args:
            world: what perception has seen; ``world.time`` says when.

        Returns:
            Whether it is news. One that is not later than the newest is counted and ignored.
        """
        world = self._allowance.planning_world(world)
        with self._lock:
            if self._newest is not None and world.time <= self._newest.time:
                self.ignored += 1
                return False
            self._newest = world
            self.worlds += 1
        self._log.note("world", world)
        return True

    def cancel(self, reason: str = "cancelled") -> None:
        """Bring the robot to a stop; `start` begins anew."""
        self._cancelled = reason or "cancelled"
        if isinstance(self._executor, ThreadExecutor) and self._executor.latest is not None:
            self._executor.latest.abandon()

    def close(self, timeout: float = 1.0) -> bool:
        """End planning.

        Args:
            timeout: how long to wait for the call that runs [s].

        Returns:
            Whether no planning thread is left.
        """
        self.cancel("closed")
        if self._prompt:
            take_usual_turns()
            self._prompt = False
        return self._executor.close(timeout) if isinstance(self._executor, ThreadExecutor) else True

    def command(self, now: float) -> Command:
        """What to drive now; never plans, never waits.

        Args:
            now: by the clock of the worlds [s]. The time of the last call gets the same again.

        Raises:
            InvalidInputError: if ``now`` is not a number, is before the last call, or nothing was
                started.
        """
        now = number("now", now)
        if self._newest is None:
            raise InvalidInputError("call start(world) before command(now)")
        last = self._last
        if last is not None and now <= last.time:
            if now == last.time:
                return last
            raise InvalidInputError(
                f"now went back from {last.time:g} s to {now:g} s: call start() for another episode"
            )
        with self._lock:
            newest = self._newest
        if newest is not self._observed:
            predicted = self._estimator.at(newest.time)
            seen = self._guard.observe(newest)
            self._estimator.observe(self._memory.complete(seen, predicted))
            self._observed = newest
        held = self.period if last is None else now - last.time
        world = self._estimator.at(now + self._delay)
        chosen, status, reason = self._choose(world, now, now - newest.time)
        wanted = waiting_twist(world) if chosen is None else chosen
        before = driven_twist(newest) if last is None else last.twist
        twist, obstacle = self._guard.limited(world, before, wanted, held)
        if obstacle and status in (CommandStatus.DRIVING, CommandStatus.WAITING):
            status, reason = CommandStatus.BLOCKED, obstacle
        self._estimator.sent(now, twist)
        plan = self.policy.current_plan if isinstance(self.policy, ShowsPlan) else None
        if plan is not self._plan:
            self._plan, self._planned_at = plan, now
            if plan is not None:
                self._log.note("plan", plan, now)
        command = Command(
            now,
            twist,
            status,
            reason,
            plan,
            0.0 if plan is None else now - self._planned_at,
            now - newest.time,
            last is not None and held > 1.5 * self.period,
        )
        self._last, self.status = command, status
        self._log.note("command", command)
        return command

    def _choose(
        self, world: World, now: float, age: float
    ) -> tuple[Twist | None, CommandStatus, str]:
        """The velocity that is wanted, before the limits of acceleration; None is to wait."""
        if self._cancelled:
            return None, CommandStatus.CANCELLED, self._cancelled
        if abs(age) > self._believed:
            why = "old" if age > 0.0 else "ahead of the clock of the commands"
            return None, CommandStatus.STALE, f"the newest world is {abs(age):.3g} s {why}"
        running, budget = self._running_s, self.plan_stop.seconds
        if running > 2.0 * budget + 0.5:
            reason = f"a planning call has run for {running:.2g} s, its rule allows {budget:g} s"
            return None, CommandStatus.FAILED, reason
        if now < self._retry_at:
            return None, CommandStatus.FAILED, self._failure
        try:
            wanted = expect("the action of the policy", self.policy.act(world, None), Twist)
        except Exception as error:
            self.failures += 1
            self._failure, self._retry_at = describe(error), now + _RETRY
            self._begin(world)
            return None, CommandStatus.FAILED, self._failure
        if is_done(world):
            return wanted, CommandStatus.DONE, ""
        if wanted.linear == 0.0 == wanted.angular:
            why = "a plan is on its way" if self._running_s else _missing_plan(self.policy)
            if why:
                return wanted, CommandStatus.WAITING, why
        return wanted, CommandStatus.DRIVING, ""

    @property
    def _running_s(self) -> float:
        """For how long a planning call has been running [s]; 0 if none is."""
        executor = self._executor
        return executor.running_s if isinstance(executor, ThreadExecutor) else 0.0


def _missing_plan(policy: Policy) -> str:
    """Why a policy that follows plans has none; empty where it has one, or does not say."""
    if not (isinstance(policy, LogsPlans) and isinstance(policy, ShowsPlan)):
        return ""
    if policy.current_plan is not None or not policy.plan_log:
        return ""
    status = policy.plan_log[-1].status
    return "" if status.has_plan else f"{status.label}: {status.remedy}"


def is_done(world: World) -> bool:
    """Whether the robot, or every object, is where the goal wants it."""
    goal = world.goal
    if isinstance(goal, GoalDisc | GoalLine):
        return goal.distance(float(world.robot_pose[0]), float(world.robot_pose[1])) == 0.0
    return bool(world.completed.all())
