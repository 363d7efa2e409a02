"""`Session`: the requests of one client, answered one after another."""

from __future__ import annotations

import logging
from collections.abc import Callable
from copy import copy
from traceback import format_tb
from typing import Any, NamedTuple, TypeVar

from pushplan import __version__
from pushplan.errors import describe, one_line, short
from pushplan.files.safe_files import MAX_VALUES
from pushplan.files.safe_yaml import MAX_DEPTH
from pushplan.runtime.held_actions import check_world_policy
from pushplan.serving import messages
from pushplan.serving.connection import ServerLimits
from pushplan.serving.episodes import LoopEpisode, StepEpisode, check_settings
from pushplan.serving.world_feed import WorldFeed
from pushplan.world import InvalidInputError, Policy, PushplanError, World
from pushplan.world.checks import boolean, integer, number, word
from pushplan.world.policy_abilities import action_modes
from pushplan.world.stored.world_files import SCHEMA

LOG = logging.getLogger("pushplan.serving")
QUICK_BYTES = 20_000
"""Longest message that is answered without a thread; reading a longer one takes time."""
_GOALS = {"robot": ("disc", "pose", "line"), "objects": ("receptacle", "clearance_area")}
Fields = dict[str, Any]
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
