"""The same scene and the same commands in both simulators: how far apart they end.

Usage::

    python -m benchmarks.accuracy.parity [--seeds 12] [--picture docs/images/parity.png]

The TurtleBot3 testbed: plain boxes of 8 cm and 100 g, friction 0.4 everywhere. The first rows are
single pushes, the last ones 10 s of random driving among boxes in the open. Commands are sent every
0.2 s, open loop. Distances are between the positions at the end, of the boxes that either simulator
moved by more than a millimetre.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.reporting import command_line
from pushplan.drawing import Panel, draw_figure, save_figure
from pushplan.envs.registry import SIMULATORS, TASKS
from pushplan.imports.on_demand import look_up
from pushplan.world import GoalDisc, Movables, StaticMap, Twist, World, stream
from pushplan.world.checks import FloatArray

PERIOD = 0.2
HALF = 0.04
SQUARE = np.array([(-HALF, -HALF), (HALF, -HALF), (HALF, HALF), (-HALF, HALF)])
FRONT = 0.069
"""Where the robot's front edge is ahead of its origin [m]."""


@dataclass(frozen=True)
class Case:
    """A scene and a list of commands."""

    name: str
    boxes: tuple[tuple[float, float, float], ...]
    commands: tuple[tuple[float, float], ...]
    wheeled: bool = False


def steady(speed: float, turn: float, seconds: float) -> tuple[tuple[float, float], ...]:
    """One command, repeated."""
    return ((speed, turn),) * round(seconds / PERIOD)


AHEAD = FRONT + HALF + 0.1
CASES = (
    Case("straight, box in the middle", ((AHEAD, 0.0, 0.0),), steady(0.15, 0.0, 4.0)),
    Case("straight, box 3 cm to the left", ((AHEAD, 0.03, 0.0),), steady(0.15, 0.0, 4.0)),
    Case("straight, box turned by 30 deg", ((AHEAD, 0.0, np.pi / 6),), steady(0.15, 0.0, 4.0)),
    Case("straight, box clipped at its edge", ((AHEAD, 0.11, 0.0),), steady(0.15, 0.0, 4.0)),
    Case("curve to the left, 0.5 m radius", ((AHEAD, 0.02, 0.0),), steady(0.15, 0.3, 4.0)),
    Case(
        "straight, two boxes in a row",
        ((AHEAD, 0.0, 0.0), (AHEAD + 0.15, 0.0, 0.0)),
        steady(0.15, 0.0, 4.0),
    ),
    Case(
        "straight, two boxes side by side",
        ((AHEAD, 0.045, 0.0), (AHEAD, -0.045, 0.0)),
        steady(0.15, 0.0, 4.0),
    ),
    Case(
        "push and stop, wheeled box",
        ((AHEAD, 0.0, 0.0),),
        steady(0.15, 0.0, 2.0) + steady(0.0, 0.0, 3.0),
        wheeled=True,
    ),
    Case("turn on the spot beside a box", ((0.0, 0.16, 0.0),), steady(0.0, 0.6, 4.0)),
)


def scattered(seed: int) -> Case:
    """Boxes around the robot, and random commands."""
    rng = stream(seed, "parity")
    places: list[tuple[float, float, float]] = []
    while len(places) < 10:
        x, y = rng.uniform(-0.7, 0.7, 2)
        apart = all(np.hypot(x - a, y - b) > 0.14 for a, b, _ in places)
        if np.hypot(x, y) > 0.2 and apart:
            places.append((x, y, rng.uniform(-np.pi, np.pi)))
    commands: list[tuple[float, float]] = []
    for _ in range(5):
        commands += [(0.15, rng.uniform(-0.6, 0.6))] * 10
    return Case("random driving", tuple(places), tuple(commands))


