"""Messages from strangers: one short, clear error each, and the connection goes on."""

from __future__ import annotations

import copy
import functools
import json
import operator
import threading
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from served import HELLO, PolicyClient, Raw, Still, maze_dict, mutated, served

from pushplan.planners import make_policy
from pushplan.serving import ServerLimits
from pushplan.serving.session import Session

POSE = [11.25, 3.75, 1.57]
ACT: dict[str, Any] = {"type": "act", "time": 1.0, "robot_pose": POSE}
SLOW = {**maze_dict()["robot"], "max_speed": 1e-300}
BOX = {"id": 9, "outline": [[-1, -1], [1, -1], [0, 2]], "pose": [9, 9, 0]}


def asked(*requests: Any) -> dict[str, Any]:
    """The reply to the last of some requests."""
    session, reply = Session(lambda: make_policy("straight"), "straight", ServerLimits()), b""
    for request in requests:
        body = request if isinstance(request, bytes) else json.dumps(request).encode()
        reply = session.answer(body).data
    session.close()
    return json.loads(reply[4:])


def ask(session: Session, **request: Any) -> dict[str, Any]:
    """The reply of a session that goes on."""
    return json.loads(session.answer(json.dumps(request).encode()).data[4:])


def refused(*requests: Any) -> str:
    """The error after the last of some requests."""
    reply = asked(*requests)
    assert reply["type"] == "error" and not reply["closing"], reply
    assert 0 < len(reply["message"]) <= 300 and reply["message"].isprintable()
    return reply["message"]


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (b"", "not valid JSON"),
        (b"{", "not valid JSON"),
        (b"\xff\xfe", "JSON in UTF-8"),
        (b"[" * 1000, "nested 64 deep, got 1,000"),
        (b'{"a":' * 80 + b"1" + b"}" * 80, "nested 64 deep"),
        (b"[]", "must be a mapping, got []"),
        (b"7", "must be a mapping, got 7"),
        (b"9" * 500, "400 digits"),
        (b'{"type": "act", "type": "act"}', "'type' stands in one mapping twice"),
        (b"{}", "unknown message type None"),
        (b'{"type": ["act"]}', "unknown message type ['act']"),
        (b'{"type": "acted"}', "did you mean 'act'?"),
        (b'{"type": "\\u001b[2J\\ud800"}', "unknown message type"),
        (b'{"type": "act", "pose": 1}', "unknown key in message 'act' 'pose'; did you mean"),
        (b'{"type": "command"}', "lacks the required key 'now'"),
        (b'{"type": "act"}', "the first message must be 'hello', got 'act'"),
        (b'{"type": "hello"}', "lacks the required key 'protocol'"),
        (b'{"type": "hello", "protocol": "pushplan-serve/9"}', "speaks 'pushplan-serve/1', got"),
    ],
)
def test_what_is_no_message(body, said):
    assert said in refused(body)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"period": 0}, "period must lie in (0"),
        ({"period": "fast"}, "period must be a number, got 'fast'"),
        ({"period": True}, "period must be a number"),
        ({"period": float("nan")}, "period must lie in (0"),
        ({"settings": []}, "settings must be a mapping"),
        ({"settings": {"max_ages": 1}}, "did you mean 'max_age'?"),
        ({"settings": {"max_age": -1}}, "max_age must lie in (0"),
        ({"settings": {"on_stale": "go"}}, "(valid: continue, stop)"),
        ({"settings": {"planning_limit": 0}}, "planning_limit must lie in (0"),
        ({"robot": 3}, "robot must be a mapping, got 3"),
        ({"robot": {"mass": 1}}, "robot lacks the required key 'parts'"),
    ],
)
def test_a_wrong_hello(changes, said):
    assert said in refused({**HELLO, **changes})
    assert "hello was said already" in refused(HELLO, HELLO)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"seed": -1}, "seed must be at least 0, got -1"),
        ({"seed": 1.5}, "seed must be a whole number"),
        ({"world": 7}, "must be a mapping, got 7"),
        ({"world": maze_dict(schema="x/1")}, "reads schema 'pushplan-world/1', got 'x/1'"),
        ({"world": maze_dict(time=float("inf"))}, "time must be finite"),
        ({"world": maze_dict(time=10**400)}, "400 digits"),
        ({"world": maze_dict(time=10**350)}, "time must be finite"),
        ({"world": maze_dict(static={"map": "/etc/passwd"})}, "static.map names a file"),
        ({"world": maze_dict(static={"unknown": "free"})}, "static.map names a file"),
        ({"world": maze_dict(goal={"kind": "circle"})}, "unknown goal kind 'circle'"),
        ({"world": maze_dict(movables=[{**BOX, "id": 2**70}])}, "movables[0].id must"),
        ({"world": maze_dict(movables=[BOX, BOX])}, "movables.ids must be distinct"),
        ({"world": maze_dict(static={"bounds": [0, 0, 1e300, 1]})}, "static.bounds must be"),
        ({"world": maze_dict(static={"bounds": [0, 0, 9e5, 1]})}, "100,000 times as far apart"),
        ({"world": maze_dict(goal={"kind": "disc", "center": [0, 1e9], "radius": 1})}, "goal must"),
        ({"world": maze_dict(movables=[{**BOX, "mass": 1e-300}])}, "masses of objects must be at"),
        ({"world": maze_dict(robot=SLOW)}, "robot.max_speed must be at least 1e-09"),
    ],
)  # fmt: skip
def test_a_wrong_start(changes, said):
    assert said in refused(HELLO, {"type": "reset", "world": maze_dict(), **changes})


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"robot_pose": [1, 2, float("nan")]}, "robot_pose must be finite, got nan at index (2,)"),
        ({"robot_pose": [1, 2, float("-inf")]}, "robot_pose must be finite, got -inf"),
        ({"robot_pose": [1, 2]}, "robot_pose must have shape (3,), got (2,)"),
        ({"robot_pose": [1, 2, "east"]}, "robot_pose must be an array of float64"),
        ({"robot_pose": [1, 2, 10**320]}, "robot_pose must be"),
        ({"robot_pose": None}, "robot_pose must"),
        ({"robot_pose": [1e308, 0, 0]}, "robot_pose must be at most 1e+06 [m, rad], got 1e+308"),
        ({"robot_pose": [-9e5, 0, 0]}, "100,000 times as far apart"),
        ({"poses": [[1, 2, 3], [1, -1e9, 3]]}, "poses of objects must be at most 1e+06"),
        ({"robot_twist": [[1, 2, 3]]}, "robot_twist must have shape (3,), got (1, 3)"),
        ({"time": "now"}, "time must be a number, got 'now'"),
        ({"time": None}, "time must be a number, got None"),
        ({"with_plan": 1}, "with_plan must be true or false, got 1"),
        ({"poses": [[1, 2, 3]]}, "one row for each of 2 objects, got 1"),
        ({"poses": [[1, 2, 3], [1, 2]]}, "poses must be an array"),
        ({"ids": [0]}, "'ids' and 'twists' need 'poses'"),
        ({"ids": [5], "poses": [[1, 2, 3]]}, "ids[0] is 5, which no world had"),
        ({"ids": [1, 1], "poses": [[1, 2, 3]] * 2}, "ids must be distinct, got 1 more than once"),
        ({"ids": [0.5], "poses": [[1, 2, 3]]}, "ids must be an array of int64"),
        ({"ids": [2**80], "poses": [[1, 2, 3]]}, "ids must be an array of int64"),
        ({"twists": [[0, 0, 0]] * 3, "poses": [[1, 2, 3]] * 2}, "twists must have one row"),
        ({"added": [{**BOX, "id": 1}]}, "added has the id 1, which is known already"),
        ({"added": [{**BOX, "colour": 1}]}, "unknown key in movables[0] 'colour'"),
        ({"added": BOX}, "movables must be a list"),
        ({"world": maze_dict()}, "give either 'world' or 'time', not both"),
    ],
)
def test_a_wrong_world_after_it(changes, said):
    reset = {"type": "reset", "world": maze_dict()}
    assert said in refused(HELLO, reset, {**ACT, **changes})
    assert asked(HELLO, reset, {**ACT, **changes}, ACT)["type"] == "action"


