"""How far the MuJoCo simulator's time steps are from ones ten times finer, and what they cost.

Usage::

    python benchmarks/mujoco_accuracy.py [--scenes 30] [--boxes 1 3 10]

A TurtleBot3 with a bumper pushes into a heap of 8 cm boxes ahead of it for 5 s, on random arcs.
The same commands run with each setting and with time steps ten times finer and a solver that
iterates to the end. Errors are distances between the two final positions of every box that moved,
as a share of the box's side; work is the sum of the path lengths.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

import numpy as np

from pushplan.envs.simulators.base import Materials, Solids
from pushplan.envs.simulators.mujoco_options import MujocoOptions
from pushplan.envs.simulators.mujoco_simulator import MujocoSimulator
from pushplan.world import Drive, GoalDisc, Movables, RobotModel, StaticMap, Twist, World, stream
from pushplan.world.checks import FloatArray

SIDE, STEP, STEPS = 0.08, 0.2, 25
MATERIALS = Materials(
    robot_object=0.4,
    object_object=0.4,
    object_static=0.4,
    rolling_time=0.5,
    object_ground=0.4,
    solids=Solids(
        object_height=SIDE,
        robot_height=0.19,
        wall_height=0.2,
        bumper_height=0.06,
        wheel_radius=0.033,
    ),
)
ROBOT = RobotModel(
    parts=(
        np.array([(-0.069, -0.0915), (0.069, -0.0915), (0.069, 0.0915), (-0.069, 0.0915)]),
        np.array([(0.069, -0.11), (0.085, -0.11), (0.085, 0.11), (0.069, 0.11)]),
    ),
    mass=1.07,
    drive=Drive.DIFFERENTIAL,
    max_speed=0.2,
    min_speed=-0.2,
    max_turn_rate=0.785,
    wheel_separation=0.16,
    name="turtlebot3",
)


def scene(boxes: int, seed: int) -> World:
    """Boxes at random headings in cells of 12 cm ahead of the robot."""
    rng = stream(seed, "layout")
    cells = np.array([(x, y) for x in range(5) for y in (-1, 0, 1)], dtype=float)
    poses = np.zeros((boxes, 3))
    poses[:, :2] = 0.12 * (rng.permutation(cells)[:boxes] + np.array([1.6, 0.0]))
    poses[:, 2] = rng.uniform(-np.pi, np.pi, boxes)
    square = 0.5 * SIDE * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    return World(
        robot=ROBOT,
        robot_pose=np.zeros(3),
        static=StaticMap.build(bounds=(-3.0, -3.0, 3.0, 3.0)),
        movables=Movables.from_outlines([square] * boxes, poses, masses=np.full(boxes, 0.1)),
        goal=GoalDisc(np.zeros(2), 0.1),
    )


def drive(boxes: int, seed: int, options: MujocoOptions) -> tuple[FloatArray, FloatArray, float]:
    """Final positions (K, 2), path lengths (K,) of the boxes [m], and wall-clock time [s]."""
    simulator = MujocoSimulator(options)
    simulator.build(scene(boxes, seed), MATERIALS)
    rng, lengths, command = stream(seed, "drive"), np.zeros(boxes), Twist(0.2, 0.0)
    began = time.perf_counter()
    for i in range(STEPS):
        if i % 5 == 0:
            command = Twist(0.2, rng.uniform(-0.4, 0.4))
        before = simulator.object_poses
        lengths += simulator.step(command, STEP).object_lengths(before)
    return simulator.object_poses[:, :2], lengths, time.perf_counter() - began


def main() -> None:
    """Print one row for each number of boxes and each setting."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=30)
    parser.add_argument("--boxes", type=int, nargs="+", default=[1, 3, 10])
    arguments = parser.parse_args()
    default = MujocoOptions()
    fine = replace(default, time_step=default.time_step / 10, iterations=100, tolerance=1e-9)
    settings = (
        {"default (12.5 ms)": default}
        | {
            f"time step {1e3 * h:g} ms": replace(default, time_step=h)
            for h in (0.025, 0.00833, 0.00625, 0.0025)
        }
        | {
            "tolerance 1e-4": replace(default, tolerance=1e-4),
            "5 iterations": replace(default, iterations=5),
            "impedance 0.95": replace(default, impedance=0.95),
        }
    )
    print("boxes setting             error: median    p95    work: total  simulated s per wall s")
    for boxes in arguments.boxes:
        reference = [drive(boxes, seed, fine) for seed in range(arguments.scenes)]
        for name, options in settings.items():
            runs = [drive(boxes, seed, options) for seed in range(arguments.scenes)]
            pairs = list(zip(runs, reference, strict=True))
            errors = np.concatenate(
                [np.hypot(*(run[0] - ref[0]).T)[ref[1] > 0.001] / SIDE for run, ref in pairs]
            )
            work, fine_work = (sum(run[1].sum() for run in rows) for rows in (runs, reference))
            pace = STEP * STEPS * len(runs) / sum(run[2] for run in runs)
            print(
                f"{boxes:5} {name:20} {np.median(errors):12.2%} {np.quantile(errors, 0.95):8.1%} "
                f"{work / fine_work - 1.0:+11.2%} {pace:14.0f}"
            )


if __name__ == "__main__":
    main()
