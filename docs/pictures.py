"""Draw the pictures of the docs that no benchmark draws.

Usage::

    python docs/pictures.py [NAME ...]

Writes into docs/images: `box-delivery-layouts`, `area-clearing-layouts`, `namo-order`, `rearrange`,
`film`, `sensing`, `mujoco`, `gtsp-mpc`, `push-aware`, `ship-planners`; all of them without a name.
`mujoco` needs OpenGL (docs/simulators-mujoco.md).
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

from pushplan.drawing import (
    Panel,
    draw_figure,
    draw_world,
    save_animation,
    save_figure,
    save_image,
)
from pushplan.drawing.palette import DASHES, SERIES
from pushplan.envs import PushEnv, RolloutInteraction, make
from pushplan.envs.simulators.mujoco_simulator import MujocoSimulator
from pushplan.envs.tasks.ship_ice import ShipIceTask
from pushplan.evaluation import run_episode
from pushplan.planners import make_planner, make_policy
from pushplan.planners.rearrangement import GtspMpc
from pushplan.scenarios import Scenario, suite
from pushplan.world import GoalDisc, Movables, RobotModel, StaticMap, World, stream

IMAGES = Path(__file__).parent / "images"
FRAMES = 120  # of a film
PAUSE = 18  # frames at its end
FILM_HEIGHT = 360  # [px]
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


def start_and_end(name: str, first_seed: int, policy: str, file: str) -> None:
    """Start and end of an episode of a suite."""
    scenario = suite(name, episodes=1, first_seed=first_seed).scenarios[0]
    with make(scenario) as env:
        episode = run_episode(env, make_policy(policy), scenario)
    world = episode.world_at(len(episode.times) - 1)
    trails = {"trail": episode.robot_poses, "object_trails": episode.object_poses}
    panels = (Panel(episode.world, title="start"), Panel(world, title="end", **trails))
    save_figure(IMAGES / file, draw_figure(*panels, width_in=7.0))


def film() -> None:
    """One robot pushes a box out of a doorway, another clears an area; side by side."""
    films = []
    for name, seed, policy in (
        ("namo-2d-one-box", 1, "namo"),
        ("area-clearing-2d-10-clear-small", 1, "gtsp-mpc"),
    ):
        scenario = suite(name, episodes=1, first_seed=seed).scenarios[0]
        with make(scenario, action=("velocity", "turn_rate")) as env:
            episode = run_episode(env, make_policy(policy), scenario)
        steps = np.linspace(0, len(episode.times) - 1, FRAMES).astype(int)
        films.append(
            [
                draw_world(
                    episode.world_at(i), trail=episode.robot_poses[: i + 1], size_px=FILM_HEIGHT
                )
                for i in (*steps, *[steps[-1]] * PAUSE)
            ]
        )
    save_animation(IMAGES / "pushes.gif", map(_beside, *films), fps=12.0)


def _beside(*pictures: np.ndarray) -> np.ndarray:
    """Pictures in a row, on white."""
    height = max(picture.shape[0] for picture in pictures)
    padded = []
    for picture in pictures:
        free = height - picture.shape[0]
        rows = (free // 2, free - free // 2)
        padded.append(np.pad(picture, (rows, (8, 8), (0, 0)), constant_values=255))
    return np.concatenate(padded, axis=1)


def sensing() -> None:
    """The knowledge of a robot with a lidar about a maze at four times, with its plan."""
    scenario = suite("maze-2d-10-lidar", episodes=1, first_seed=1).scenarios[0]
    pictures = []

    def look(step: int, world: World, policy: Any) -> None:
        if step in (1, 90, 160, 200):
            pictures.append(draw_world(world, plan=policy.current_plan, size_px=320))

    with make(scenario, observation="state", action=("velocity",)) as env:
        run_episode(env, make_policy("push-aware"), scenario, observer=look)
    save_image(IMAGES / "sensing.png", _beside(*pictures))


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


def first_pushes() -> None:
    """First plans of `gtsp-mpc` in two suites, side by side."""
    panels = []
    for name in ("area-clearing-2d-10", "box-delivery-2d-small-columns-10"):
        scenario = suite(name, episodes=1).scenarios[0]
        env = make(scenario, observation="state", action=("velocity",))
        env.reset(seed=scenario.seed)
        policy = GtspMpc()
        policy.act(env.world)
        panels.append(Panel(env.world, pushes=[push.poses for push in policy.plan], title=name))
        env.close()
    save_figure(IMAGES / "gtsp-mpc.png", draw_figure(*panels, width_in=7.0))


def door() -> None:
    """A plan through the only door, in which a box stands, as the simulator drives it."""
    square = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    walls = [[0, 0, 16, 0], [0, 8, 16, 8], [0, 0, 0, 8], [16, 0, 16, 8]]
    gap = [[7, 0, 7, 2.9], [7, 5.1, 7, 8]]
    boxes = np.array([[7.0, 4.3, 0.3], [9.2, 3.2, 0.2], [8.9, 5.2, 0.5]])
    world = World(
        robot=RobotModel.from_outline(
            1.4 * square, mass=1.0, drive="constant_speed", max_speed=0.15, max_turn_rate=0.3
        ),
        robot_pose=[2.0, 4.0, 0.0],
        static=StaticMap.build(segments=[*walls, *gap], radii=0.2, bounds=[0, 0, 16, 8]),
        movables=Movables.from_outlines([square] * 3, boxes),
        goal=GoalDisc([14.0, 4.0], 0.8),
    )
    plan = make_planner("push-aware").plan(world).plan
    assert plan is not None
    driven = RolloutInteraction().sweep(world, plan.poses)
    panels = []
    for share in (0.0, 0.5, 1.0):
        at = int(share * (len(plan.poses) - 1))
        now = world.moved(robot_pose=plan.poses[at], movable_poses=driven.object_poses[at])
        trails = driven.object_poses[: at + 1]
        path = plan.poses[: at + 1]
        driving = {"trail": path, "object_trails": trails} if at else {"plan": plan}
        panels.append(Panel(now, **driving))
    save_figure(IMAGES / "push-aware.png", draw_figure(*panels, width_in=3.8, columns=1))


def ship_plans() -> None:
    """First plan of every ship planner on one field of 30 %."""
    import matplotlib.pyplot as plt
    from matplotlib.collections import PolyCollection

    task = ShipIceTask(variations={"concentration": 0.3})
    world = task.start(stream(1003, "layout"))
    figure, axes = plt.subplots(figsize=(6.4, 5.4), dpi=110)
    outlines = [world.movables.outline_world(k) for k in range(len(world.movables))]
    floes = PolyCollection(outlines, facecolor="#dce6ee", edgecolor="#9fb2c0", linewidth=0.5)
    axes.add_collection(floes)
    hulls = PolyCollection(world.robot_outline_world(), facecolor="#444444", zorder=5)
    axes.add_collection(hulls)
    names = (
        "straight",
        "skeleton",
        "ship-lattice-published",
        "ship-lattice-quick",
        "ship-lattice",
        "ship-predictive",
    )
    for name, color, dashes in zip(names, SERIES, DASHES, strict=False):
        plan = make_planner(name).plan(world).plan
        if plan is not None:
            line = {"color": color, "linestyle": dashes, "linewidth": 1.8}
            axes.plot(*plan.poses[:, :2].T, label=name, **line)
    axes.axhline(9.0, color="#666666", linestyle="--", linewidth=0.8)
    axes.set(aspect="equal", xlim=world.static.bounds[[0, 2]], ylim=(0.0, 9.6))
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, 1.13), ncols=3, frameon=False)
    figure.savefig(IMAGES / "ship-planners.png", bbox_inches="tight")


DRAWN = {
    "box-delivery-layouts": lambda: layouts("box_delivery"),
    "area-clearing-layouts": lambda: layouts("area_clearing"),
    "namo-order": lambda: start_and_end("namo-2d-order", 1001, "namo", "namo-order.png"),
    "rearrange": lambda: start_and_end("rearrange-2d-3", 1001, "gtsp-mpc", "rearrange.png"),
    "film": film,
    "sensing": sensing,
    "mujoco": mujoco,
    "gtsp-mpc": first_pushes,
    "push-aware": door,
    "ship-planners": ship_plans,
}

if __name__ == "__main__":
    for wanted in sys.argv[1:] or DRAWN:
        DRAWN[wanted]()
