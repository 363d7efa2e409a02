"""`Runner`: a planner or policy in a robot's own loop."""

from __future__ import annotations

import math
import threading
import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from numbers import Real
from typing import Any

import numpy as np

from pushplan.control import PoseProgressChecker, waiting_twist
from pushplan.control.limits import driven_twist
from pushplan.errors import describe, refuse_copy
from pushplan.interaction import ContactParameters
from pushplan.runtime.command import Command, CommandStatus, RunLog
from pushplan.runtime.held_actions import drivable
from pushplan.runtime.interpreter_turns import take_short_turns, take_usual_turns
from pushplan.runtime.noise_allowance import NoiseAllowance
from pushplan.runtime.obstacle_guard import ObstacleGuard
from pushplan.runtime.state_estimator import ObjectMemory, StateEstimator
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
from pushplan.world.checks import FloatArray, choice, expect, number
from pushplan.world.policy_abilities import shown_plan

PLAN_STOP = OwnBudget() | Deadline(1.0)
"""Stop rule of planning calls: the planner's own budget, and never more than a second."""
_SMOOTHING = 0.3  # gain of the filter of noisy poses
_RETRY = 0.25  # time after a failure in which the policy is not asked [s]
_BLIND = 60.0  # for how long a robot that is to continue does so without a world [s]
_SURE = 5  # snapshots in which the goal has to be reached where one of them may err
_STUCK = 4.5  # time after which a robot that has not moved is stuck, so that it says so in 5 s [s]
_TOLD = 1.8  # times the least motion that noise does not hide, to be driven in that time
_LULL = 1.0  # longest pause between commands to move that counts as moving [s]
_WAITING = 99  # snapshots that are kept for the next command, besides the newest


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
            believed at most; less than 1 smooths noisy poses. By default 1, and 0.3 where there is
            noise. A policy that `ExpectsNoise` is told what is left.
        margin: distance that plans keep from what is static [m]; if None that of the worlds, and
            twice what noise leaves at the robot's farthest point, whichever is more.
        keep_unseen: for how long an object is taken to be there that is missing in the worlds [s].
        contact: friction and pressure, as `pushplan.interaction.identify` finds them, by which the
            policy predicts pushes; for a policy that is given by its name.
        log: keeps worlds, plans and commands.
        executor: runs planning calls; a thread by default, `DelayedExecutor` for tests.
        clock: returns seconds, by which planning calls are timed.

    Attributes:
        policy: what is run.
        status: of the last command; None before the first.
        worlds: how many snapshots were taken.
        ignored: how many were not, because a later one was there already, or because they were
            ahead of the clock of the commands by more than ``max_age``.
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

    __reduce_ex__ = refuse_copy

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
        contact: ContactParameters | None = None,
        log: RunLog | None = None,
        executor: PlanningExecutor | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.period = number("period", period, low=0.0, open_low=True)
        self.plan_stop = expect("plan_stop", plan_stop, Stop)  # type: ignore[type-abstract]
        self.max_age = number("max_age", max_age, low=0.0, open_low=True)
        self.on_stale = choice("on_stale", on_stale, ("stop", "continue"))
        if margin is not None:
            margin = number("margin", margin, low=0.0)
        self.margin = margin
        self.keep_unseen = number("keep_unseen", keep_unseen, low=0.0)
        delay = number("delay", delay, low=0.0)
        place = number("position_noise", position_noise, low=0.0)
        noise = np.array([place, place, number("heading_noise", heading_noise, low=0.0)])
        if observer_gain is None:
            observer_gain = _SMOOTHING if noise.any() else 1.0
        gain = number("observer_gain", observer_gain, low=0.0, high=1.0, open_low=True)
        self._seen_noise = place, float(noise[2])
        self.policy = drivable(policy, self.max_age, contact)
        self._believed = max(self.max_age, _BLIND if self.on_stale == "continue" else 0.0)
        self._estimator = StateEstimator(delay, gain, noise, self._believed)
        self._delay = delay
        self._log = log
        self._executor = executor or ThreadExecutor(self.plan_stop, clock)
        self._lock = threading.Lock()  # of the snapshots that have come in, and their counts
        self._prompt = False
        self._allow_for(np.zeros(3))
        self._forget()

    def _allow_for(self, noise: FloatArray) -> None:
        """Have policy, goals and margins allow for the noise (3,) that the estimates keep."""
        self._noise = noise
        place, _, heading = noise.tolist()
        self._allowance = NoiseAllowance(place, heading, self.period, self.margin)
        self._guard = ObstacleGuard(self._allowance, self.period)
        if self._allowance.is_noisy and isinstance(self.policy, ExpectsNoise):
            self.policy.expect_noise(place, heading)

    def _forget(self) -> None:
        self.status: CommandStatus | None = None
        self.worlds = self.ignored = self.failures = 0
        self._newest: World | None = None
        self._inbox: list[World] = []
        self._shift = self._at = 0.0
        """Lag of the clock of the commands behind that of the episode, and the latter [s]."""
        self._clock_read = False
        self._stepped = self._refused = ""
        self._cancelled = ""
        self._done = 0
        self._surely_done = False
        self._last: Command | None = None
        self._plan: Plan | None = None
        self._planned_at = self._retry_at = -math.inf
        self._failure = ""
        self._begun = False

    def __enter__(self) -> Runner:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def start(self, world: World) -> Command:
        """Begin an episode, and give the first command.

        The robot is taken to drive as the world says. Until `close` threads of this process take
        shorter turns, and what is in memory now is no matter of Python's garbage collector, so
        that neither delays commands.

        Args:
            world: the first snapshot. Its clock is that of `update` and `command`.

        Raises:
            InvalidInputError: if the policy cannot be used in such a world.
        """
        self._allow_for(self._estimator.remaining_noise(world.robot, self.period))
        world = self._allowance.planning_world(world)
        with self._lock:
            self._forget()
            self._newest = world
            self.worlds = 1
        self._guard.reset(world)
        self._restart(world)
        if not self._is_planning:  # else as soon as the call of the last episode has returned
            self._begin(world)
        if not self._prompt:
            take_short_turns()
            self._prompt = True
        self._note("world", world)
        return self.command(world.time)

    def _restart(self, world: World) -> None:
        """Begin anew with a snapshot: nothing that was seen, sent or planned before it counts."""
        self._estimator.reset()
        self._progress = PoseProgressChecker(world.robot, _STUCK, self._seen_noise)
        self._told = 0.0
        """Time for which the robot was told to move [s]."""
        self._told_at = -math.inf
        self._memory = ObjectMemory(self.keep_unseen)
        self._observe(self._memory.complete(world, world))
        self._drop_plans()

    def _observe(self, world: World) -> None:
        """Take a snapshot, and see whether it is sure by now that the goal is reached."""
        seen = self._estimator.observe(world)
        of_robot = isinstance(world.goal, GoalDisc | GoalLine)
        exact = of_robot and not self._allowance.is_noisy
        once = exact or not world.robot.can_stop  # one that drives on may be out soon
        ready = once or self._estimator.is_settled(self._noise, world.goal)
        if seen.goal_reached and ready:
            self._done += 1
        else:
            self._done = max(0, self._done - 1)
        self._surely_done = self._surely_done or self._done >= (1 if once else _SURE)

    def _drop_plans(self) -> None:
        """Abandon all planning calls; the policy starts anew when none of them runs any more."""
        self._begun = False
        if isinstance(self._executor, ThreadExecutor):
            self._executor.abandon()

    def _begin(self, world: World) -> None:
        self.policy.reset(world, np.random.default_rng(0))
        self.policy.plan_with(self._executor)
        self._begun = True

    def update(self, world: World) -> bool:
        """Take a snapshot, from any thread.

        Args:
            world: what perception has seen; ``world.time`` says when.

        Returns:
            True if it is news. One that is not later than the newest is counted and ignored.
        """
        world = self._allowance.planning_world(world)
        with self._lock:
            newest = math.inf
            if self._newest is not None:
                newest = self._newest.time - self._shift
            behind = [time - world.time for time in (newest, *(one.time for one in self._inbox))]
            superseded = any(0.0 <= t <= self.max_age for t in behind)
            news = world.time > newest and not superseded
            self.worlds += news
            self.ignored += not news
            if not superseded:  # one that is far behind may be the first of a clock set back
                self._inbox = [*self._inbox[-_WAITING:], world]
        return news

    def _take_up(self, now: float) -> World:
        """The newest snapshot; `command` alone knows what time it is, and so which ones are sane.

        One that is a little ahead of the commands is taken for one of now, so that it is in
        nobody's way later; one that is far ahead is dropped.
        """
        fresh = []
        with self._lock:
            assert self._newest is not None
            for world in self._inbox:
                stamp = world.time + self._shift
                if self._newest.time < stamp <= now + self.max_age:
                    seen_at = min(stamp, now)
                    if seen_at != world.time:
                        world = world.moved(time=seen_at)
                    fresh.append(world)
                    continue
                side = "ahead of" if stamp > now else "behind"
                off = f"{abs(stamp - now):.3g} s {side}"
                self._refused = f"; another one is {off} the clock of the commands"
                if stamp > now:
                    self.worlds -= 1
                    self.ignored += 1
            self._inbox = []
            if not fresh:
                return self._newest
            fresh.sort(key=lambda world: world.time)
            self._newest = fresh[-1]
            self._refused = ""
        for world in fresh:
            self._note("world", world)
        seen = self._guard.observe(fresh[-1])
        if self._stepped:
            self._restart(seen)
            self._stepped = ""
        else:
            predicted = self._estimator.at(seen.time)
            self._observe(self._memory.complete(seen, predicted))
        return fresh[-1]

    def cancel(self, reason: str = "cancelled") -> None:
        """Bring the robot to a stop; `start` begins anew."""
        self._cancelled = reason or "cancelled"
        if isinstance(self._executor, ThreadExecutor):
            self._executor.abandon()

    def close(self, timeout: float = 1.0) -> bool:
        """End planning.

        Args:
            timeout: how long to wait for the call that runs [s].

        Returns:
            True if no planning thread is left.
        """
        self.cancel("closed")
        if self._prompt:
            take_usual_turns()
            self._prompt = False
        if isinstance(self._executor, ThreadExecutor):
            return self._executor.close(timeout)
        return True

    def command(self, now: float) -> Command:
        """Return the command to drive now; never plans, never waits.

        A clock that steps, or says no time, brings the robot to a stop with a reason. After a step
        back everything begins anew with the first world of the new clock.

        Args:
            now: by the clock of the worlds [s]. The time of the last call gets the same again.

        Raises:
            InvalidInputError: if ``now`` is not a number, or nothing was started.
        """
        if not (isinstance(now, Real) and math.isnan(now)):
            now = number("now", now, finite=False)
        if self._newest is None:
            raise InvalidInputError("call start(world) before command(now)")
        last = self._last
        if last is not None and now == last.time:
            return last
        at, clock = self._read_clock(now)
        gap = self.period if last is None else at - self._at
        # in a longer gap the clock has stepped, or nobody knows what the robot was told
        held = gap if 0.0 < gap <= self.max_age else self.period
        newest = self._take_up(at)
        world = self._estimator.at(at + self._delay)
        chosen, status, reason = self._choose(world, at, at - newest.time, clock)
        wanted = waiting_twist(world) if chosen is None else chosen
        before = driven_twist(newest) if last is None else last.twist
        plan = shown_plan(self.policy)
        twist, obstacle = self._guard.limited(world, before, wanted, held, plan)
        if obstacle and status in (CommandStatus.DRIVING, CommandStatus.WAITING):
            status = CommandStatus.BLOCKED
            reason = obstacle
        idle = self._idle(newest, twist, at, held)
        if status is CommandStatus.DRIVING and idle > _STUCK:
            status = CommandStatus.STUCK
            reason = f"the robot has not moved for {idle:.0f} s though it was told to"
        self._estimator.sent(at, twist)
        if plan is not self._plan:
            self._plan = plan
            self._planned_at = at
            if plan is not None:
                self._note("plan", plan, at)
        command = Command(
            at,
            twist,
            status,
            reason,
            plan,
            0.0 if plan is None else at - self._planned_at,
            at - newest.time,
            gap > 1.5 * self.period,
        )
        self._note("command", command)
        if math.isfinite(now) and now != at:
            command = replace(command, time=now)
        self._last = command
        self.status = status
        self._at = at
        return command

    def _idle(self, seen: World, twist: Twist, now: float, held: float) -> float:
        """For how long the robot was told to move, and did not [s]."""
        moves = self._progress.moved_by(abs(twist.course[0]) * _STUCK, abs(twist.angular) * _STUCK)
        part = moves / _TOLD
        if part >= 1.0:
            self._told_at = now
        if now - self._told_at <= _LULL:
            part = 1.0
        self._told += part * held  # slow commands take longer to show
        self._progress.update(seen.robot_pose, self._told)
        return self._progress.idle

    def _read_clock(self, now: float) -> tuple[float, str]:
        """The time of the episode, which never goes back, and what is wrong with the clock."""
        if not math.isfinite(now):
            self._clock_read = False
            return self._at + self.period, f"the clock of the commands says {now:g} s"
        at = now + self._shift
        last = self._last
        if last is None:
            return at, ""
        first = not self._clock_read
        self._clock_read = True
        back = self._at - at
        if back < 0.0:
            return at, self._stepped
        with self._lock:
            self._shift += back + self.period
        if not first or back > self.max_age:  # what was a guess may be a little ahead
            self._stepped = (
                f"the clock of the commands went back by {back:.3g} s, to {now:g} s: "
                "waiting for a world of that time"
            )
        return self._at + self.period, self._stepped

    def _note(self, what: str, *values: Any) -> None:
        """Call a method of the log by its name; a log that fails is not called again."""
        if self._log is None:
            return
        try:
            getattr(self._log, what)(*values)
        except Exception as error:
            self._log = None
            warnings.warn(f"logging has ended: {describe(error)}", RuntimeWarning, stacklevel=3)

    def _choose(
        self, world: World, now: float, age: float, clock: str
    ) -> tuple[Twist | None, CommandStatus, str]:
        """The velocity that is wanted, before the limits of acceleration; None is to wait."""
        if self._cancelled:
            return None, CommandStatus.CANCELLED, self._cancelled
        if self._surely_done:
            return None, CommandStatus.DONE, ""
        if clock:
            return None, CommandStatus.STALE, clock
        if age > self._believed:
            old = f"the newest world is {age:.3g} s old{self._refused}"
            return None, CommandStatus.STALE, old
        running = self._running_s
        budget = self.plan_stop.seconds
        if running > 2.0 * budget + 0.5:
            reason = f"a planning call has run for {running:.2g} s, its rule allows {budget:g} s"
            return None, CommandStatus.FAILED, reason
        if now < self._retry_at:
            return None, CommandStatus.FAILED, self._failure
        if self._is_planning and not self._begun:  # no policy is in two threads at once
            return None, CommandStatus.WAITING, "an abandoned planning call has not returned yet"
        try:
            if not self._begun:
                self._begin(world)
            wanted = expect("the action of the policy", self.policy.act(world, None), Twist)
        except Exception as error:
            self.failures += 1
            self._failure = describe(error)
            self._retry_at = now + _RETRY
            self._drop_plans()
            return None, CommandStatus.FAILED, self._failure
        if wanted.linear == wanted.angular == wanted.lateral == 0.0:
            why = "a plan is on its way"
            if not self._running_s:
                why = _missing_plan(self.policy) or "the policy asks for no motion"
            return wanted, CommandStatus.WAITING, why
        return wanted, CommandStatus.DRIVING, ""

    @property
    def _is_planning(self) -> bool:
        """True if a planning call has not returned yet."""
        return isinstance(self._executor, ThreadExecutor) and self._executor.is_busy

    @property
    def _running_s(self) -> float:
        """For how long a planning call has been running [s]; 0 if none is."""
        if isinstance(self._executor, ThreadExecutor):
            return self._executor.running_s
        return 0.0


def _missing_plan(policy: Policy) -> str:
    """Why a policy that follows plans has none; empty where it has one, or does not say."""
    if not (isinstance(policy, LogsPlans) and isinstance(policy, ShowsPlan)):
        return ""
    if policy.current_plan is not None or not policy.plan_log:
        return ""
    status = policy.plan_log[-1].status
    if status.has_plan:
        return ""
    return f"{status.label}: {status.remedy}"
