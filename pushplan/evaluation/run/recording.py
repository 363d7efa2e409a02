"""Run one episode and record everything that a metric may ask for later."""

from __future__ import annotations

import copy
import time
from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import numpy as np

import pushplan
from pushplan.control.executors import SimulatedExecutor
from pushplan.evaluation.run.policy_calls import (
    asked,
    checked_action,
    held_for,
    observation_time,
    plan_times,
)
from pushplan.world import (
    ChoosesActions,
    Episode,
    InvalidInputError,
    PlansBesideDriving,
    Policy,
    ShowsPlan,
    Twist,
    WheelSpeeds,
    World,
    stream,
)
from pushplan.world.checks import FloatArray, number
from pushplan.world.plan import Plan
from pushplan.world.protocols import HasAttributes
from pushplan.world.stored.recorded_plans import PlanRecorder

Clock = Callable[[], float]
"""Returns seconds, like `time.perf_counter`."""

Observer = Callable[[int, World, Policy], None]
"""Called after the reset with 0 and after step i with i; sees the world and the policy."""


@runtime_checkable
class AdaptsActions(HasAttributes, Protocol):
    """An environment that can change to an action mode which takes velocities."""

    def take_velocities(self) -> bool:
        """Change to such a mode for the next reset; False where there is nothing to change."""


def run_episode(
    env: Any,
    policy: Policy,
    scenario: Any,
    *,
    observer: Observer | None = None,
    latency_factor: float | None = None,
    clock: Clock = time.perf_counter,
) -> Episode:
    """Run ``policy`` in ``env`` from the start of ``scenario`` to the end of the episode.

    The policy draws from a stream that depends on the scenario's seed only, and from another one
    than the layout.

    Args:
        env: a `pushplan.envs.PushEnv`, or anything with its ``reset``, ``step``, ``world``,
            ``trace``, ``encode`` and ``action_space``.
        policy: chooses the actions.
        scenario: what ``env`` was made for; gives the seed.
        observer: sees each step; for pictures and windows.
        latency_factor: seconds of the world's clock for each second that the policy computes; until
            its action is there, the robot goes on as it was commanded last. None: the world stands
            still while the policy computes.
        clock: measures how long the policy takes [s].

    Raises:
        InvalidInputError: if ``latency_factor`` is negative, or ``env`` cannot simulate that time.
        PolicyError: if the policy raises.
        InvalidActionError: if it returns an action that is not finite or has the wrong shape.
    """
    recording = Recording(policy, scenario, latency_factor=latency_factor, clock=clock)
    recording.run(env, observer)
    return recording.episode()