def test_what_comes_in_the_wrong_order():
    hello = {**HELLO, "period": 0.1}
    start = {"type": "start", "world": maze_dict()}
    reset = {"type": "reset", "world": maze_dict()}
    command = {"type": "command", "now": 0.1}
    assert "send 'reset' first" in refused(HELLO, ACT)
    assert "send 'start' first" in refused(hello, command)
    assert "give the 'period' of the robot's loop" in refused(HELLO, start)
    assert "send 'start' first" in refused(hello, reset, command)
    assert "send 'reset' first" in refused(hello, start, ACT)
    stopped = asked(hello, start, {**command, "now": -1})
    assert stopped["status"] == "stale" and "went back by 1 s, to -1 s" in stopped["reason"]
    assert "now must be a number" in refused(hello, start, {**command, "now": [1]})
    assert "'robot_pose' lacks" in refused(HELLO, reset, {"type": "act", "time": 1.0})
    assert "reason must be a text" in refused(hello, start, {"type": "cancel", "reason": 1})
    assert asked({"type": "close"})["type"] == "closed"


def test_a_file_on_the_machine_of_the_server_is_never_read(tmp_path, monkeypatch):
    def never(*_: Any, **__: Any) -> None:
        raise AssertionError("a file was opened")

    monkeypatch.setattr("pushplan.world.stored.world_files.load_nav2_map", never)
    for static in ({"map": str(tmp_path)}, {"map": "x", "bounds": [0, 0, 1, 1]}, {"map": None}):
        assert "names a file" in refused(
            HELLO, {"type": "reset", "world": maze_dict(static=static)}
        )


