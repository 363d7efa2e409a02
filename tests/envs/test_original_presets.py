"""The preset that has the 2D benchmark's own robots, radii and starts."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from pushplan.envs import PushEnv
from pushplan.world import World
from pushplan.world.outline_repair import OutlineWarning


def original(task: str, **variations: object) -> PushEnv:
    env = PushEnv(task=task, preset="original", variations=variations, observation="state")
    env.reset(seed=0)
    return env


@pytest.mark.parametrize(
    ("task", "size", "turn", "friction"),
    [
        ("maze", (1.44, 1.44), np.pi / 30, (0.0, 1.0, 0.5)),
        ("ship_ice", (2.04, 0.54), np.pi / 14, (1.0, 1.0, 1.0)),
        ("area_clearing", (1.37, 2.44), np.pi / 60, (0.0, 1.0, 0.99)),
        ("box_delivery", (0.8, 0.7), 1.0, (1.0, 1.0, 1.0)),
    ],
)
def test_dimensions(
    task: str, size: tuple[float, float], turn: float, friction: tuple[float, float, float]
) -> None:
    env = original(task)
    world, robot = env.world, env.world.robot
    parts = [shapely.Polygon(part).buffer(robot.contact_radius, 64) for part in robot.parts]
    x0, y0, x1, y1 = shapely.union_all(parts).bounds
    np.testing.assert_allclose((x1 - x0, y1 - y0), size, atol=1e-3)
    assert robot.max_turn_rate == pytest.approx(turn)
    assert (world.movables.contact_radii == 0.02).all()
    materials = env.task.materials
    found = materials.robot_object, materials.object_object, materials.object_static
    assert found == friction


def test_the_wheels_of_the_maze_robot() -> None:
    robot = original("maze").world.robot
    assert robot.wheel_parts == 4 and robot.contact_radius == 0.02
    wheels = np.concatenate(robot.parts[1:])
    np.testing.assert_allclose(np.ptp(wheels, axis=0), (1.1, 1.4))
    np.testing.assert_allclose(np.ptp(robot.parts[0], axis=0), (1.4, 1.2))


def gaps(world: World) -> np.ndarray:
    robot = shapely.union_all([shapely.Polygon(part) for part in world.robot_outline_world()])
    boxes = [shapely.Polygon(world.movables.outline_world(k)) for k in range(len(world.movables))]
    for i, box in enumerate(boxes):
        assert not any(box.intersects(other) for other in boxes[:i])
    return np.array([box.distance(robot) for box in boxes])


@pytest.mark.parametrize(("task", "boxes"), [("maze", 20), ("area_clearing", 10)])
def test_boxes_may_start_in_touch_with_the_robot(task: str, boxes: int) -> None:
    env, apart = original(task, boxes=boxes), original(task, boxes=boxes, touching=False)
    touching = 0
    for seed in range(12):
        env.reset(seed=seed)
        found = gaps(env.world)
        assert found.min() > 0.0
        touching += int((found < 1e-5).sum())
        apart.reset(seed=seed)
        assert gaps(apart.world).min() > 1e-3
        speed = env.action_space.shape[0]
        env.step(np.full(speed, 0.2, np.float32))
    assert touching > 0


@pytest.mark.parametrize(
    ("task", "variations", "steps", "reason"),
    [
        ("maze", {"time_limit": 4.0, "boxes": 0}, 5, "time_limit"),
        ("ship_ice", {"time_limit": 1.6, "concentration": 0.0}, 2, "time_limit"),
        ("area_clearing", {"idle_limit": 0.6}, 3, "no_progress"),
        ("box_delivery", {"idle_limit": 0.4}, 2, "no_progress"),
    ],
)
def test_limits_can_be_asked_for(
    task: str, variations: dict[str, float], steps: int, reason: str
) -> None:
    actions = {"maze": "turn_rate", "ship_ice": "turn_rate"}
    env = PushEnv(
        task=task,
        preset="original",
        variations=variations,
        observation="state",
        action=actions.get(task, "velocity"),
    )
    env.reset(seed=1)
    for step in range(1, steps + 1):
        *_, truncated, info = env.step(np.zeros(env.action_space.shape, np.float32))
        assert truncated == (step == steps)
    assert info["reason"] == reason


def test_its_ice_fields_may_overlap_and_touch_the_ship(tmp_path: object) -> None:
    path = f"{tmp_path}/ice.npz"
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    floes = [square + at for at in ((4.0, 3.0), (4.9, 3.0), (5.5, 2.0))]
    np.savez(path, vertices=np.concatenate(floes), offsets=np.arange(4) * 4)
    world = original("ship_ice", ice_file=path, start_x=6.0).world
    assert len(world.movables) == 3 and world.robot_pose[1] == 1.0
    assert world.movables.masses.tolist() == pytest.approx([1.0, 1.0, 1.0])
    with pytest.warns(OutlineWarning, match="floes overlapped in 1 places"):
        PushEnv(task="ship_ice", variations={"ice_file": path})
