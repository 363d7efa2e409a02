"""Pushes of objects that are not convex: the robot touches their parts, and they move as one."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from conftest import make_u_maze

from pushplan.interaction import QuasiStatic
from pushplan.interaction.ice_interaction import IceInteraction
from pushplan.world import Movables, RobotModel, StaticMap, World

U_SHAPE = [[0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]]  # open upwards
OPEN = StaticMap.build(bounds=[-50, -50, 50, 50])
MODELS = [QuasiStatic(), QuasiStatic(friction=0.3), IceInteraction()]


def small_robot() -> RobotModel:
    return RobotModel.from_outline(
        [[-0.3, -0.3], [0.3, -0.3], [0.3, 0.3], [-0.3, 0.3]],
        mass=1.0,
        drive="differential",
        max_speed=1.0,
        max_turn_rate=1.0,
    )


def scene(shapes: list, robot_pose: list[float]) -> World:
    movables = Movables.from_polygons(shapes)
    return make_u_maze(movables=movables, static=OPEN, robot=small_robot(), robot_pose=robot_pose)


def drive_down(x: float, start: float, end: float) -> np.ndarray:
    y = np.linspace(start, end, 41)
    return np.column_stack([np.full(41, x), y, np.full(41, -np.pi / 2)])


@pytest.mark.parametrize("model", MODELS)
def test_a_robot_drives_into_a_notch_and_pushes_at_its_bottom(model):
    world = scene([U_SHAPE], [1.5, 6.0, -np.pi / 2])
    before = world.movables.poses[0]
    inside = model.sweep(world, drive_down(1.5, 6.0, 1.5)).object_poses[-1, 0]
    np.testing.assert_allclose(inside, before, atol=1e-9)
    pushed = model.sweep(world, drive_down(1.5, 6.0, 0.5)).object_poses[-1, 0]
    # the robot's front is 0.3 ahead of its middle: from 1.3 on it pushes
    np.testing.assert_allclose(pushed, before - [0.0, 0.8, 0.0], atol=0.02)


@pytest.mark.parametrize("model", MODELS)
def test_a_prong_is_pushed_and_all_of_the_object_turns(model):
    world = scene([U_SHAPE], [0.5, 6.0, -np.pi / 2])
    moved = model.sweep(world, drive_down(0.5, 6.0, 2.8)).object_poses[-1, 0]
    assert moved[1] < world.movables.poses[0, 1] and moved[2] > 0.02  # counter-clockwise


@pytest.mark.parametrize("model", MODELS)
def test_cutting_an_object_into_parts_changes_little(model):
    whole = [[0, 0], [2, 0], [2, 1], [0, 1]]
    halves = [[[0, 0], [1, 0], [1, 1], [0, 1]], [[1, 0], [2, 0], [2, 1], [1, 1]]]
    ends = [
        model.sweep(scene([shape], [0.4, 3.0, -np.pi / 2]), drive_down(0.4, 3.0, 0.6)).object_poses
        for shape in (whole, halves)
    ]
    np.testing.assert_allclose(ends[0][-1], ends[1][-1], atol=0.02)
    assert abs(ends[0][-1, 0, 2]) > 0.1


@pytest.mark.parametrize("model", MODELS)
def test_objects_push_objects_by_their_parts(model):
    """A box within the notch stays until the notch's bottom comes to it."""
    box = [[1.2, 2.0], [1.8, 2.0], [1.8, 2.6], [1.2, 2.6]]
    world = scene([U_SHAPE, box], [1.5, -2.0, np.pi / 2])
    path = drive_down(1.5, -2.0, 0.0) * [1, 1, -1]  # up from below
    first = model.sweep(world, path).object_poses
    np.testing.assert_allclose(first[-1, 1], world.movables.poses[1], atol=1e-9)
    assert first[-1, 0, 1] - first[0, 0, 1] == pytest.approx(0.3, abs=0.02)
    farther = drive_down(1.5, -2.0, 1.5) * [1, 1, -1]
    last = model.sweep(world, farther).object_poses
    assert last[-1, 1, 1] - last[0, 1, 1] == pytest.approx(0.8, abs=0.05)


def test_a_compound_object_jams_at_a_wall_by_the_part_that_touches_it():
    wall = StaticMap.build(
        [[[-5, -1.5], [0.9, -1.5], [0.9, -0.5], [-5, -0.5]]], bounds=[-9, -9, 9, 9]
    )
    legs = [
        [[0, 0], [1, 0], [1, 1], [0, 1]],
        [[2, 0], [3, 0], [3, 1], [2, 1]],
        [[0, 1], [3, 1], [3, 2], [0, 2]],
    ]
    world = scene([legs], [0.5, 4.0, -np.pi / 2])
    world = make_u_maze(
        movables=world.movables, static=wall, robot=small_robot(), robot_pose=world.robot_pose
    )
    result = QuasiStatic(static_friction=0.5).sweep(world, drive_down(0.5, 4.0, 1.0))
    assert result.jammed_at > 0
    end = world.movables.moved_to(result.object_poses[-1])
    stone = shapely.Polygon(wall.polygons[0])
    inside = [shapely.Polygon(part).intersection(stone).area for part in end.parts_world(0)]
    assert max(inside) < 0.02 and end.poses[0, 1] < world.movables.poses[0, 1] - 0.2
