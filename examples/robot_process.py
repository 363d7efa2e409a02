"""A simulated robot in a process of its own, at the pace of the wall clock, over UDP.

Every period it sends what it sees and drives what it was sent last, as a robot does. What never
changes in an episode (map, shapes, goal) goes through a pipe at its start; poses, speeds and
commands are datagrams of numbers.
"""

from __future__ import annotations

import socket
import time
from collections.abc import Sequence
from dataclasses import replace
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess

import numpy as np

from pushplan.evaluation import JobSettings
from pushplan.runtime import Runner
from pushplan.scenarios import Scenario
from pushplan.world import Twist, World
from pushplan.world.checks import FloatArray

ADDRESS = "127.0.0.1"
LARGEST = 65_000  # bytes of a datagram


def start_robot(
    policy: str, scenarios: Sequence[Scenario], period: float
) -> tuple[BaseProcess, Connection]:
    """Start the process; it waits for the port to which it sends.

    Args:
        policy: name of the policy that will drive it, which says what actions it takes.
        scenarios: one episode after another.
        period: time between two of its messages [s].

    Returns:
        The process, and the pipe through which episodes begin and end: (number, world at the
        start), answered by anything, and later (number, reason).
    """
    ours, theirs = get_context("spawn").Pipe()
    robot = get_context("spawn").Process(
        target=simulate, args=(theirs, policy, scenarios, period), daemon=True
    )
    robot.start()
    return robot, ours


def simulate(pipe: Connection, policy: str, scenarios: Sequence[Scenario], period: float) -> None:
    """The robot, its world, and its wheels; see `start_robot`."""
    start = replace(scenarios[0], variations={**scenarios[0].variations, "control_step": period})
    env = JobSettings().environment(start, Runner(policy, period=period).policy)
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.bind((ADDRESS, 0))
    receiver.setblocking(False)
    pipe.send(receiver.getsockname()[1])
    there = (ADDRESS, pipe.recv())
    for number, scenario in enumerate(scenarios):
        env.reset(seed=scenario.seed)
        pipe.send((number, env.world))
        pipe.recv()
        due, twist = time.perf_counter(), Twist(0.0, 0.0)
        over = False
        while not over:
            *_, terminated, truncated, info = env.step(env.encode(twist))
            over = terminated or truncated
            due = max(due + period, time.perf_counter())
            time.sleep(max(0.0, due - time.perf_counter()))
            receiver.sendto(message(number, env.world), there)
            twist = newest(receiver, number, twist)
        pipe.send((number, str(info.get("reason", ""))))


def message(number: int, world: World) -> bytes:
    """What is seen in an episode, as numbers."""
    movables = world.movables
    head = [number, world.time, len(movables), *world.robot_pose, *world.robot_twist]
    return np.concatenate([head, movables.ids, movables.poses.ravel()]).tobytes()


def seen(data: bytes, start: World) -> World:
    """The world of a message, with what never changes taken from the start of the episode."""
    values: FloatArray = np.frombuffer(data)
    count = int(values[2])
    ids, poses = values[9 : 9 + count], values[9 + count :].reshape(-1, 3)
    movables = start.movables
    if count != len(movables):
        movables = movables.select(np.isin(movables.ids, ids))
    return replace(
        start,
        time=float(values[1]),
        robot_pose=values[3:6],
        robot_twist=values[6:9],
        movables=movables.moved_to(poses),
    )


def command_bytes(number: int, twist: Twist) -> bytes:
    """A command for an episode, as numbers."""
    return np.array([number, twist.linear, twist.angular]).tobytes()


def newest(receiver: socket.socket, number: int, last: Twist) -> Twist:
    """The command that came last, of those for this episode."""
    while True:
        try:
            episode, linear, angular = np.frombuffer(receiver.recv(LARGEST))
        except BlockingIOError:
            return last
        if int(episode) == number:
            last = Twist(float(linear), float(angular))
