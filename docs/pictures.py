"""Draw the pictures of the docs that no benchmark draws.

Usage::

    python docs/pictures.py [NAME ...]

Writes into docs/images: `box-delivery-layouts`, `area-clearing-layouts`, `namo-order`, `mujoco`;
all of them without a name. The last one needs OpenGL (docs/simulators-mujoco.md).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from pushplan.drawing import Panel, draw_figure, save_figure, save_image
from pushplan.envs import PushEnv, make
from pushplan.envs.simulators.mujoco_simulator import MujocoSimulator
from pushplan.evaluation import run_episode
from pushplan.planners import make_policy
from pushplan.scenarios import Scenario, suite

IMAGES = Path(__file__).parent / "images"
LAYOUTS = {
    "box_delivery": ("small_empty", "small_columns", "large_columns", "large_divider"),
    "area_clearing": ("clear", "clear_small", "walled", "walled_with_columns"),
}


def layouts(task: str) -> None:
    """A start in every layout of a task, two boxes of five on casters."""
    panels = []
    for layout in LAYOUTS[task]:
        variations = {"layout": layout, "wheeled": 0.4}
        with make(Scenario(task, "pymunk", seed=2, variations=variations)) as env:
            env.reset(seed=2)
            panels.append(Panel(env.world, title=layout))
    figure = draw_figure(*panels, width_in=9.0)
    save_figure(IMAGES / f"{task.replace('_', '-')}-layouts.png", figure)


def namo_order() -> None:
    """A box that goes through its door, and a wide one that goes aside."""
    scenario = suite("namo-2d-order", episodes=1, first_seed=1001).scenarios[0]
    with make(scenario) as env:
        episode = run_episode(env, make_policy("namo"), scenario)
    world = episode.world_at(len(episode.times) - 1)
    trails = {"trail": episode.robot_poses, "object_trails": episode.object_poses}
    panels = (Panel(episode.world, title="start"), Panel(world, title="end", **trails))
    save_figure(IMAGES / "namo-order.png", draw_figure(*panels, width_in=7.0))


def mujoco() -> None:
    """Area-Clearing and Ship-Ice by MuJoCo's camera."""
    pictures = []
    for name, width in (("area-clearing-3d-10", 720), ("ship-ice-3d-30", 480)):
        scenario = suite(name, episodes=1).scenarios[0]
        simulator = MujocoSimulator()
        env = PushEnv(
            task=scenario.task,
            simulator=simulator,
            preset=scenario.preset,
            variations=scenario.variations,
        )
        env.reset(seed=scenario.seed)
        pictures += [simulator.photograph(width, 720), np.full((720, 8, 3), 255, dtype=np.uint8)]
        env.close()
    save_image(IMAGES / "mujoco.png", np.concatenate(pictures[:-1], axis=1))


DRAWN = {
    "box-delivery-layouts": lambda: layouts("box_delivery"),
    "area-clearing-layouts": lambda: layouts("area_clearing"),
    "namo-order": namo_order,
    "mujoco": mujoco,
}

if __name__ == "__main__":
    for wanted in sys.argv[1:] or DRAWN:
        DRAWN[wanted]()
