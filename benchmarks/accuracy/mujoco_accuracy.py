"""How far the MuJoCo simulator's time steps are from ones ten times finer, and what they cost.

Usage::

    python -m benchmarks.accuracy.mujoco_accuracy [--scenes 40] [--boxes 1 3 10] [--ships 5]

A TurtleBot3 with a bumper pushes into a heap of 8 cm boxes ahead of it for 5 s, on random arcs.
The same commands run with each setting and with time steps ten times finer and a solver that
iterates to the end. Errors are distances between the two final positions of every box that moved,
as a share of the box's side; work is the sum of the path lengths.

Likewise with the full-scale ship, which sails into ice of 50 % from 2 m/s for 60 s; errors there
are shares of a floe's mean radius.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from benchmarks.reporting import command_line
from pushplan.envs.simulators.base import Materials, Solids
from pushplan.envs.simulators.mujoco_model import MujocoOptions
from pushplan.envs.simulators.mujoco_simulator import MujocoSimulator
from pushplan.envs.tasks.ship_ice import ShipIceTask
from pushplan.world import Drive, GoalDisc, Movables, RobotModel, StaticMap, Twist, World, stream
from pushplan.world.checks import FloatArray

SIDE = 0.08
STEP = 0.2
STEPS = 25
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
    rng = stream(seed, "drive")
    lengths = np.zeros(boxes)
    command = Twist(0.2, 0.0)
    began = time.perf_counter()
    for i in range(STEPS):
        if i % 5 == 0:
            command = Twist(0.2, rng.uniform(-0.4, 0.4))
        before = simulator.object_poses
        lengths += simulator.step(command, STEP).object_lengths(before)
    return simulator.object_poses[:, :2], lengths, time.perf_counter() - began


def sail(seed: int, options: MujocoOptions) -> tuple[FloatArray, FloatArray, float]:
    """As `drive`, for the full-scale ship."""
    task = ShipIceTask(preset="full_scale", variations={"concentration": 0.5})
    world = task.start(stream(seed, "layout"))
    # among the floes and at full speed
    world = replace(
        world, robot_pose=world.robot_pose + np.array([0.0, 50.0, 0.0]), robot_twist=(0.0, 2.0, 0.0)
    )
    simulator = MujocoSimulator(options)
    simulator.build(world, task.materials)
    lengths = np.zeros(len(world.movables))
    began = time.perf_counter()
    for _ in range(15):
        before = simulator.object_poses
        lengths += simulator.step(Twist(2.0, 0.0), 4.0).object_lengths(before)
    return simulator.object_poses[:, :2], lengths, time.perf_counter() - began


Run = tuple[FloatArray, FloatArray, float]


def row(name: str, runs: list[Run], reference: list[Run], size: float, simulated: float) -> None:
    """Print errors of some runs against the reference."""
    pairs = list(zip(runs, reference, strict=True))
    errors = np.concatenate(
        [np.hypot(*(run[0] - fine[0]).T)[fine[1] > 0.01 * size] / size for run, fine in pairs]
    )
    work, fine_work = (sum(run[1].sum() for run in rows) for rows in (runs, reference))
    pace = simulated * len(runs) / sum(run[2] for run in runs)
    print(
        f"{name:28} {np.median(errors):12.2%} {np.quantile(errors, 0.95):8.1%} "
        f"{work / fine_work - 1.0:+11.2%} {pace:14.0f}"
    )


def main() -> None:
    """Print one row for each number of boxes and each setting, then those of the ship."""
    parser = command_line(__doc__, scenes=40)
    parser.add_argument("--boxes", type=int, nargs="+", default=[1, 3, 10])
    parser.add_argument("--ships", type=int, default=5)
    arguments = parser.parse_args()
    default = MujocoOptions()
    fine = replace(default, time_step=default.time_step / 10, iterations=100, tolerance=1e-9)
    settings = {"12.5 ms (default)": default}
    settings |= {
        f"{1e3 * h:g} ms": replace(default, time_step=h) for h in (0.025, 0.00834, 0.00625, 0.0025)
    }
    settings |= {
        "tolerance 1e-4": replace(default, tolerance=1e-4),
        "5 iterations": replace(default, iterations=5),
        "impedance 0.95": replace(default, impedance=0.95),
    }
    print("setting                    error: median      p95  work: total  simulated s/wall s")
    for boxes in arguments.boxes:
        reference = [drive(boxes, seed, fine) for seed in range(arguments.scenes)]
        for name, options in settings.items():
            runs = [drive(boxes, seed, options) for seed in range(arguments.scenes)]
            row(f"{boxes:2} boxes, {name}", runs, reference, SIDE, STEP * STEPS)
    fine = replace(fine, water_time_step=0.002, drag_interval=0.002)
    reference = [sail(seed, fine) for seed in range(arguments.ships)]
    settings = {"20 ms (default)": default}
    settings |= {f"{1e3 * h:g} ms": replace(default, water_time_step=h) for h in (0.1, 0.05, 0.005)}
    settings["drag kept for 0.5 s"] = replace(default, drag_interval=0.5)
    for name, options in settings.items():
        runs = [sail(seed, options) for seed in range(arguments.ships)]
        row(f"ship, {name}", runs, reference, 12.5, 60.0)


if __name__ == "__main__":
    main()
