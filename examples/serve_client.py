"""A client of ``pushplan serve`` in one file, for Python 3.8 and newer; it needs nothing else.

Copy it into the environment of your simulator or robot. ``PolicyClient`` is all you need; the rest
is a small simulated robot to try it with::

    pushplan serve push-aware --socket unix:/tmp/push.sock
    python serve_client.py unix:/tmp/push.sock

Without an address it starts ``pushplan serve straight`` itself. The messages are described in
docs/serve.md.
"""

from __future__ import annotations

import json
import math
import os
import re
import socket
import struct
import subprocess
import sys
import tempfile
from typing import Any

PROTOCOL = "pushplan-serve/1"
Message = dict  # of texts, numbers, lists and mappings, as JSON has them


class ServeError(Exception):
    """The server has refused a message; its text says why."""


class PolicyClient:
    """A connection to a policy server.

    A simulator that waits for each action calls `reset` and `act`. A robot's own loop gives a
    ``period`` and calls `start`, `update` and `command`. Units are SI and radians; a pose is
    ``[x, y, theta]``, x forward and y left. A world is a mapping as in docs/world-file.md.

    Args:
        address: ``"unix:PATH"`` or ``"tcp:HOST:PORT"``.
        period: of the robot's loop [s].
        settings: of the robot's loop, as in docs/serve.md.
        robot: the key ``robot`` of the worlds, which then need only its ``pose`` and ``twist``.
        timeout: for how long a reply may take [s]; None waits as long as it takes.

    Attributes:
        server: what the server has said of itself.

    Raises:
        ServeError: if the server refuses.
        OSError: if there is no server, or it has gone.
    """

    def __init__(
        self,
        address: str,
        period: float | None = None,
        settings: Message | None = None,
        robot: Message | None = None,
        timeout: float | None = None,
    ) -> None:
        kind, _, where = address.partition(":")
        if kind == "unix":
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            self._socket.settimeout(timeout)
            self._socket.connect(where)
        elif kind == "tcp":
            host, _, port = where.rpartition(":")
            self._socket = socket.create_connection((host.strip("[]"), int(port)), timeout)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        else:
            raise ValueError(f"an address is unix:PATH or tcp:HOST:PORT, got {address!r}")
        hello = {"type": "hello", "protocol": PROTOCOL, "settings": settings or {}}
        if period is not None:
            hello["period"] = period
        if robot is not None:
            hello["robot"] = robot
        try:
            self.server = self.request(hello)
        except BaseException:
            self._socket.close()
            raise

    def reset(self, world: Message, seed: int = 0) -> Message:
        """Begin an episode in step with a simulator; the world is a whole one."""
        return self.request({"type": "reset", "world": world, "seed": seed})

    def act(self, with_plan: bool = False, **world: Any) -> Message:
        """The action for a world, as `update` takes it; waits while the policy plans."""
        return self.request({"type": "act", "with_plan": with_plan, **world})

    def start(self, world: Message, with_plan: bool = False) -> Message:
        """Begin an episode of a robot's own loop; gives the first command."""
        return self.request({"type": "start", "world": world, "with_plan": with_plan})

    def update(self, **world: Any) -> Message:
        """Send what is seen.

        Args:
            world: ``world=...``, a whole one; or ``time`` and ``robot_pose``, and what else has
                changed: ``robot_twist``, ``poses`` of the objects and their ``ids``, ``twists``,
                and in ``added`` objects that were not there before.
        """
        return self.request({"type": "update", **world})

    def command(self, now: float, with_plan: bool = False) -> Message:
        """What to drive now, by the clock of the worlds [s]; never waits for planning."""
        return self.request({"type": "command", "now": now, "with_plan": with_plan})

    def cancel(self, reason: str = "cancelled") -> Message:
        """Bring the robot to a stop; `start` begins anew."""
        return self.request({"type": "cancel", "reason": reason})

    def close(self) -> None:
        """End the episode and the connection."""
        try:
            self.request({"type": "close"})
        except (OSError, ServeError):
            pass  # it has gone already
        finally:
            self._socket.close()

    def __enter__(self) -> PolicyClient:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def request(self, message: Message) -> Message:
        """Send a message and give its reply."""
        body = json.dumps(message).encode("ascii")
        try:
            self._socket.sendall(struct.pack(">I", len(body)) + body)
        except (BrokenPipeError, ConnectionResetError):
            pass  # the server has ended the connection; its last message says why
        (length,) = struct.unpack(">I", self._receive(4))
        reply = json.loads(self._receive(length).decode("utf-8"))
        if reply["type"] == "error":
            raise ServeError(reply["message"])
        return reply

    def _receive(self, count: int) -> bytes:
        parts = []
        while count:
            part = self._socket.recv(min(count, 65536))
            if not part:
                raise ConnectionError("the server has ended the connection")
            parts.append(part)
            count -= len(part)
        return b"".join(parts)


PERIOD = 0.1  # [s]
SQUARE = [[-0.2, -0.2], [0.2, -0.2], [0.2, 0.2], [-0.2, 0.2]]
ROOM = {
    "schema": "pushplan-world/1",
    "robot": {
        "drive": "differential",
        "mass": 1.0,
        "max_speed": 0.5,
        "max_turn_rate": 2.0,
        "parts": [[[0.15, 0.1], [-0.15, 0.1], [-0.15, -0.1], [0.15, -0.1]]],
        "pose": [1.0, 1.0, 0.0],
    },
    "static": {"bounds": [0, 0, 5, 5], "polygons": [[[2, 0.5], [3, 0.5], [3, 3], [2, 3]]]},
    "movables": [{"id": 7, "outline": SQUARE, "pose": [1.5, 2.5, 0.3], "mass": 0.5}],
    "goal": {"kind": "disc", "center": [4.0, 1.0], "radius": 0.3},
}


def drive(client: PolicyClient, steps: int = 600) -> int:
    """Drive a simulated robot to the goal of `ROOM`; objects stay where they are.

    Returns:
        How many steps that took; ``steps`` if it is not there by then.
    """
    x, y, theta = ROOM["robot"]["pose"]
    client.reset(ROOM)
    for step in range(steps):
        answer = client.act(time=step * PERIOD, robot_pose=[x, y, theta], poses=[[1.5, 2.5, 0.3]])
        if answer["done"]:
            return step
        speed, turn_rate = answer["twist"]["linear"], answer["twist"]["angular"]
        if step % 20 == 0:
            sys.stdout.write(f"{step * PERIOD:5.1f} s  at ({x:.2f}, {y:.2f})  {speed:.2f} m/s\n")
        x += speed * PERIOD * math.cos(theta + 0.5 * turn_rate * PERIOD)
        y += speed * PERIOD * math.sin(theta + 0.5 * turn_rate * PERIOD)
        theta += turn_rate * PERIOD
    return steps


def main() -> None:
    """Drive with the server at an address, or with one that is started for it."""
    if len(sys.argv) > 1:
        with PolicyClient(sys.argv[1]) as client:
            steps = drive(client)
            sys.stdout.write(f"{client.server['policy']}: {steps} steps\n")
        return
    with tempfile.TemporaryDirectory() as folder:
        sys.argv.append("unix:" + os.path.join(folder, "policy.sock"))
        command = [sys.executable, "-m", "pushplan", "serve", "straight", "--socket", sys.argv[1]]
        server = subprocess.Popen(command, stdout=subprocess.PIPE, universal_newlines=True)
        try:
            if re.search("unix:", server.stdout.readline()):  # it says so when it listens
                main()
        finally:
            server.terminate()
            server.wait()


if __name__ == "__main__":
    main()
