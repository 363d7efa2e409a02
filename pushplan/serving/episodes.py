"""The two kinds of episodes: in step with a simulator, and beside a robot's own loop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, ClassVar

from pushplan.control import ImmediateExecutor
from pushplan.files.safe_files import known_keys
from pushplan.runtime import PLAN_STOP, Command, Runner
from pushplan.runtime.held_actions import twist_of
from pushplan.serving.messages import plan_fields
from pushplan.world import (
    Cancellation,
    Deadline,
    OwnBudget,
    Plan,
    PlansBesideDriving,
    Policy,
    ShowsPlan,
    Twist,
    WheelSpeeds,
    World,
    stream,
)
from pushplan.world.checks import expect, number

SETTINGS = (
    "planning_limit",
    "max_age",
    "on_stale",
    "delay",
    "position_noise",
    "heading_noise",
    "observer_gain",
    "margin",
    "keep_unseen",
)
"""Settings of a client, as arguments of `Runner`; ``planning_limit`` holds for both kinds."""


def velocities(twist: Twist) -> dict[str, float]:
    """The fields of a command; ``lateral`` only where it is not 0."""
    fields = asdict(twist)
    if not twist.lateral:
        del fields["lateral"]
    return fields


class PlanCount:
    """Numbers the plans that a policy shows, and says how old the present one is."""

    def __init__(self) -> None:
        self._plan: Plan | None = None
        self._number = 0
        self._since = 0.0

    def fields(self, plan: Plan | None, time: float, with_plan: bool) -> dict[str, Any]:
        """Return the fields of a reply about the plan that is followed at a time [s]."""
        if plan is not self._plan:
            self._plan = plan
            self._since = time
            self._number += plan is not None
        known = {
            "plan_number": 0 if plan is None else self._number,
            "plan_age": 0.0 if plan is None else time - self._since,
        }
        return {**known, "plan": plan_fields(plan)} if with_plan else known


class StepEpisode:
    """A policy in step with a simulator, which waits for each action.

    Args:
        policy: acts by the world alone.
        settings: of `SETTINGS`, as a client gave them.
    """

    missing: ClassVar[str] = "send 'reset' first; after 'start' only 'command' is answered"

    def __init__(self, policy: Policy, settings: Mapping[str, Any]) -> None:
        self._policy = policy
        self._token = Cancellation()
        limit = _limit(settings)
        self._executor = ImmediateExecutor(self._token if limit is None else self._token | limit)
        self._shows = policy if isinstance(policy, ShowsPlan) else None  # asking is not quick

    def begin(self, world: World, seed: int) -> dict[str, Any]:
        """Begin an episode, with the stream of random numbers that batches give this seed."""
        self._plans = PlanCount()
        self._policy.reset(world, stream(seed, "policy"))
        if isinstance(self._policy, PlansBesideDriving):
            self._policy.plan_with(self._executor)
        return {"type": "reset", "time": world.time}

    def act(self, world: World, with_plan: bool) -> dict[str, Any]:
        """The reply to a world."""
        action = self._policy.act(world, None)
        fields: dict[str, Any] = {"type": "action", "time": world.time, "twist": None}
        if isinstance(action, WheelSpeeds):
            fields["wheels"] = asdict(action)
        if "wheels" not in fields or world.robot.wheel_separation > 0.0:
            fields["twist"] = velocities(twist_of(world, action))
        plan = None if self._shows is None else self._shows.current_plan
        plans = self._plans.fields(plan, world.time, with_plan)
        return {**fields, "done": world.goal_reached, **plans}

    def abandon(self) -> None:
        """End the planning call that runs, from any thread."""
        self._token.cancel()

    def close(self) -> None:
        """Nothing is left to end."""


class LoopEpisode:
    """A policy in a `Runner`, beside a robot's own loop: planning has a thread of its own.

    Args:
        policy: a fresh one.
        settings: of `SETTINGS`, as a client gave them, and the period of the robot's loop [s].
    """

    missing: ClassVar[str] = "send 'start' first; after 'reset' only 'act' is answered"

    def __init__(self, policy: Policy, settings: Mapping[str, Any]) -> None:
        options = {key: value for key, value in settings.items() if key != "planning_limit"}
        limit = _limit(settings)
        stop = PLAN_STOP if limit is None else OwnBudget() | limit
        self._runner = Runner(policy, plan_stop=stop, **options)

    def begin(self, world: World, with_plan: bool) -> dict[str, Any]:
        """Begin an episode; the reply is the first command."""
        self._plans = PlanCount()
        return self._fields(self._runner.start(world), with_plan)

    def update(self, world: World) -> dict[str, Any]:
        """Take a snapshot."""
        return {"type": "updated", "taken": self._runner.update(world)}

    def command(self, now: float, with_plan: bool) -> dict[str, Any]:
        """Return the reply with the command to drive now."""
        return self._fields(self._runner.command(now), with_plan)

    def cancel(self, reason: str) -> dict[str, Any]:
        """Stop the robot."""
        self._runner.cancel(reason)
        return {"type": "cancelled"}

    def _fields(self, command: Command, with_plan: bool) -> dict[str, Any]:
        return {
            "type": "command",
            "time": command.time,
            "twist": velocities(command.twist),
            "status": command.status.value,
            "reason": command.reason,
            "world_age": command.world_age,
            "late": command.late,
            **self._plans.fields(command.plan, command.time, with_plan),
        }

    def abandon(self) -> None:
        """End the planning call that runs, from any thread."""
        self._runner.cancel("the client has left")

    def close(self) -> None:
        """End planning; returns when the call that runs has returned."""
        while not self._runner.close(1.0):
            pass


def _limit(settings: Mapping[str, Any]) -> Deadline | None:
    """The setting ``planning_limit`` [s], if it is given."""
    if "planning_limit" not in settings:
        return None
    limit = settings["planning_limit"]
    return Deadline(number("settings.planning_limit", limit, low=0.0, open_low=True))


def check_settings(policy: Policy, settings: object) -> dict[str, Any]:
    """The settings of a client, after a `Runner` has taken them.

    Raises:
        SchemaError: if a key is unknown.
        InvalidInputError: if a value is refused.
    """
    known_keys("settings", settings, SETTINGS, ())
    chosen = dict(expect("settings", settings, dict))
    LoopEpisode(policy, {"period": 1.0, **chosen}).close()
    return chosen
