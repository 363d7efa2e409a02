"""Messages from strangers: one short, clear error each, and the connection goes on."""

from __future__ import annotations

import json
import threading
import time
from typing import Any

import numpy as np
import pytest
from served import HELLO, PolicyClient, Raw, maze_dict, mutated, served

from pushplan.planners import make_policy
from pushplan.serving import ServerLimits
from pushplan.serving.session import Session

POSE = [11.25, 3.75, 1.57]
ACT: dict[str, Any] = {"type": "act", "time": 1.0, "robot_pose": POSE}
BOX = {"id": 9, "outline": [[-1, -1], [1, -1], [0, 2]], "pose": [9, 9, 0]}


def asked(*requests: Any) -> dict[str, Any]:
    """The reply to the last of some requests."""
    session, reply = Session(lambda: make_policy("straight"), "straight", ServerLimits()), b""
    for request in requests:
        body = request if isinstance(request, bytes) else json.dumps(request).encode()
        reply = session.answer(body).data
    session.close()
    return json.loads(reply[4:])


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
    assert "now went back from 0 s to -1 s" in refused(hello, start, {**command, "now": -1})
    assert "now must be a number" in refused(hello, start, {**command, "now": [1]})
    assert "'robot_pose' lacks" in refused(HELLO, reset, {"type": "act", "time": 1.0})
    assert "reason must be a text" in refused(hello, start, {"type": "cancel", "reason": 1})
    assert asked({"type": "close"})["type"] == "closed"


def test_a_file_on_the_machine_of_the_server_is_never_read(tmp_path, monkeypatch):
    def never(*_: Any, **__: Any) -> None:
        raise AssertionError("a file was opened")

    monkeypatch.setattr("pushplan.world.files.load_nav2_map", never)
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


def fuzz(address_of: Any, count: int) -> tuple[int, float]:
    """Send mutations of good messages; how many were accepted, and the slowest reply [s]."""
    rng, accepted, worst, raw = np.random.default_rng(0), 0, 0.0, None
    good = messages()
    for index in range(count):
        if raw is None or index % 100 == 0:
            if raw is not None:
                raw.socket.close()
            raw = Raw(address_of)
            raw.ask({**HELLO, "period": 0.1})
        body = good[int(rng.integers(len(good)))]
        broken = mutated(body, rng)
        began = time.monotonic()
        raw.send(broken)
        reply = raw.receive()
        worst = max(worst, time.monotonic() - began)
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
    return accepted, worst


@pytest.mark.filterwarnings("ignore")  # of NumPy, of strange numbers
@pytest.mark.parametrize("count", [300, pytest.param(10_000, marks=pytest.mark.slow)])
def test_mutated_messages_harm_nobody_else(count, tmp_path):
    with served("straight", tmp_path) as server:
        over, worst = threading.Event(), [0.0]

        def drive() -> None:
            with PolicyClient(server.address) as client:
                while not over.is_set():
                    client.reset(maze_dict())
                    for step in range(50):
                        began = time.monotonic()
                        client.act(time=0.1 * step, robot_pose=POSE)
                        worst[0] = max(worst[0], time.monotonic() - began)
                        over.wait(0.005)  # else it takes a core of its own

        other = threading.Thread(target=drive)
        other.start()
        try:
            accepted, slowest = fuzz(server, count)
        finally:
            over.set()
            other.join()
    assert 0 < accepted < count
    assert slowest < 10.0 and worst[0] < 5.0
