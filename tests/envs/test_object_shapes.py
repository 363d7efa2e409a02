"""Tasks with objects of many shapes: where they start, what they weigh, and that engines agree."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely

from pushplan.envs import RolloutInteraction, make
from pushplan.envs.tasks.layout import SHAPES
from pushplan.interaction import QuasiStatic
from pushplan.scenarios import Scenario
from pushplan.world import StaticMap

TASKS = {"maze": {}, "area_clearing": {"layout": "walled"}, "box_delivery": {}}


def start(task, simulator="pymunk", preset="benchmark", seed=0, **variations):
    wanted = {**TASKS[task], **variations}
    scenario = Scenario(task, simulator=simulator, preset=preset, seed=seed, variations=wanted)
    env = make(scenario).unwrapped
    env.reset()
    return env


@pytest.mark.parametrize("task", TASKS)
def test_they_start_apart_and_weigh_what_a_box_does(task):
    seen = set()
    for seed in range(4):
        world = start(task, seed=seed, objects="many", boxes=10).world
        boxes = start(task, seed=seed, boxes=10).world.movables
        movables = world.movables
        shapes = [
            shapely.union_all([shapely.Polygon(part) for part in movables.parts_world(k)])
            for k in range(10)
        ]
        squares = [shapely.Polygon(boxes.outline_world(k)) for k in range(10)]
        for shape, square in zip(shapes, squares, strict=True):
            assert shape.difference(square.buffer(1e-9)).area < 1e-12  # each in its square
        assert not any(a.overlaps(b) for i, a in enumerate(shapes) for b in shapes[:i])
        np.testing.assert_array_equal(movables.masses, boxes.masses)
        seen |= {(len(movables.parts(k)), round(movables.areas[k], 6)) for k in range(10)}
    assert len(seen) == len(SHAPES) - 1  # L and T have the same area in as many parts


@pytest.mark.parametrize("preset", ["benchmark", "testbed"])
def test_both_engines_push_them(preset):
    simulator = {"benchmark": "pymunk", "testbed": "mujoco"}[preset]
    env = start("maze", simulator, preset=preset, objects="many", boxes=6)
    world = env.world
    k = int(np.argmax([len(world.movables.parts(k)) for k in range(6)]))
    x, y, _ = world.movables.poses[k]
    reach = world.robot.circumscribed_radius + world.movables.radii[k]
    start_pose = np.array([x - 1.1 * reach, y, 0.0])
    alone = replace(
        world,
        robot_pose=start_pose,
        movables=world.movables.select([k]),
        static=StaticMap.build(bounds=[-99, -99, 99, 99]),
    )
    path = start_pose + np.outer(np.linspace(0.0, 1.2 * reach, 30), [1.0, 0.0, 0.0])
    found = RolloutInteraction(simulator, env.task.materials).sweep(alone, path)
    predicted = QuasiStatic(friction=0.4 * (simulator == "mujoco")).sweep(alone, path)
    assert found.lengths[0] > 0.2 * reach
    assert found.lengths[0] == pytest.approx(predicted.lengths[0], rel=0.2)


def test_without_the_variation_all_are_boxes():
    world = start("maze", boxes=5).world
    assert not world.movables.is_compound and len(world.movables.parts(0)) == 1
