"""Clients that leave, crowd, dawdle or send nonsense harm nobody else."""

from __future__ import annotations

import asyncio
import socket
import struct
import threading
import time
from collections.abc import Awaitable, Callable

import pytest
from served import (
    HELLO,
    Patient,
    PolicyClient,
    Raw,
    ServeError,
    Still,
    maze_dict,
    served,
    until,
)

from pushplan.serving import PolicyServer, ServerLimits
from pushplan.serving.connection import Connection, RefusedError

ACT = {"type": "act", "time": 0.0, "robot_pose": [11.25, 3.75, 1.57]}


def test_a_client_that_leaves_amid_planning_ends_the_call_and_frees_its_place(tmp_path):
    planner = Patient()
    with served(planner, tmp_path, limits={"clients": 1}) as server:
        planner.hold()
        raw = Raw(server)
        raw.send(HELLO, {"type": "reset", "world": maze_dict()}, ACT)
        assert planner.inside.wait(60.0) and server.clients == 1
        raw.socket.close()
        until(lambda: server.clients == 0)
        assert planner.stopped
        planner.go.set()
        with PolicyClient(server.address) as client:
            client.reset(maze_dict())


def test_planning_for_one_client_does_not_keep_another_waiting(tmp_path):
    planner = Patient()
    with served(planner, tmp_path) as server:
        planner.hold()
        with Raw(server) as busy, PolicyClient(server.address, timeout=60.0) as other:
            busy.send(HELLO, {"type": "reset", "world": maze_dict()}, ACT)
            assert planner.inside.wait(60.0)
            other.reset(maze_dict())
            planner.go.set()
            assert [busy.receive()["type"] for _ in range(3)] == ["hello", "reset", "action"]


def test_the_end_of_the_server_ends_planning_and_tells_clients(tmp_path):
    planner = Patient()
    with served(planner, tmp_path) as server, Raw(server) as raw:
        planner.hold()
        raw.send(HELLO, {"type": "reset", "world": maze_dict()}, ACT)
        assert planner.inside.wait(60.0)
        assert server.close() and planner.stopped
        assert [one["type"] for one in iter(raw.receive, None)] == ["hello", "reset"]


def test_one_client_too_many_is_told_so(tmp_path):
    with served("straight", tmp_path, limits={"clients": 2}) as server:
        first, second = PolicyClient(server.address), PolicyClient(server.address)
        with pytest.raises(ServeError, match="has 2 clients, which is its limit"):
            PolicyClient(server.address)
        first.close()
        until(lambda: server.clients == 1)
        PolicyClient(server.address).close()
        second.close()


