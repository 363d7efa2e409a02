"""Clients that leave, crowd, dawdle or send nonsense harm nobody else."""

from __future__ import annotations

import socket
import struct
import threading
import time

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

ACT = {"type": "act", "time": 0.0, "robot_pose": [11.25, 3.75, 1.57]}


def test_a_client_that_leaves_amid_planning_ends_the_call_and_frees_its_place(tmp_path):
    planner = Patient()
    with served(planner, tmp_path, limits={"clients": 1}) as server:
        planner.hold()
        raw = Raw(server)
        raw.send(HELLO)
        raw.send({"type": "reset", "world": maze_dict()})
        raw.send(ACT)
        assert planner.inside.wait(10.0) and server.clients == 1
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
        with Raw(server) as busy, PolicyClient(server.address, timeout=5.0) as other:
            for message in (HELLO, {"type": "reset", "world": maze_dict()}, ACT):
                busy.send(message)
            assert planner.inside.wait(10.0)
            other.reset(maze_dict())
            planner.go.set()
            assert [busy.receive()["type"] for _ in range(3)] == ["hello", "reset", "action"]


def test_the_end_of_the_server_ends_planning_and_tells_clients(tmp_path):
    planner = Patient()
    with served(planner, tmp_path) as server, Raw(server) as raw:
        planner.hold()
        for message in (HELLO, {"type": "reset", "world": maze_dict()}, ACT):
            raw.send(message)
        assert planner.inside.wait(10.0)
        assert server.close() and planner.stopped
        replies = list(iter(raw.receive, None))  # to the action it may still reply
        assert [one["type"] for one in replies][:2] == ["hello", "reset"] and len(replies) <= 3


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


def test_a_byte_at_a_time_is_too_slow(tmp_path):
    with served("straight", tmp_path, limits={"message_s": 0.3, "idle_s": 0.4}) as server:
        with Raw(server) as slow, PolicyClient(server.address) as quick:
            quick.reset(maze_dict())
            began, reply = time.monotonic(), None
            slow.socket.sendall(struct.pack(">I", 100))
            slow.socket.settimeout(0.05)
            while reply is None and time.monotonic() < began + 5.0:
                try:
                    slow.socket.sendall(b" ")
                    reply = slow.receive()
                except TimeoutError:
                    quick.act(time=time.monotonic(), robot_pose=[1, 1, 0])
            assert "whole 0.3 s after its first byte" in reply["message"] and reply["closing"]
        with Raw(server) as silent:
            assert "no message came for 0.3 s" in silent.receive()["message"]
        with Raw(server) as silent:
            assert silent.ask(HELLO)["type"] == "hello"
            assert "no message came for 0.4 s" in silent.receive()["message"]
        until(lambda: server.clients == 0)


def test_silence_while_a_reply_is_awaited_is_no_silence(tmp_path):
    class Thinks(Still):
        def act(self, world, observation):
            time.sleep(0.6)
            return super().act(world, observation)

    with served(Thinks, tmp_path, limits={"message_s": 0.2, "idle_s": 0.2}) as server:
        with Raw(server) as raw:
            raw.send(HELLO)
            raw.send({"type": "reset", "world": maze_dict()})
            raw.send(ACT)
            assert [raw.receive()["type"] for _ in range(3)] == ["hello", "reset", "action"]


def test_a_client_that_does_not_read_is_cut_off(tmp_path):
    with served("straight", tmp_path, limits={"message_s": 0.3}) as server, Raw(server) as raw:
        raw.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        raw.socket.settimeout(5.0)
        raw.send(HELLO)
        raw.send({"type": "reset", "world": maze_dict()})
        with pytest.raises((BrokenPipeError, ConnectionResetError)):
            while True:
                raw.send({**ACT, "with_plan": True})
        until(lambda: server.clients == 0)


def test_a_policy_that_cannot_be_interrupted_keeps_its_place_until_it_returns(tmp_path):
    inside, go = threading.Event(), threading.Event()

    class Slow(Still):
        def act(self, world, observation):
            inside.set()
            assert go.wait(10.0)
            return super().act(world, observation)

    go.set()
    with served(Slow, tmp_path, limits={"clients": 1}) as server:
        go.clear()
        with Raw(server) as raw:
            for message in (HELLO, {"type": "reset", "world": maze_dict()}, ACT):
                raw.send(message)
            assert inside.wait(10.0)
        with pytest.raises(ServeError, match="which is its limit"):
            PolicyClient(server.address)
        go.set()
        until(lambda: server.clients == 0)
        PolicyClient(server.address).close()
