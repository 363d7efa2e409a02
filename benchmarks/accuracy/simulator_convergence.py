"""How far the Pymunk simulator's default substeps are from ten times finer ones.

Usage::

    python -m benchmarks.accuracy.simulator_convergence [--scenes 20]

Each scene is a random maze start without its walls. The same random drive (60 control steps of
0.8 s in the benchmark preset, 100 of 0.15 s in the testbed's) runs twice, with the default options
and with travel and slop ten times smaller. Errors are distances between the two final positions of
every box that moved, as a share of the box's side.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.reporting import command_line
from pushplan.envs.simulators.pymunk_simulator import PymunkOptions, PymunkSimulator
from pushplan.envs.tasks.maze import MazeTask
from pushplan.world import StaticMap, Twist, stream
from pushplan.world.checks import FloatArray


def drive(
    preset: str, boxes: int, seed: int, options: PymunkOptions
) -> tuple[FloatArray, FloatArray]:
    """Final positions (K, 2) and path lengths (K,) of the boxes [m]."""
    task = MazeTask(preset=preset, variations={"boxes": boxes, "random_start": True})
    far_away = StaticMap.build(segments=[(500, 500, 501, 500)], bounds=(-600, -600, 600, 600))
    simulator = PymunkSimulator(options)
    simulator.build(replace(task.start(stream(seed, "layout")), static=far_away), task.materials)
    rng = stream(seed, "drive")
    lengths = np.zeros(boxes)
    turn = 0.0
    for i in range(60 if preset == "benchmark" else 100):
        if i % 8 == 0:
            turn = rng.uniform(-1.0, 1.0) * task.robot.max_turn_rate
        before = simulator.save().object_poses
        trace = simulator.step(Twist(task.robot.max_speed, turn), task.control_step)
        lengths += trace.object_lengths(before)
    return simulator.save().object_poses[:, :2], lengths


def main() -> None:
    """Print one row for each preset and number of boxes."""
    parser = command_line(__doc__, scenes=20)
    scenes = parser.parse_args().scenes
    default = PymunkOptions()
    fine = replace(default, travel=default.travel / 10, slop=default.slop / 10, iterations=60)
    print("preset     boxes  moved  error: median     p95     max   work: total   worst scene")
    for preset, size in (("benchmark", 1.0), ("testbed", 0.08)):
        for boxes in (5, 10, 20):
            errors = []
            work = []
            reference = []
            for seed in range(scenes):
                ends, lengths = drive(preset, boxes, seed, default)
                fine_ends, fine_lengths = drive(preset, boxes, seed, fine)
                gaps = np.hypot(*(ends - fine_ends).T) / size
                errors += gaps[fine_lengths > 0.0].tolist()
                work.append(lengths.sum())
                reference.append(fine_lengths.sum())
            off = np.abs(np.subtract(work, reference))
            some = np.array(reference) > 0.1 * size
            worst = (off[some] / np.array(reference)[some]).max()
            print(
                f"{preset:10} {boxes:5} {len(errors):6} {np.median(errors):14.2%} "
                f"{np.quantile(errors, 0.95):7.2%} {max(errors):7.2%} "
                f"{off.sum() / sum(reference):12.2%} {worst:12.2%}"
            )


if __name__ == "__main__":
    main()