class Recording:
    """An episode in the making; what was recorded before a failure stays available."""

    def __init__(
        self,
        policy: Policy,
        scenario: Any,
        label: str = "",
        *,
        latency_factor: float | None = None,
        clock: Clock = time.perf_counter,
    ) -> None:
        self.policy = policy
        if latency_factor is not None:
            latency_factor = number("latency_factor", latency_factor, low=0.0)
        self.latency_factor = latency_factor
        self._clock = clock
        self._executor = SimulatedExecutor(self.latency_factor or 0.0, clock)
        self.scenario = scenario
        self.label = label or type(policy).__name__
        self.started = False
        self.success = False
        self.reason = ""
        self._world: World | None = None
        self._completed: Any = None
        self._motion: list[tuple[FloatArray, ...]] = []  # times, poses of robot and of objects
        self._actions: list[FloatArray] = []
        self._rewards: list[float] = []
        self._act_times: list[float] = []
        self._plans: PlanRecorder | None = None
        self._shown: dict[int, Any] = {}
        self._told: list[Any] = []

    def run(self, env: Any, observer: Observer | None = None, *, limit: int | None = None) -> None:
        """Reset and step until the episode ends, or for ``limit`` steps.

        Raises as `run_episode`.
        """
        observation, _ = env.reset(seed=self.scenario.seed)
        world = env.world
        self._begin(getattr(env, "true_world", world))
        shown = self._copy(world)
        rng = stream(self.scenario.seed, "policy")
        asked(self.policy.reset, shown, rng)
        self._simulate_latency(env)
        if observer is not None:
            observer(0, world, self.policy)
        ended = False
        while not ended:
            seeing = observation_time(env, self.policy, len(self._actions))
            beside = self._executor.spent
            begin = self._clock()
            action = asked(self.policy.act, shown, observation)
            elapsed = self._clock() - begin
            self._note_plan(world)
            if not self._actions and self._changes_mode(env, action):
                self.run(env, observer, limit=limit)
                return
            command = checked_action(env, action)
            if self.latency_factor is None:
                observation, reward, terminated, truncated, info = env.step(command)
            else:
                waited = max(elapsed - (self._executor.spent - beside), 0.0)
                lag = self.latency_factor * (seeing + waited)
                observation, reward, terminated, truncated, info = env.step_late(command, lag)
            elapsed += seeing
            world = env.world
            shown = self._copy(world)
            trace = env.trace
            parts = trace.times, trace.robot_poses, trace.object_poses
            self._motion.append(tuple(map(np.array, parts)))
            self._actions.append(np.array(command, dtype=np.float64).reshape(-1))
            self._rewards.append(float(reward))
            self._act_times.append(elapsed)
            self._completed = info.get("completed", self._completed)
            ended = bool(terminated or truncated) or len(self._actions) == limit
            if observer is not None:
                observer(len(self._actions), world, self.policy)
        self.success = bool(info.get("success", False))
        self.reason = str(info.get("reason") or ("time_limit" if truncated else "ended"))

    def episode(self, reason: str | None = None) -> Episode:
        """Return the episode as far as it was recorded.

        Args:
            reason: why it ended, where that was a failure.
        """
        assert self._world is not None
        actions = np.zeros((0, 0))
        if self._actions:
            actions = np.array(self._actions)
        times, robot_poses, object_poses = map(np.concatenate, zip(*self._motion, strict=True))
        about = {
            "policy": self.label,
            "scenario": self.scenario.to_dict(),
            "key": self.scenario.key,
            "seed": self.scenario.seed,
            "pushplan": pushplan.__version__,
        }
        if self.latency_factor is not None:
            about["latency_factor"] = self.latency_factor
        if held_for(self.policy) != 1:
            about["held_for"] = held_for(self.policy)
        return Episode(
            world=self._world,
            times=times,
            robot_poses=robot_poses,
            object_poses=object_poses,
            success=self.success,
            reason=self.reason if reason is None else reason,
            completed=self._completed,
            actions=actions,
            rewards=np.array(self._rewards),
            act_times_s=np.array(self._act_times),
            plans=None if self._plans is None else self._plans.recorded(),
            plan_times_s=np.array(plan_times(self.policy) or []),
            about=about,
        )

    def _changes_mode(self, env: Any, action: object) -> bool:
        """Return True if ``env`` restarts in an action mode that takes the policy's commands."""
        return (
            isinstance(action, Twist | WheelSpeeds)
            and isinstance(env, AdaptsActions)
            and not isinstance(self.policy, ChoosesActions)
            and env.take_velocities()
        )

    def _simulate_latency(self, env: Any) -> None:
        """Tell a policy that plans beside driving how time passes in this episode."""
        if self.latency_factor is None:
            return
        if not callable(getattr(env, "step_late", None)):
            raise InvalidInputError(
                "latency-aware simulation needs an environment with step_late(action, lag), "
                f"{type(env).__name__} has none"
            )
        if isinstance(self.policy, PlansBesideDriving):
            asked(self.policy.plan_with, self._executor)

    def _begin(self, world: World) -> None:
        self.started = True
        self._world = copy.deepcopy(world)
        shows = isinstance(self.policy, ShowsPlan)
        self._plans = PlanRecorder(self._world.movables.ids) if shows else None
        poses = np.array(world.robot_pose)[None], np.array(world.movables.poses)[None]
        self._motion = [(np.array([world.time]), *poses)]

    def _copy(self, world: World) -> World:
        """The world for the policy: what it does to its copy changes nothing that is scored.

        Parts that are the same object from step to step are the same copy, too: policies keep
        what they have made of them.
        """
        memo = dict(self._shown)
        shown = copy.deepcopy(world, memo)
        self._told = [world.robot, world.static, world.goal]
        self._shown = {id(part): memo[id(part)] for part in self._told}
        return shown

    def _note_plan(self, world: World) -> None:
        if self._plans is not None:
            plan = asked(lambda: self.policy.current_plan)  # type: ignore[attr-defined]
            if plan is None or isinstance(plan, Plan):
                self._plans.note(world.time, world.movables.ids, plan)