def messages() -> list[bytes]:
    """Good messages of every kind."""
    added = {**ACT, "ids": [0], "poses": [[4, 9, 0.3]], "twists": [[0, 0, 0]], "added": [BOX]}
    return [
        json.dumps(one).encode()
        for one in (
            {**HELLO, "period": 0.1, "settings": {"max_age": 0.5, "on_stale": "stop"}},
            {"type": "reset", "world": maze_dict(), "seed": 3},
            {"type": "act", "world": maze_dict(time=1.0), "with_plan": True},
            {**ACT, "time": 2.0, "poses": [[4, 9, 0.3], [10, 12, 0]]},
            {**added, "time": 3.0},
            {"type": "start", "world": maze_dict()},
            {**ACT, "type": "update", "time": 4.0},
            {"type": "command", "now": 4.0, "with_plan": False},
            {"type": "cancel", "reason": "enough"},
        )
    ]


def fuzz(address_of: Any, count: int) -> int:
    """Send mutations of good messages, each of which gets a reply; how many were accepted."""
    rng, accepted, raw = np.random.default_rng(0), 0, None
    good = messages()
    for index in range(count):
        if raw is None or index % 100 == 0:
            if raw is not None:
                raw.socket.close()
            raw = Raw(address_of)
            raw.ask({**HELLO, "period": 0.1})
        body = good[int(rng.integers(len(good)))]
        broken = mutated(body, rng)
        raw.send(broken)
        reply = raw.receive()
        if reply is None or reply.get("closing"):
            assert reply is not None, broken[:3000]
            raw = None
        elif reply["type"] == "error":
            assert 0 < len(reply["message"]) <= 300 and reply["message"].isprintable(), broken
            assert "straight failed" not in reply["message"], (reply, broken[:3000])
        else:
            accepted += 1
            if reply["type"] == "closed":
                raw = None
        if index % 5 == 0 and raw is not None:
            raw.ask(good[int(rng.integers(1, len(good)))])
    assert raw is None or raw.socket.close() is None
    return accepted


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("count", [100, pytest.param(10_000, marks=pytest.mark.slow)])
def test_mutated_messages_harm_nobody_else(count, tmp_path):
    with served("straight", tmp_path) as server:
        over, driven = threading.Event(), []

        def drive() -> None:
            with PolicyClient(server.address) as client:
                while not over.is_set():
                    client.reset(maze_dict())
                    for step in range(50):
                        driven.append(client.act(time=0.1 * step, robot_pose=POSE)["twist"])
                        over.wait(0.005)  # else it takes a core of its own

        other = threading.Thread(target=drive)
        other.start()
        try:
            accepted = fuzz(server, count)
        finally:
            over.set()
            other.join()
    assert 0 < accepted < count
    assert len(driven) % 50 == 0 and driven == driven[:50] * (len(driven) // 50)


def _numbers(value: Any, *place: Any) -> Iterator[tuple[Any, ...]]:
    """The places of the numbers in nested lists and mappings."""
    if isinstance(value, dict | list):
        for key in value if isinstance(value, dict) else range(len(value)):
            yield from _numbers(value[key], *place, key)
    elif isinstance(value, float):
        yield place


WORLD = maze_dict()
WORLD["robot"] |= {"contact_radius": 0.02, "max_acceleration": 1.0, "max_turn_acceleration": 1.0}
WORLD["movables"][0]["contact_radius"] = 0.02


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("size", [pytest.param(1.7e308, marks=pytest.mark.slow), -1e154, 5e-324])
def test_numbers_without_sense_do_not_overflow(size):
    """Each number of a world in turn: it is refused by a rule, or the policy acts."""
    session = Session(lambda: make_policy("straight"), "straight", ServerLimits())
    replies = [ask(session, **HELLO)]
    for place in _numbers(WORLD):
        world = copy.deepcopy(WORLD)
        inner = functools.reduce(operator.getitem, place[:-1], world)
        inner[place[-1]] = size
        replies.append(ask(session, type="reset", world=world))
        if replies[-1]["type"] == "reset":
            replies.append(ask(session, **ACT))
        assert "failed" not in replies[-1].get("message", ""), (place, replies[-1])
    assert {one["type"] for one in replies} == {"hello", "reset", "action", "error"}


@pytest.mark.parametrize("kind", ["reset", "start"])
def test_an_episode_that_could_not_begin_is_none(kind):
    """No action comes from what a policy remembers of the episode before."""

    class Fails(Still):
        def reset(self, world, rng):
            if world.time == 7.0:
                raise ValueError("not this one")

    session = Session(Fails, "Fails", ServerLimits())
    following = {"reset": ACT, "start": {"type": "command", "now": 7.0}}[kind]
    assert ask(session, **HELLO, period=0.1)["type"] == "hello"
    reply = ask(session, type=kind, world=maze_dict())
    for step in range(1, 10_000):  # an episode begins when the call of the one before is over
        if reply.get("reason") != "a plan is on its way":
            break
        time.sleep(1e-3)
        reply = ask(session, type="command", now=1e-5 * step)
    assert reply["type"] in ("reset", "command")
    assert "not this one" in ask(session, type=kind, world=maze_dict(time=7.0))["message"]
    assert f"send '{kind}' first" in ask(session, **following)["message"]
    session.close()


def test_a_request_that_is_refused_changes_no_later_world():
    seen = []

    class Sees(Still):
        def act(self, world, observation):
            seen.append(world.movables.poses[:, 0].tolist())
            if world.time == 2.0:
                raise ValueError("not this one")
            return super().act(world, observation)

    session = Session(Sees, "Sees", ServerLimits())
    moved = {**ACT, "poses": [[1, 1, 0], [2, 2, 0]]}
    for request in (
        HELLO,
        {"type": "reset", "world": maze_dict()},
        ACT,
        {**moved, "time": 2.0, "added": [BOX]},
        {**moved, "time": 2.5, "twists": [[0, 0, 0]] * 3},
        {**ACT, "time": 3.0},
    ):
        ask(session, **request)
    assert len(seen) == 3 and seen[1] == [1.0, 2.0, 9.0] and seen[2] == seen[0]
