"""A `Runner` at the wheel of a robot in another process, in real time, beside a busy process.

    python -m benchmarks.speed.robot_loop [--seconds S] [--rates HZ ...] [--busy N] [--kill]
                                          [--policies NAME ...] [--suites NAME ...]

The robot is `examples/robot_process.py`, a simulator at the pace of the wall clock. An episode that
has ended is followed by another one. Here, one thread receives worlds, another one asks for
commands, and a third one plans, as on a robot. ``--busy`` further processes compute all the time.

Per policy, suite and rate it writes the CPU time of `Runner.command` (median, 99.9th percentile and
worst): what other processes do counts for nothing, but neither does waiting for the interpreter
lock. That, and the scheduler of the machine, is in the lateness: by how much a command was there
later than it was due. *Late* are the commands that the runner calls so. Memory is the growth from a
tenth of the time to half of it, and from there to the end. With --kill a planning thread is ended
now and then in the middle of its call, by an exception that no planner catches.
"""

from __future__ import annotations

import argparse
import socket
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.reporting import command_line, head, origin, percentiles, resident_mb, row, write
from pushplan.learned import load_policy
from pushplan.runtime import Runner
from pushplan.runtime.runner import PLAN_STOP
from pushplan.scenarios import suite
from pushplan.world import Stop, StopCheck, Twist, World

sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))
from robot_process import ADDRESS, LARGEST, command_bytes, seen, start_robot

_NAVIGATION = ("maze-3d-3", "office-1k", "office-5k")
SUITES = {
    "straight": _NAVIGATION,
    "kinodynamic-rrt": _NAVIGATION,
    "push-aware": _NAVIGATION,
    "namo": _NAVIGATION,
    "gtsp-mpc": ("area-clearing-3d-10",),
    "ship-predictive": ("ship-ice-3d-20",),
    "maze-ppo": ("maze-2d-10",),
}
COLUMNS = (
    *("policy", "suite", "Hz", "commands", "CPU p50 [ms]", "p99.9", "worst"),
    *("late by p50 [ms]", "p99.9", "worst", "late", "memory [MB]"),
    *("killed", "failures", "episodes"),
)
_KILL_EVERY_S = 20.0
_MEMORY_AT = (0.1, 0.5, 0.98, np.inf)  # of the time


def main() -> None:
    """Measure, write the table."""
    parser = command_line(__doc__, seed=1000)
    parser.add_argument("--seconds", type=float, default=100.0, help="of each row; default 100")
    parser.add_argument("--rates", nargs="+", type=float, default=[20.0, 100.0])
    parser.add_argument("--busy", type=int, default=1, help="processes that compute; default 1")
    parser.add_argument("--kill", action="store_true")
    parser.add_argument("--policies", nargs="+", default=list(SUITES), choices=list(SUITES))
    parser.add_argument("--suites", nargs="+", help="only these of each policy's")
    options = parser.parse_args()
    write(origin(), "")
    head(*COLUMNS)
    with busy(options.busy):
        for policy in options.policies:
            for name in SUITES[policy]:
                for rate in options.rates if name in (options.suites or [name]) else ():
                    row(*cells(policy, name, rate, options))


@contextmanager
def busy(count: int) -> Iterator[None]:
    """So many processes that compute meanwhile."""
    context = get_context("spawn")
    processes = [context.Process(target=_compute, daemon=True) for _ in range(count)]
    for process in processes:
        process.start()
    try:
        yield
    finally:
        for process in processes:
            process.terminate()


def _compute() -> None:
    while True:
        np.linalg.svd(np.ones((50, 50)))


