"""`Session`: the requests of one client, one after another, and its two kinds of episodes."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import asdict
from traceback import format_tb
from typing import Any, ClassVar, NamedTuple, TypeVar

from pushplan import __version__
from pushplan.control import ImmediateExecutor
from pushplan.errors import describe, one_line, short
from pushplan.files.safe_files import MAX_VALUES, known_keys
from pushplan.files.safe_yaml import MAX_DEPTH
from pushplan.runtime import PLAN_STOP, Command, Runner
from pushplan.runtime.held_actions import check_world_policy, twist_of
from pushplan.serving import messages
from pushplan.serving.connection import ServerLimits
from pushplan.serving.messages import plan_fields
from pushplan.serving.world_feed import WorldFeed
from pushplan.world import (
    Cancellation,
    Deadline,
    InvalidInputError,
    OwnBudget,
    Plan,
    PlansBesideDriving,
    Policy,
    PushplanError,
    ShowsPlan,
    Twist,
    WheelSpeeds,
    World,
    stream,
)
from pushplan.world.checks import boolean, expect, integer, number, word
from pushplan.world.policy_abilities import action_modes
from pushplan.world.stored.world_files import SCHEMA

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
LOG = logging.getLogger("pushplan.serving")
QUICK_BYTES = 20_000
"""Longest message that is answered without a thread; reading a longer one takes time."""
_GOALS = {"robot": ("disc", "pose", "line"), "objects": ("receptacle", "clearance_area")}
Fields = dict[str, Any]


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


_Kind = TypeVar("_Kind", StepEpisode, LoopEpisode)


class Answer(NamedTuple):
    """A reply as it is sent, and whether it is the last one."""

    data: bytes
    last: bool = False


class Session:
    """A client's policy and episode. All but `abandon` is called one after another.

    Attributes:
        greeted: the client has said hello.
        busy: a message is being answered.
        abandoned: planning was ended from outside, so that what is answered is void.

    Args:
        make_policy: makes the client's own policy.
        label: what clients are told that the policy is called.
        limits: that clients are told.
    """

    def __init__(self, make_policy: Callable[[], Policy], label: str, limits: ServerLimits) -> None:
        self._make_policy = make_policy
        self._label = label
        self._limits = limits
        self._feed = WorldFeed()
        self._settings: Fields = {}
        self._episode: StepEpisode | LoopEpisode | None = None
        self.greeted = self.busy = self.abandoned = False

    def answer(self, body: bytes) -> Answer:
        """The reply to the body of a message: an error where the message is wrong.

        Whatever a policy raises becomes an error for its client. A request that gets an error
        leaves the known world as it was.
        """
        kind: str | None = None
        before = copy(self._feed)
        self.busy = True
        try:
            request = messages.decode(body)
            kind = request["type"]
            if not self.greeted and kind not in ("hello", "close"):
                raise InvalidInputError(f"the first message must be 'hello', got {kind!r}")
            reply = getattr(self, f"_{kind}")(request)
            return Answer(messages.encode(reply), kind == "close")
        except PushplanError as error:
            said = f"{kind}: {error}" if kind else str(error)
        except BaseException as error:  # of a policy, of any kind: its thread goes on
            said = f"{kind}: {self._label} failed: {describe(error)}"
            LOG.warning("%s\n%s", said, "".join(format_tb(error.__traceback__)))
        finally:
            self.busy = False
        self._feed = before
        return Answer(messages.error(said, kind))

    def is_quick(self, body: bytes) -> bool:
        """True for a short message of a robot's loop, whose answer waits for nothing."""
        if len(body) > QUICK_BYTES or not isinstance(self._episode, LoopEpisode):
            return False
        try:
            return messages.decode(body)["type"] in ("update", "command", "cancel")
        except PushplanError:
            return True  # the answer says what is wrong

    def abandon(self) -> None:
        """End the planning call that runs, because the client has left; from any thread."""
        self.abandoned = True
        if self._episode is not None:
            self._episode.abandon()

    def close(self) -> None:
        """End the episode."""
        if self._episode is not None:
            self._episode.close()
            self._episode = None

    def _hello(self, request: Fields) -> Fields:
        if self.greeted:
            raise InvalidInputError("hello was said already; connect once more to begin anew")
        if request["protocol"] != messages.PROTOCOL:
            raise InvalidInputError(
                f"this server speaks {messages.PROTOCOL!r}, got {short(request['protocol'])}"
            )
        period = request.get("period")
        if period is not None:
            period = number("period", period, low=0.0, open_low=True)
        feed = WorldFeed(request.get("robot"))
        policy = self._make_policy()
        check_world_policy(policy)
        settings = check_settings(policy, request.get("settings", {}))
        self._feed = feed
        self._settings = {"period": period, **settings}
        self.greeted = True
        goals = _GOALS.get(getattr(policy, "goal_kind", ""), sum(_GOALS.values(), ()))
        return {
            "type": "hello",
            "protocol": messages.PROTOCOL,
            "version": __version__,
            "policy": self._label,
            "actions": list(action_modes(policy)),
            "goals": list(goals),
            "world_schema": SCHEMA,
            "period": period,
            "settings": settings,
            "limits": {
                "message_bytes": self._limits.message_bytes,
                "values": MAX_VALUES,
                "depth": MAX_DEPTH,
                "message_s": self._limits.message_s,
                "idle_s": self._limits.idle_s,
            },
        }

    def _reset(self, request: Fields) -> Fields:
        seed = integer("seed", request.get("seed", 0), low=0)
        return self._begin(StepEpisode, self._feed.whole(request["world"]), seed)

    def _start(self, request: Fields) -> Fields:
        if self._settings["period"] is None:
            raise InvalidInputError("give the 'period' of the robot's loop [s] in hello")
        with_plan = _with_plan(request)
        return self._begin(LoopEpisode, self._feed.whole(request["world"]), with_plan)

    def _begin(
        self, kind: type[StepEpisode] | type[LoopEpisode], world: World, option: Any
    ) -> Fields:
        """Begin an episode of a kind; leave none behind that has begun by half."""
        episode = self._episode
        if not isinstance(episode, kind):
            episode = kind(self._make_policy(), self._settings)
            self.close()
            self._episode = episode
            if self.abandoned:  # meanwhile
                episode.abandon()
        try:
            return episode.begin(world, option)
        except BaseException:
            self.close()
            raise

    def _act(self, request: Fields) -> Fields:
        episode = self._running(StepEpisode)
        with_plan = _with_plan(request)
        return episode.act(self._feed.next(request), with_plan)

    def _update(self, request: Fields) -> Fields:
        episode = self._running(LoopEpisode)
        return episode.update(self._feed.next(request))

    def _command(self, request: Fields) -> Fields:
        episode = self._running(LoopEpisode)
        now = number("now", request["now"])
        return episode.command(now, _with_plan(request))

    def _cancel(self, request: Fields) -> Fields:
        episode = self._running(LoopEpisode)
        reason = one_line(word("reason", request.get("reason", "cancelled")))
        return episode.cancel(reason)

    def _close(self, request: Fields) -> Fields:
        return {"type": "closed"}

    def _running(self, kind: type[_Kind]) -> _Kind:
        if not isinstance(self._episode, kind):
            raise InvalidInputError(kind.missing)
        return self._episode


def _with_plan(request: Fields) -> bool:
    return boolean("with_plan", request.get("with_plan", False))
