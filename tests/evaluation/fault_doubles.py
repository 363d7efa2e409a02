"""Policies that harm more than themselves, on purpose."""

from __future__ import annotations

import contextlib
import mmap
import os
import pickle
import resource
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from evaluation_doubles import Ahead, LineEnv

from pushplan.world import World

HERE = __file__
NOTE = "PUSHPLAN_TEST_NOTE"
"""Environment variable: a file for what a policy leaves behind."""


class Surrogate(Ahead):
    def misbehave(self) -> None:
        raise ValueError("no \ud800 text")


class Unspeakable(Ahead):
    """Raises an exception that cannot be written down."""

    def misbehave(self) -> None:
        class Mute(Exception):
            def __str__(self) -> str:
                raise ValueError("never")

        raise Mute


class BadLog(Ahead):
    plan_log = (1, 2, 3)


class NoTemporaryFolder(Ahead):
    def misbehave(self) -> None:
        tempfile.tempdir = "/nowhere"


class NoFiles(Ahead):
    def misbehave(self) -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))


class OutOfMemoryForGood(Ahead):
    """Leaves nothing for those who handle its failure."""

    def misbehave(self) -> None:
        hoard: list[Any] = []
        self.hoard = hoard
        size = 2**30
        while size > 64:
            try:
                hoard.append(bytearray(size))
            except MemoryError:
                size //= 2
        raise MemoryError


def _sockets() -> list[socket.socket]:
    found = []
    for number in range(3, 64):
        try:
            found.append(socket.socket(fileno=os.dup(number)))
        except OSError:
            continue
    return found


class Chatters(Ahead):
    """Writes what it likes to its owner."""

    said = b"\xff" * 64

    def misbehave(self) -> None:
        for line in _sockets():
            line.sendall(self.said)


class ClaimsMuch(Chatters):
    """Announces a message that never comes."""

    said = struct.pack("!i", 2**30)


class _Bomb:
    def __reduce__(self) -> tuple[Any, ...]:
        return Path(os.environ[NOTE]).touch, ()


class SendsCode(Ahead):
    """Answers with a pickle that runs something where it is read."""

    def misbehave(self) -> None:
        data = pickle.dumps(_Bomb())
        for line in _sockets():
            line.sendall(struct.pack("!i", len(data)) + data)


class Patches(Ahead):
    """Makes the goal come to everybody who runs later in its process."""

    def misbehave(self) -> None:
        def step(self: LineEnv, command: np.ndarray) -> Any:
            return None, 0.0, True, False, {"success": True, "reason": "patched"}

        LineEnv.step = step  # type: ignore[method-assign]


class Reweighs(Ahead):
    """Makes the boxes that it was shown light."""

    def reset(self, world: World, rng: np.random.Generator) -> None:
        super().reset(world, rng)
        object.__setattr__(world.movables, "masses", world.movables.masses * 1e-9)


class MovesTheGoal(Ahead):
    """Puts the goal where the robot is, in whatever it is given, in every step."""

    def move(self, world: World) -> None:
        goal = world.navigation_goal
        for array in (goal.center, world.movables.poses, world.robot_pose):  # type: ignore[union-attr]
            array.flags.writeable = True
        goal.center[:] = world.robot_pose[:2]  # type: ignore[union-attr]
        object.__setattr__(goal, "radius", 100.0)
        object.__setattr__(world, "goal", goal)
        world.movables.poses[:] = 0.0
        world.robot_pose[:] = 1e3

    def reset(self, world: World, rng: np.random.Generator) -> None:
        super().reset(world, rng)
        self.move(world)

    def act(self, world: World, observation: Any) -> Any:
        self.move(world)
        return super().act(world, observation)


class Interrupts(Ahead):
    def misbehave(self) -> None:
        raise KeyboardInterrupt


class Base(BaseException):
    def __str__(self) -> str:
        raise SystemExit(5)


class RaisesBase(Ahead):
    def misbehave(self) -> None:
        raise Base


class Recurses(Ahead):
    def misbehave(self) -> None:
        self.misbehave()


class BadProperties(Ahead):
    """Raises wherever one asks what it can do."""

    def __getattr__(self, name: str) -> Any:
        raise ValueError(f"no {name}")


