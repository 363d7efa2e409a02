"""The two contact engines in ice: path steps per second, and predicted work.

    python -m benchmarks.accuracy.contact_engines [--scenes 4]

Each sweep runs several times in turn, by the process's own time: the rates are medians of these
rounds, the ratio is that of the least and of the greatest round.
"""

from __future__ import annotations

import time

import numpy as np

from benchmarks.reporting import command_line
from pushplan.envs import make
from pushplan.interaction import QuasiStatic
from pushplan.interaction.ice_interaction import IceInteraction
from pushplan.scenarios import Scenario

STEPS = 60
ROUNDS = 7


def compare(concentration: float, scenes: int) -> None:
    models = (QuasiStatic(friction=1.0), IceInteraction())
    seconds = np.zeros((ROUNDS, 2))
    work = np.zeros(2)
    steps = 0
    for seed in range(scenes):
        variations = {"concentration": concentration}
        env = make(Scenario("ship_ice", variations=variations, seed=seed), observation="state")
        env.reset(seed=seed)
        world = env.world
        length = 0.1 * world.robot.circumscribed_radius
        x, y, theta = world.robot_pose
        along = length * np.arange(STEPS)
        path = np.column_stack(
            [x + along * np.cos(theta), y + along * np.sin(theta), np.full(STEPS, theta)]
        )
        work += [model.sweep(world, path).work for model in models]
        for times in seconds:
            for i, model in enumerate(models):
                began = time.process_time()
                model.sweep(world, path)
                times[i] += time.process_time() - began
        steps += STEPS
    rates = steps / np.median(seconds, axis=0)
    ratios = seconds[:, 0] / seconds[:, 1]
    print(
        f"{concentration:.0%} ice, {len(world.movables)} floes: quasi-static {rates[0]:.0f} "
        f"steps/s, ice {rates[1]:.0f} steps/s ({ratios.min():.1f} to {ratios.max():.1f} x); "
        f"work ice / quasi-static {work[1] / work[0]:.2f}"
    )


def main() -> None:
    scenes = command_line(__doc__, scenes=4).parse_args().scenes
    for concentration in (0.2, 0.5):
        compare(concentration, scenes)


if __name__ == "__main__":
    main()
