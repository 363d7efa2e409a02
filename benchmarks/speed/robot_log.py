"""Measure what a log costs the thread of the robot, and the thread that writes.

Usage::

    python -m benchmarks.speed.robot_log [--rate 100] [--seconds 60] [--objects 20]

Tells a `McapLog` a world and a command at the rate and a plan of 200 poses each second, and
prints percentiles of the CPU time of each call in Markdown.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.reporting import command_line
from pushplan.ros import McapLog
from pushplan.runtime import Command, CommandStatus
from pushplan.world import GoalDisc, Movables, Plan, StaticMap, Twist, World
from pushplan.world.stored.robots import turtlebot3_burger


def main() -> None:
    """Feed a log and print the table."""
    parser = command_line(__doc__)
    parser.add_argument("--rate", type=float, default=100.0, help="of worlds and commands [Hz]")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--objects", type=int, default=20)
    options = parser.parse_args()
    taken: dict[str, list[float]] = {"world": [], "plan": [], "command": []}

    def timed(name: str, call: Callable[[], None]) -> None:
        began = time.thread_time_ns()
        call()
        taken[name].append(1e-3 * (time.thread_time_ns() - began))

    start = _world(options.objects)
    times = np.linspace(0.0, 20.0, 200)
    poses = np.column_stack([0.2 * times, np.zeros((200, 2))])
    plan = Plan(times, poses, np.full(200, 0.2), np.zeros(200), travel_cost=1.0)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.mcap"
        log = McapLog(path)
        began = time.perf_counter()
        cpu = time.process_time() - time.thread_time()
        for step in range(round(options.rate * options.seconds)):
            now = step / options.rate
            world = start.moved(movable_poses=start.movables.poses + 0.001 * now, time=now)
            command = Command(now, Twist(0.1, 0.2), CommandStatus.DRIVING, plan=plan)
            timed("world", lambda w=world: log.world(w))  # type: ignore[misc]
            timed("command", lambda c=command: log.command(c))  # type: ignore[misc]
            if now == int(now):
                timed("plan", lambda t=now: log.plan(plan, t))  # type: ignore[misc]
            time.sleep(max(0.0, began + now - time.perf_counter()))
        log.close()
        wrote = time.process_time() - time.thread_time() - cpu
        size = path.stat().st_size / options.seconds
    print("| call | times | median [µs] | p99.9 [µs] | worst [µs] |\n|---|---|---|---|---|")
    for name, each in taken.items():
        middle, high, worst = np.percentile(each, [50, 99.9, 100])
        print(f"| `{name}` | {len(each)} | {middle:.1f} | {high:.1f} | {worst:.1f} |")
    share = wrote / options.seconds
    print(f"\nwriting: {share:.1%} of a core, {1e-3 * size:.0f} kB/s, dropped: {log.dropped}")


def _world(count: int) -> World:
    corners = 0.05 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    at = np.column_stack([np.arange(count) % 5, np.arange(count) // 5, np.zeros(count)])
    return World(
        robot=turtlebot3_burger(),
        robot_pose=np.array([-1.0, 0.0, 0.0]),
        static=StaticMap.build(bounds=[-5.0, -5.0, 50.0, 50.0]),
        movables=Movables.from_outlines([corners] * count, at),
        goal=GoalDisc(np.array([20.0, 0.0]), 0.1),
    )


if __name__ == "__main__":
    main()