def test_messages_are_bounded_in_length_before_they_are_read(tmp_path):
    with served("straight", tmp_path, limits={"message_bytes": 5000}) as server:
        for head, said in (
            (
                struct.pack(">I", 5001),
                "may have 5,000 bytes, the length before this one says 5,001",
            ),
            (b"\xff\xff\xff\xff", "4,294,967,295"),
            (b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n", "5,000 bytes"),
        ):
            with Raw(server) as raw:
                raw.socket.sendall(head)
                reply = raw.receive()
                assert reply["type"] == "error" and said in reply["message"] and reply["closing"]
                assert raw.receive() is None
        with Raw(server) as raw:
            assert raw.ask({**HELLO, "settings": {"x" * 4000: 1}})["type"] == "error"
            assert raw.ask(HELLO)["type"] == "hello"
        with PolicyClient(server.address) as client, pytest.raises(ServeError, match="5,000 bytes"):
            client.request({"type": "cancel", "reason": "x" * 3_000_000})


def connected(attend: Callable[[Connection, socket.socket], Awaitable[None]]) -> None:
    """Run a test with the server's side of a connection, of short limits, and the client's."""

    async def run() -> None:
        ours, theirs = socket.socketpair()
        with theirs:
            limits = ServerLimits(message_s=0.2, idle_s=0.1)
            connection = Connection(*await asyncio.open_connection(sock=ours), limits)
            await attend(connection, theirs)
            connection.cut()

    asyncio.run(run())


def test_a_byte_at_a_time_is_too_slow():
    async def attend(connection: Connection, client: socket.socket) -> None:
        connection.greeted()

        async def dribble() -> None:
            client.sendall(struct.pack(">I", 1_000_000))
            while True:
                await asyncio.sleep(0.01)
                client.sendall(b" ")

        task = asyncio.create_task(dribble())
        with pytest.raises(RefusedError, match=r"whole 0\.2 s after its first byte"):
            await connection.read()
        task.cancel()

    connected(attend)


def test_silence_has_a_limit_and_until_hello_another():
    async def attend(connection: Connection, client: socket.socket) -> None:
        client.sendall(b"\0\0\0\2{}")
        assert await connection.read() == b"{}"
        await asyncio.sleep(0.2)
        client.sendall(b"\0\0\0\2{}")
        with pytest.raises(RefusedError, match=r"no valid hello came within 0\.2 s"):
            await connection.read()
        connection.greeted()
        assert await connection.read() == b"{}"
        with pytest.raises(RefusedError, match=r"no message came for 0\.1 s"):
            await connection.read()

    connected(attend)


def test_a_client_that_does_not_read_has_left():
    async def attend(connection: Connection, client: socket.socket) -> None:
        with pytest.raises(OSError):
            await connection.write(b" " * 50_000_000)

    connected(attend)


@pytest.mark.parametrize("sent", [b"", b"\0", b"\0\0\0\2{}", b"\0\0\0\2{}" * 50])
def test_whoever_says_no_hello_soon_loses_its_place(sent, tmp_path):
    with served("straight", tmp_path, limits={"clients": 2, "message_s": 0.3}) as server:
        crowd = [Raw(server), Raw(server)]
        for one in crowd:
            one.socket.sendall(sent)
        for one in crowd:
            *errors, last = iter(one.receive, None)
            assert not any(error["closing"] for error in errors)
            assert "no valid hello came within 0.3 s" in last["message"] and last["closing"]
            one.socket.close()
        until(lambda: server.clients == 0)


def test_a_client_that_is_sent_away_frees_its_place_at_once(tmp_path):
    with served("straight", tmp_path, limits={"clients": 1}) as server:
        with Raw(server) as rude:
            rude.socket.sendall(b"\xff" * 4)
            assert rude.receive()["closing"] and server.clients == 0  # it holds on to the socket
            with Raw(server) as cut:
                cut.socket.sendall(struct.pack(">I", 100) + b"{")
                cut.socket.shutdown(socket.SHUT_WR)
                assert "closed amid a message" in cut.receive()["message"]
            PolicyClient(server.address).close()


def test_a_client_that_sends_no_more_still_gets_the_action_it_asked_for(tmp_path):
    planner = Patient()
    with served(planner, tmp_path) as server:
        with Raw(server) as whole:
            for message in (HELLO, {"type": "reset", "world": maze_dict()}):
                whole.ask(message)
            expected = whole.ask(ACT)
        planner.hold()
        with Raw(server) as half:
            half.send(HELLO, {"type": "reset", "world": maze_dict()}, ACT, {**ACT, "time": 1})
            half.socket.shutdown(socket.SHUT_WR)
            assert planner.inside.wait(60.0)
            server._look()  # as its listener does ten times a second
            planner.go.set()
            replies = list(iter(half.receive, None))
        assert [one["type"] for one in replies] == ["hello", "reset", "action", "action"]
        assert replies[2] == expected and not planner.stopped


def test_over_tcp_it_gets_an_error_and_no_other_action():
    planner = Patient()
    with PolicyServer(planner, "tcp:127.0.0.1:0") as server:
        planner.hold()
        with Raw(server) as half:
            for message in (HELLO, {"type": "reset", "world": maze_dict()}):
                half.ask(message)
            half.send(ACT, ACT)
            half.socket.shutdown(socket.SHUT_WR)
            *replies, last = iter(half.receive, None)
        assert replies == [] and planner.stopped
        assert "planning was ended" in last["message"] and last["closing"]
        until(lambda: server.clients == 0)


def test_silence_while_a_reply_is_awaited_is_no_silence(tmp_path):
    class Thinks(Still):
        def act(self, world, observation):
            time.sleep(0.3)
            return super().act(world, observation)

    with served(Thinks, tmp_path, limits={"idle_s": 0.1}) as server, Raw(server) as raw:
        raw.send(HELLO, {"type": "reset", "world": maze_dict()}, ACT)
        assert [raw.receive()["type"] for _ in range(3)] == ["hello", "reset", "action"]


def test_a_policy_that_cannot_be_interrupted_keeps_its_place_until_it_returns(tmp_path):
    inside, go = threading.Event(), threading.Event()

    class Slow(Still):
        def act(self, world, observation):
            inside.set()
            assert go.wait(60.0)
            return super().act(world, observation)

    go.set()
    with served(Slow, tmp_path, limits={"clients": 1}) as server:
        go.clear()
        with Raw(server) as raw:
            raw.send(HELLO, {"type": "reset", "world": maze_dict()}, ACT)
            assert inside.wait(60.0)
        with pytest.raises(ServeError, match="which is its limit"):
            PolicyClient(server.address)
        go.set()
        until(lambda: server.clients == 0)
        PolicyClient(server.address).close()


def test_a_policy_that_hangs_does_not_keep_the_server_from_ending(tmp_path, monkeypatch, caplog):
    monkeypatch.setattr("pushplan.serving.server._GRACE_S", 0.2)
    inside, go = threading.Event(), threading.Event()

    class Hangs(Still):
        def act(self, world, observation):
            inside.set()
            go.wait(60.0)
            return super().act(world, observation)

    go.set()
    server = PolicyServer(Hangs, f"unix:{tmp_path / 's'}")
    server.start()
    go.clear()
    inside.clear()
    with Raw(server) as raw:
        raw.send(HELLO, {"type": "reset", "world": maze_dict()}, ACT)
        assert inside.wait(60.0)
        assert not server.close()
    go.set()
    assert [one.message for one in caplog.records if one.levelname != "INFO"] == [
        "client 1: the policy has not returned from its planning call"
    ]
