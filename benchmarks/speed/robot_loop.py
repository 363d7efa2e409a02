"""A `Runner` at the wheel of a MuJoCo robot in another process, in real time.

    python -m benchmarks.speed.robot_loop [--seconds S] [--rate HZ] [--kill] [--policies NAME ...]

The other process is `examples/robot_process.py`. An episode that has ended is followed by another
one. Here, one thread receives worlds and another one asks for commands, as on a robot.

Per policy it writes how long `Runner.command` took (median, 99.9th percentile and worst), how much
of that the thread computed itself at worst (the rest is the machine doing other work), how many
commands were late, by how much memory grew from a tenth of the time to half of it and from there to
the end, and how the episodes ended. With --kill a planning
thread is ended now and then in the middle of its call, by an exception that no planner catches.
With --realtime the loop and the simulator have real-time priorities, as on a robot, so that other
work on the machine delays them less; planning has none. That needs the right to set priorities.
"""

from __future__ import annotations

import argparse
import os
import socket
import sys
import threading
import time
from collections import Counter
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from benchmarks.reporting import command_line, resident_mb
from pushplan.runtime import Runner
from pushplan.runtime.runner import PLAN_STOP
from pushplan.scenarios import suite
from pushplan.world import Stop, StopCheck, World

sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))
from robot_process import ADDRESS, LARGEST, command_bytes, seen, start_robot

SUITES = {
    "push-aware": "maze-3d-3",
    "kinodynamic-rrt": "maze-3d-3",
    "gtsp-mpc": "area-clearing-3d-10",
    "ship-predictive": "ship-ice-3d-20",
}
_KILL_EVERY_S = 20.0
_MEMORY_AT = (0.1, 0.5, 0.98, np.inf)  # of the time


def main() -> None:
    """Measure, write the table."""
    parser = command_line(__doc__, seed=1000)
    parser.add_argument("--seconds", type=float, default=1000.0)
    parser.add_argument("--rate", type=float, default=20.0)
    parser.add_argument("--kill", action="store_true")
    parser.add_argument("--realtime", action="store_true", help="Linux real-time priorities")
    parser.add_argument("--policies", nargs="+", default=list(SUITES), choices=list(SUITES))
    options = parser.parse_args()
    print(
        "| policy | suite | commands | median | p99.9 | worst | own worst | late | "
        "memory | killed | failures | episodes |"
    )
    print("|---" * 12 + "|")
    for policy in options.policies:
        print(row(policy, options), flush=True)


def row(policy: str, options: argparse.Namespace) -> str:
    """Drive with one policy; its line of the table."""
    scenarios = suite(SUITES[policy], episodes=500, first_seed=options.seed).scenarios
    period = 1.0 / options.rate
    robot, ours = start_robot(policy, scenarios, period)
    killer = Killer()
    runner = Runner(policy, period=period, plan_stop=PLAN_STOP | killer)
    loop = _Loop(runner, ours, period, killer, options.kill)
    if options.realtime:
        set_priority(0, 30)
        set_priority(robot.pid, 20)
    try:
        loop.run(options.seconds)
    finally:
        robot.terminate()
        robot.join()
    took = 1e3 * np.array(loop.took)
    own = 1e3 * np.array(loop.own)
    cells = [
        policy,
        SUITES[policy],
        str(len(took)),
        *(f"{value:.2f} ms" for value in (np.median(took), np.quantile(took, 0.999), took.max())),
        f"{own.max():.2f} ms",
        str(loop.late),
        ", ".join(f"{mb:+.1f}" for mb in np.diff(loop.memory)) + " MB",
        str(killer.killed),
        str(loop.failures),
        ", ".join(f"{count} {reason}" for reason, count in loop.reasons.items()) or "none ended",
    ]
    return "| " + " | ".join(cells) + " |"


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
        self.took: list[float] = []
        self.own: list[float] = []
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
            self.took.append(time.perf_counter() - before)
            self.late += command.late
            self._socket.sendto(command_bytes(self._number, command.twist), there)
            if self._kill and before > next_kill:
                self.killer.due = True
                next_kill = before + _KILL_EVERY_S
            if before > began + _MEMORY_AT[len(self.memory)] * seconds:
                self.memory.append(resident_mb())
            due += self._period
            time.sleep(max(0.0, due - time.perf_counter()))


def set_priority(process: int | None, priority: int) -> None:
    """Real-time priority of a process, or of this thread (0), but not of what it starts."""
    policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
    os.sched_setscheduler(process or 0, policy, os.sched_param(priority))


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