def run(case: Case, simulator: str) -> tuple[World, FloatArray, FloatArray]:
    """The world at the end, the start poses of the boxes, and their path lengths [m]."""
    task = look_up("task", TASKS, "maze")(preset="testbed", variations={}, action="velocity")
    count = len(case.boxes)
    world = World(
        robot=task.robot,
        robot_pose=np.zeros(3),
        static=StaticMap.build(bounds=(-1.5, -1.5, 1.5, 1.5)),
        movables=Movables.from_outlines(
            [SQUARE] * count,
            np.array(case.boxes),
            masses=np.full(count, 0.1),
            wheeled=np.full(count, case.wheeled),
        ),
        goal=GoalDisc(np.array([9.0, 9.0]), 0.1),  # out of sight
    )
    engine = look_up("simulator", SIMULATORS, simulator)()
    engine.build(world, task.materials)
    lengths = np.zeros(count)
    for speed, turn in case.commands:
        before = engine.object_poses
        lengths += engine.step(Twist(speed, turn), PERIOD).object_lengths(before)
    return engine.world(), world.movables.poses, lengths


def compare(case: Case) -> tuple[dict[str, NDArray[np.float64]], World, World]:
    """How far apart the two end."""
    flat, starts, flat_lengths = run(case, "pymunk")
    solid, _, solid_lengths = run(case, "mujoco")
    a = flat.movables.poses
    b = solid.movables.poses
    moved = np.maximum(np.hypot(*(a - starts)[:, :2].T), np.hypot(*(b - starts)[:, :2].T)) > 1e-3
    turn = np.remainder(flat.robot_pose[2] - solid.robot_pose[2] + np.pi, 2 * np.pi) - np.pi
    found = {
        "robot": np.hypot(*(flat.robot_pose - solid.robot_pose)[:2]),
        "heading": np.abs(turn),
        "boxes": np.hypot(*(a - b)[moved, :2].T),
        "work": np.array([flat_lengths.sum(), solid_lengths.sum()]),
    }
    return found, flat, solid


def picture(cases: list[tuple[Case, World, World]], path: str) -> None:
    """Two rows: where the planar simulator ends, and where the other one does."""
    bounds = (-0.2, -0.25, 0.9, 0.5)
    panels = []
    for which, name in ((1, "pymunk"), (2, "mujoco")):
        for entry in cases:
            world = entry[which]  # type: ignore[misc]
            assert isinstance(world, World)
            shown = replace(world, static=StaticMap.build(bounds=bounds))
            panels.append(Panel(shown, title=f"{name}\n{entry[0].name}"))
    save_figure(path, draw_figure(*panels, width_in=9.0, columns=len(cases)))


def main() -> None:
    """Print the table and draw the picture."""
    parser = command_line(__doc__, seeds=12)
    parser.add_argument("--picture", metavar="FILE")
    options = parser.parse_args()
    print(f"{'case':36} {'robot':>9} {'heading':>8} {'boxes: median':>14} {'worst':>9} work 2D, 3D")
    shown = []
    for case in CASES:
        found, flat, solid = compare(case)
        report(case.name, [found])
        shown.append((case, flat, solid))
    report(
        f"random driving, {options.seeds} seeds",
        [compare(scattered(seed))[0] for seed in range(options.seeds)],
    )
    if options.picture:
        picture([shown[i] for i in (1, 2, 4, 6)], options.picture)


def report(name: str, found: list[dict[str, NDArray[np.float64]]]) -> None:
    """One row of the table."""
    boxes = np.concatenate([[0.0], *(entry["boxes"] for entry in found)])
    boxes = boxes[1:] if len(boxes) > 1 else boxes  # nothing moved in either
    work = np.sum([entry["work"] for entry in found], axis=0)
    robot = np.median([entry["robot"] for entry in found])
    heading = np.degrees(np.median([entry["heading"] for entry in found]))
    print(
        f"{name:36} {robot * 1e3:6.1f} mm {heading:5.1f} deg "
        f"{np.median(boxes) * 1e3:11.1f} mm {boxes.max() * 1e3:6.1f} mm "
        f"{work[0]:.3f}, {work[1]:.3f} m",
        flush=True,
    )


if __name__ == "__main__":
    main()
