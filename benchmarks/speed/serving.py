"""What the policy server adds to a policy, beside calling it in this process.

    python -m benchmarks.speed.serving [--policy straight] [--steps 2000] [--server ADDRESS]

Prints the time of an ``act`` in process and through the server,
for poses alone and for whole worlds, and what messages cost to write and to read.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))

from serve_client import PolicyClient

from benchmarks.reporting import command_line, median_ms
from pushplan.files.safe_files import parse_json
from pushplan.planners import make_policy
from pushplan.serving import PolicyServer
from pushplan.world import (
    GoalDisc,
    Movables,
    RobotModel,
    StaticMap,
    World,
    stream,
    world_from_dict,
    world_to_dict,
)

SQUARE = np.array([[-0.2, -0.2], [0.2, -0.2], [0.2, 0.2], [-0.2, 0.2]])


def world_of(objects: int) -> World:
    """A room of 50 m with a wall and some square boxes, away from the robot's way."""
    rng = np.random.default_rng(0)
    poses = np.column_stack([rng.uniform(2, 48, (objects, 2)), rng.uniform(-3, 3, objects)])
    poses[:, 1] = np.where(abs(poses[:, 1] - 25.0) < 2.0, 40.0, poses[:, 1])
    return World(
        robot=RobotModel.from_outline(
            SQUARE, mass=1.0, drive="differential", max_speed=1.0, max_turn_rate=2.0
        ),
        robot_pose=[2.0, 25.0, 0.0],
        static=StaticMap.build(bounds=[0, 0, 50, 50], segments=[[10, 0, 10, 20]], radii=0.1),
        movables=Movables.from_outlines([SQUARE] * objects, poses),
        goal=GoalDisc([48.0, 25.0], 0.5),
    )


Times = tuple[list[float], list[float]]


def quantiles(seconds: list[float]) -> str:
    """Median, 99 % and worst [ms]."""
    ms = 1e3 * np.array(seconds)
    return f"{np.median(ms):9.3f} {np.quantile(ms, 0.99):9.3f} {ms.max():9.3f}"


def compared(address: str, policy: str, world: World, steps: int, whole: bool) -> Times:
    """What each `act` takes in this process and through the server [s], one beside the other.

    In process the world is made by `World.moved`; through the server it is sent.
    """
    made = make_policy(policy)
    made.reset(world, stream(0, "policy"))
    data: dict[str, Any] = world_to_dict(world)
    poses = world.movables.poses.tolist()
    own = []
    served = []
    with PolicyClient(address) as client:
        client.reset(data)
        for step in range(steps):
            now = 0.01 * step
            pose = [2.0 + 0.01 * step, 25.0, 0.0]
            twist = [1.0, 0.0, 0.0]
            began = time.perf_counter()
            made.act(world.moved(robot_pose=pose, robot_twist=twist, time=now), None)
            middle = time.perf_counter()
            if whole:
                robot = {**data["robot"], "pose": pose, "twist": twist}
                client.act(world={**data, "time": now, "robot": robot})
            else:
                client.act(time=now, robot_pose=pose, robot_twist=twist, poses=poses)
            own.append(middle - began)
            served.append(time.perf_counter() - middle)
    return own, served


def message_costs(objects: int) -> None:
    """What JSON costs, and MessagePack where it is installed."""
    world = world_of(objects)
    whole = world_to_dict(world)
    poses = {"time": 1.0, "robot_pose": [1.0, 2.0, 3.0], "poses": world.movables.poses.tolist()}
    print(f"\n{f'message of {objects} objects':40} {'bytes':>8} {'write':>9} {'read':>9} ms")
    for name, data in (("whole world", whole), ("poses", poses)):
        text = json.dumps(data)
        wrote = median_ms(lambda d=data: json.dumps(d))
        read = median_ms(lambda t=text: parse_json(t))
        print(f"{f'{name}, JSON':40} {len(text):8,} {wrote:9.3f} {read:9.3f}")
        try:
            import msgpack
        except ImportError:
            continue
        packed = msgpack.packb(data)
        wrote = median_ms(lambda d=data: msgpack.packb(d))
        read = median_ms(lambda p=packed: msgpack.unpackb(p))
        print(f"{f'{name}, MessagePack':40} {len(packed):8,} {wrote:9.3f} {read:9.3f}")
    print(f"{'World from a whole world read':60} {median_ms(lambda: world_from_dict(whole)):9.3f}")


def main() -> None:
    """Measure and print."""
    parser = command_line(__doc__)
    parser.add_argument("--policy", default="straight")
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--server", help="address of a server in another process")
    options = parser.parse_args()
    print(f"{'act of ' + options.policy:40} {'median':>9} {'99 %':>9} {'worst':>9} ms")
    with tempfile.TemporaryDirectory() as folder:
        path = f"unix:{os.path.join(folder, 's')}"
        own = None if options.server else PolicyServer(options.policy, path)
        if own is not None:
            own.start()
        try:
            for objects in (0, 10, 100):
                for whole in (False, True):
                    name = f"{objects} objects, {'whole worlds' if whole else 'poses'}"
                    where = options.server or path
                    here, there = compared(
                        where, options.policy, world_of(objects), options.steps, whole
                    )
                    print(f"{f'{name}, in process':40} {quantiles(here)}")
                    over = [b - a for a, b in zip(here, there, strict=True)]
                    print(f"{f'{name}, overhead':40} {quantiles(over)}")
        finally:
            if own is not None:
                own.close()
    message_costs(100)


if __name__ == "__main__":
    main()
