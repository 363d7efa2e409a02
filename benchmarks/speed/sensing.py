"""CPU time of a `WorldEstimate`, and of the sensors that are simulated for it.

    python -m benchmarks.speed.sensing [--objects K ...] [--updates N] [--episodes N]

A hall of 30 x 20 m with K boxes of 0.4 m, in which a Jackal drives along a circle. An update takes
the objects that a detector reports and one scan of 720 beams of 10 m, and makes the world that
planners get. Sensors cost a robot nothing; in a simulator their time comes on top.

Then a `Runner` drives push-aware through the maze of maze-3d-6-lidar, at 20 Hz of simulated time
with a scan each tenth of a second, and plans in a thread of its own. The time of its commands is
that of their thread: neither planning nor the simulator counts.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np

from benchmarks.reporting import command_line, head, origin, percentiles, row, write
from pushplan.envs import PushEnv
from pushplan.perception import Detector, Lidar, WorldEstimate
from pushplan.runtime import CommandStatus, Runner
from pushplan.world import GoalDisc, Movables, StaticMap, World, jackal

_HALL = (0.0, 0.0, 30.0, 20.0)
_SIDE = 0.4  # of a box [m]
_CIRCLE = 6.0, 0.02  # radius [m], turn between two updates [rad]


def hall(count: int, rng: np.random.Generator) -> World:
    """The hall, with columns and boxes."""
    x, y = np.meshgrid(np.arange(3.0, 29.0, 4.0), np.arange(2.0, 19.0, 4.0))
    centres = np.column_stack([x.ravel(), y.ravel()])
    corners = 0.5 * _SIDE * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    around = [(0, 0, 30, 0), (30, 0, 30, 20), (30, 20, 0, 20), (0, 20, 0, 0)]
    lines = [*around, *np.hstack([centres, centres]).tolist()]
    radii = np.array([0.1] * 4 + [0.25] * len(centres))
    static = StaticMap.build(segments=lines, radii=radii, bounds=_HALL)
    poses = rng.uniform((1.0, 1.0, -np.pi), (29.0, 19.0, np.pi), (count, 3))
    objects = Movables.from_outlines([corners] * count, poses)
    return World(jackal(), np.zeros(3), static, objects, GoalDisc(np.array([28.0, 18.0]), 0.5))


def command_times(seed: int) -> list[float]:
    """CPU time of each command of an episode [ms]."""
    variations = {"boxes": 6, "sensing": "lidar", "view_rate": 10.0, "control_step": 0.05}
    options: Any = {"observation": "state", "action": "velocity", "variations": variations}
    env = PushEnv(task="maze", simulator="mujoco", **options)
    env.reset(seed=seed)
    took = []
    with Runner("push-aware", period=0.05) as runner:
        command = runner.start(env.world)
        over = False
        while not over and command.status is not CommandStatus.DONE:
            _, _, ended, cut, _ = env.step(env.encode(command.twist))
            over = ended or cut
            runner.update(env.world)
            begin = time.thread_time()
            command = runner.command(env.world.time)
            took.append(1e3 * (time.thread_time() - begin))
    return took


def main() -> None:
    parser = command_line(__doc__, seed=0)
    parser.add_argument("--objects", nargs="+", type=int, default=[10, 100])
    parser.add_argument("--updates", type=int, default=500)
    parser.add_argument("--episodes", type=int, default=5)
    options = parser.parse_args()
    write(origin(), "")
    head("objects", "seen", "update p50 [ms]", "p99", "worst", "sensors p50 [ms]", "polygons")
    for count in options.objects:
        world = hall(count, np.random.default_rng(options.seed))
        belief = WorldEstimate(world.robot, world.goal, _HALL)
        lidar, detector = Lidar(range=10.0), Detector(range=10.0)
        took, sensors = [], []
        for k in range(options.updates):
            angle = _CIRCLE[1] * k
            place = np.array([15.0, 10.0]) + _CIRCLE[0] * np.array(
                [math.cos(angle), math.sin(angle)]
            )
            now = world.moved(robot_pose=[*place, angle + math.pi / 2], time=0.1 * k)
            begin = time.process_time()
            detections, scan = detector.detect(now), lidar.scan(now)
            seen = time.process_time()
            belief.add_detections(detections)
            belief.add_scan(scan)
            found = belief.world(now.robot_pose, now.robot_twist, now.time)
            polygons = len(found.static.convex_parts)
            took.append(1e3 * (time.process_time() - seen))
            sensors.append(1e3 * (seen - begin))
        row(
            count,
            len(belief.objects),
            *percentiles(took, (50, 99, 100), 1),
            *percentiles(sensors, (50,), 1),
            polygons,
        )
    write("")
    head("commands", "CPU p50 [ms]", "p99.9", "worst")
    took = [t for k in range(options.episodes) for t in command_times(options.seed + k)]
    if took:
        row(len(took), *percentiles(took, (50, 99.9, 100), 2))


if __name__ == "__main__":
    main()
