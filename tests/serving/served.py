"""What tests of the server share: the client that is shipped, raw bytes, slow policies."""

from __future__ import annotations

import json
import socket
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from conftest import make_robot, make_u_maze

from pushplan.planners import make_planner, policy_for
from pushplan.serving import PROTOCOL, PolicyServer, ServerLimits
from pushplan.world import Drive, Twist, World, world_to_dict

EXAMPLES = Path(__file__).parents[2] / "examples"
sys.path[:0] = [str(EXAMPLES), str(Path(__file__).parents[1] / "doors")]

from doors import mutated  # noqa: E402
from serve_client import PolicyClient, ServeError  # noqa: E402

__all__ = ["PolicyClient", "ServeError", "mutated"]
ROBOT = make_robot(drive=Drive.DIFFERENTIAL, max_speed=0.5, max_turn_rate=1.0)
HELLO = {"type": "hello", "protocol": PROTOCOL}


def maze(boxes: Any = ((4, 9, 0.3), (10, 12, 0.0)), **changes: Any) -> World:
    return make_u_maze(boxes, **{"robot": ROBOT, **changes})


def maze_dict(**changes: Any) -> dict[str, Any]:
    return {**world_to_dict(maze()), **changes}


@contextmanager
def served(policy: str | Callable[[], Any], folder: Path, **options: Any) -> Iterator[PolicyServer]:
    """A server at a Unix socket in a folder; nothing of it may be left."""
    options["limits"] = ServerLimits(**options.get("limits", {}))
    before = set(threading.enumerate())
    with PolicyServer(policy, f"unix:{folder / 's'}", **options) as server:
        yield server
    assert not (folder / "s").exists()
    until(lambda: set(threading.enumerate()) <= before)


def until(condition: Callable[[], object], seconds: float = 60.0) -> None:
    """Wait for another thread."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.005)


class Raw:
    """A connection of bytes."""

    def __init__(self, server: PolicyServer) -> None:
        kind, _, where = server.address.partition(":")
        tcp = kind == "tcp"
        self.socket = socket.socket(socket.AF_INET if tcp else socket.AF_UNIX)
        self.socket.settimeout(30.0)
        self.socket.connect(("127.0.0.1", int(where.rpartition(":")[2])) if tcp else where)

    def __enter__(self) -> Raw:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def send(self, *bodies: bytes | dict[str, Any]) -> None:
        """Send messages, in one go."""
        data = [one if isinstance(one, bytes) else json.dumps(one).encode() for one in bodies]
        self.socket.sendall(b"".join(struct.pack(">I", len(one)) + one for one in data))

    def receive(self) -> dict[str, Any] | None:
        """The next message; None at the end."""
        head = self._exactly(4)
        return None if head is None else json.loads(self._exactly(*struct.unpack(">I", head)))

    def ask(self, body: bytes | dict[str, Any]) -> dict[str, Any]:
        self.send(body)
        reply = self.receive()
        assert reply is not None
        return reply

    def _exactly(self, count: int) -> bytes | None:
        data = b""
        while len(data) < count:
            part = self.socket.recv(count - len(data))
            if not part:
                return None
            data += part
        return data


class Patient:
    """The planner `straight`; after `hold` a call takes until `go`, or until its rule says stop."""

    def __init__(self) -> None:
        self.go, self.inside, self.stopped = threading.Event(), threading.Event(), False
        self.go.set()

    def __call__(self) -> Any:
        """Another policy around it."""
        return policy_for(self)

    def plan(self, world: World, *, stop: Any = None, rng: Any = None) -> Any:
        check = stop.start() if stop is not None else lambda *_: False
        self.inside.set()
        while not self.go.wait(0.005):
            if check(0, np.inf):
                self.stopped = True
                break
        return make_planner("straight").plan(world, stop=stop, rng=rng)

    def hold(self) -> None:
        """Let planning take long from now on; until then it took no time, as in a warm-up."""
        self.go.clear()
        self.inside.clear()


class Still:
    """A policy that stands, or does what a test tells it to."""

    does: Callable[[], Any] = staticmethod(lambda: Twist(0.0, 0.0))

    def reset(self, world: World, rng: np.random.Generator) -> None:
        pass

    def act(self, world: World, observation: Any) -> Any:
        return self.does()
