"""The quasi-static model against the Pymunk rollout: how far off, and how much faster.

    python -m benchmarks.accuracy.interaction [--scenes 200]

Random drives through random scenes of the maze, both models from the same snapshot along
the same path. Prints the error of displacement and work, beside that of the null model (nothing
moves), and path steps per second.
"""

from __future__ import annotations

import time

import numpy as np

from benchmarks.reporting import command_line
from pushplan.core import motion as core
from pushplan.envs import RolloutInteraction, make
from pushplan.interaction import Interaction, QuasiStatic
from pushplan.scenarios import Scenario
from pushplan.world import World
from pushplan.world.checks import FloatArray

STEPS = 120
SPACING = 0.1


def random_drive(world: World, rng: np.random.Generator) -> FloatArray:
    """(N, 3) poses of a winding drive from the robot's pose, SPACING apart [m]."""
    path = np.empty((STEPS, 3))
    path[0] = world.robot_pose
    bend = 0.0
    for i in range(1, STEPS):
        bend = float(np.clip(bend + rng.normal(0.0, 0.15), -0.6, 0.6))
        core.along_arc(path[i - 1], SPACING, bend, path[i])
    return path


def compare(boxes: int, scenes: int) -> None:
    quick = QuasiStatic()
    slow = RolloutInteraction()
    rows: list[tuple[float, float, float]] = []
    per_object: list[tuple[float, float]] = []
    quick_s = slow_s = 0.0
    jams = agree = steps = 0
    for seed in range(scenes):
        rng = np.random.default_rng(seed)
        scenario = Scenario("maze", variations={"boxes": boxes, "random_start": True}, seed=seed)
        env = make(scenario, observation="state")
        env.reset(seed=seed)
        world = env.world
        path = random_drive(world, rng)
        began = time.perf_counter()
        a: Interaction = quick.sweep(world, path)
        middle = time.perf_counter()
        b = slow.sweep(world, path)
        quick_s = quick_s + middle - began
        slow_s = slow_s + time.perf_counter() - middle
        last = min(i if i >= 0 else STEPS for i in (a.jammed_at, b.jammed_at))
        jams += b.jammed_at >= 0
        agree += (a.jammed_at >= 0) == (b.jammed_at >= 0)
        steps += last
        ends = [m.object_poses[last - 1, :, :2] - m.object_poses[0, :, :2] for m in (a, b)]
        moved = np.hypot(*ends[1].T)
        per_object += [
            (float(e), float(m))
            for e, m in zip(np.hypot(*(ends[0] - ends[1]).T), moved, strict=True)
            if m > 0.01
        ]
        cut = [Interaction(m.object_poses[:last], m.masses).work for m in (a, b)]
        rows.append((cut[0], cut[1], abs(cut[0] - cut[1])))
    work = np.array(rows)
    errors = np.array(per_object).reshape(-1, 2)
    print(f"{boxes} boxes, {scenes} scenes, {len(errors)} objects moved by more than 1 cm")
    print(f"  displacement of those: mean {errors[:, 1].mean():.3f} m (the null model's error)")
    print(
        f"  error of their end positions: mean {errors[:, 0].mean():.3f} m, "
        f"median {np.median(errors[:, 0]):.4f} m"
    )
    print(
        f"  work: rollout {work[:, 1].mean():.3f}, quasi-static {work[:, 0].mean():.3f}, "
        f"mean |difference| {work[:, 2].mean():.3f} kg m, "
        f"correlation {np.corrcoef(work[:, 0], work[:, 1])[0, 1]:.4f}"
    )
    print(f"  jams: {jams} in the rollout, the model agrees in {agree} of {scenes} scenes")
    print(
        f"  path steps of {SPACING} m a second: quasi-static {steps / quick_s:,.0f}, "
        f"rollout {steps / slow_s:,.0f}, ratio {slow_s / quick_s:.0f}"
    )


def main() -> None:
    scenes = command_line(__doc__, scenes=200).parse_args().scenes
    QuasiStatic().sweep(make_warm(), np.zeros((2, 3)))
    for boxes in (5, 10, 20):
        compare(boxes, scenes)


def make_warm() -> World:
    """Any world, so that no import is timed."""
    env = make(Scenario("maze"), observation="state")
    env.reset(seed=0)
    return env.world


if __name__ == "__main__":
    main()