class Network:
    """A shipped network that gives turn rates, asked with what it observes of the world."""

    actions = ("turn_rate",)

    def __init__(self, name: str) -> None:
        self._policy = load_policy(name)

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Begin an episode."""
        self._policy.reset(world, rng)

    def act(self, world: World, observation: Any = None) -> Twist:
        """Return the velocity that the network wants."""
        (turn,) = self._policy.act(world, None)
        return Twist(world.robot.max_speed, float(np.clip(turn, -1, 1)) * world.robot.max_turn_rate)


def cells(policy: str, name: str, rate: float, options: argparse.Namespace) -> list[str]:
    """Drive with one policy in one suite; its cells of the table."""
    scenarios = suite(name, episodes=500, first_seed=options.seed).scenarios
    period = 1.0 / rate
    network = policy.startswith("maze-")
    # a robot for the network takes turn rates, as it does from this planner
    robot, ours = start_robot("kinodynamic-rrt" if network else policy, scenarios, period)
    killer = Killer()
    driver = Network(policy) if network else policy
    runner = Runner(driver, period=period, plan_stop=PLAN_STOP | killer)
    loop = _Loop(runner, ours, period, killer, options.kill)
    try:
        loop.run(options.seconds)
    finally:
        robot.terminate()
        robot.join()
    numbers = []
    for values in (loop.own, loop.behind):
        numbers += percentiles(1e3 * np.array(values), (50, 99.9, 100), 2)
    return [
        *(policy, name, f"{rate:g}", str(len(loop.own)), *numbers, str(loop.late)),
        ", ".join(f"{mb:+.1f}" for mb in np.diff(loop.memory)),
        str(killer.killed),
        str(loop.failures),
        ", ".join(f"{count} {reason}" for reason, count in loop.reasons.items()) or "none ended",
    ]


class _Loop:
    """The robot's loop: one thread that receives, one that drives."""

    def __init__(
        self, runner: Runner, pipe: Connection, period: float, killer: Killer, kill: bool
    ) -> None:
        self.runner = runner
        self._pipe = pipe
        self._period = period
        self.killer = killer
        self._kill = kill
        self.own: list[float] = []
        self.behind: list[float] = []
        self.reasons: Counter[str] = Counter()
        self.late = self.failures = 0
        self.memory: list[float] = []
        self._number = -1
        self._offset = self._now = 0.0
        self._start: World | None = None

    def run(self, seconds: float) -> None:
        """Drive for so long."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((ADDRESS, 0))
        there = (ADDRESS, self._pipe.recv())
        self._pipe.send(self._socket.getsockname()[1])
        self._begin()
        threading.Thread(target=self._receive, daemon=True).start()
        self._drive(seconds, there)
        self.failures += self.runner.failures
        self.runner.close(20.0)

    def _begin(self) -> None:
        """Take up an episode; its clock is that of the other process."""
        number, world = self._pipe.recv()
        self.failures += self.runner.failures
        self.runner.start(world)
        self._start = world
        self._number = number
        self._offset = time.perf_counter() - world.time
        self._now = world.time
        self._pipe.send(None)

    def _receive(self) -> None:
        while True:
            data = self._socket.recv(LARGEST)
            start = self._start
            number = self._number
            if start is not None and int(np.frombuffer(data, count=1)[0]) == number:
                world = seen(data, start)
                self._offset = max(self._offset, time.perf_counter() - world.time - self._period)
                self.runner.update(world)

    def _drive(self, seconds: float, there: tuple[str, int]) -> None:
        began = due = time.perf_counter()
        next_kill = began + _KILL_EVERY_S
        while time.perf_counter() < began + seconds:
            if self._pipe.poll():
                _, reason = self._pipe.recv()
                self.reasons[reason] += 1
                self._begin()
                due = time.perf_counter()
            before = time.perf_counter()
            own = time.thread_time()
            # the simulation may fall behind the wall clock, but its clock never goes back
            self._now = max(self._now, before - self._offset)
            command = self.runner.command(self._now)
            self.own.append(time.thread_time() - own)
            self.behind.append(time.perf_counter() - due)
            self.late += command.late
            self._socket.sendto(command_bytes(self._number, command.twist), there)
            if self._kill and before > next_kill:
                self.killer.due = True
                next_kill = before + _KILL_EVERY_S
            if before > began + _MEMORY_AT[len(self.memory)] * seconds:
                self.memory.append(resident_mb())
            due += self._period
            time.sleep(max(0.0, due - time.perf_counter()))


class Killer(Stop):
    """A stop rule that ends the thread of the planning call that looks at it next, when told to."""

    def __init__(self) -> None:
        self.due = False
        self.killed = 0

    def start(self) -> StopCheck:
        """See `pushplan.world.Stop`."""
        return self._check

    def _check(self, iterations: int, cost: float) -> bool:
        if self.due:
            self.due = False
            self.killed += 1
            raise SystemExit("ended from outside")
        return False


if __name__ == "__main__":
    main()