class HugeNumbers(Ahead):
    """Says numbers that no database keeps."""

    steps_per_decision = 2**70

    def misbehave(self) -> None:
        class Endless(list):  # type: ignore[type-arg]
            def __len__(self) -> int:
                return 2**62

        self.plan_log = Endless()


class HugeTimes(Ahead):
    def misbehave(self) -> None:
        self.plan_log = [SimpleNamespace(stats=SimpleNamespace(wall_time_s=2**2000))]


class NanTimes(Ahead):
    def misbehave(self) -> None:
        self.plan_log = [SimpleNamespace(stats=SimpleNamespace(wall_time_s=float("nan")))]


class Counts(Ahead):
    """Patches a number of its row."""

    value: Any = 2**70

    def misbehave(self) -> None:
        from pushplan.metrics import lengths

        lengths.steps = lambda episode: self.value  # type: ignore[assignment]


class CountsForEver(Counts):
    value = float("inf")


class LeavesFolder(Ahead):
    def misbehave(self) -> None:
        os.chdir("/")


class ClosesAll(Ahead):
    def misbehave(self) -> None:
        os.closerange(0, 64)


class ExitsQuietly(Ahead):
    def misbehave(self) -> None:
        os._exit(0)


class Deaf(Ahead):
    """Ignores every signal that can be ignored, and waits."""

    def misbehave(self) -> None:
        for number in range(1, signal.NSIG):
            with contextlib.suppress(OSError, ValueError):
                signal.signal(number, signal.SIG_IGN)
        signal.pthread_sigmask(signal.SIG_BLOCK, range(1, signal.NSIG))
        while True:
            time.sleep(0.01)


class LeavesThread(Ahead):
    def misbehave(self) -> None:
        threading.Thread(target=time.sleep, args=(600,)).start()


class RaisesAtTheEnd(Ahead):
    def close(self) -> None:
        raise ValueError("at close")

    def __del__(self) -> None:
        raise ValueError("at the end")


class RaisesAtReset(Ahead):
    def reset(self, world: World, rng: np.random.Generator) -> None:
        raise GeneratorExit


class HoldsFiles(Ahead):
    """Holds 900 MB in files of memory that it does not map."""

    def misbehave(self) -> None:
        self.file = os.memfd_create("hoard")
        for _ in range(900):
            os.write(self.file, bytes(1_000_000))
        while True:
            pass


class ForksOn(Ahead):
    """Starts a process that goes on as another one again and again, in groups of their own."""

    dies = False

    def misbehave(self) -> None:
        if os.fork() == 0:
            for _ in range(2000):  # it ends by itself after a while
                if os.fork() > 0:
                    os._exit(0)
                os.setsid()
                with open(os.environ[NOTE], "a") as file:
                    file.write(f"{os.getpid()}\n")
                time.sleep(0.02)
            os._exit(0)
        time.sleep(0.2)
        if self.dies:
            os._exit(0)


class ForksOnAndDies(ForksOn):
    dies = True


class Boasts(Ahead):
    """Patches its own score."""

    def misbehave(self) -> None:
        from pushplan.metrics import navigation

        navigation.e_nav = lambda episode: 5.0


class HasChildren(Ahead):
    """Starts processes that outlive it, in its own group and in another."""

    def misbehave(self) -> None:
        for apart in (False, True):
            child = subprocess.Popen(["sleep", "600"], start_new_session=apart)
            with open(os.environ[NOTE], "a") as file:
                file.write(f"{child.pid}\n")


class DiesWithChildren(HasChildren):
    def misbehave(self) -> None:
        super().misbehave()
        os._exit(3)


class Floods(Ahead):
    def misbehave(self) -> None:
        for _ in range(100):
            sys.stderr.write("x" * 500_000)
        raise ValueError("y" * 30_000_000)


class SharesMuch(Ahead):
    """Takes 900 MB that are no private memory."""

    def misbehave(self) -> None:
        self.hoard = mmap.mmap(-1, 900_000_000)
        for at in range(0, len(self.hoard), 4096):
            self.hoard[at] = 1
        while True:
            pass


class KilledOnce(Ahead):
    """As if somebody ended its process, the first time only."""

    def misbehave(self) -> None:
        note = Path(os.environ[NOTE])
        if not note.exists():
            note.touch()
            os.kill(os.getpid(), signal.SIGKILL)
