"""The quasi-static model against mechanics worked out by hand, and against its own rules."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import make_boxes, make_robot, make_u_maze, scattered_boxes
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon

from pushplan.envs.rollout import RolloutInteraction
from pushplan.geometry import convex_penetration
from pushplan.interaction import Interaction, InteractionModel, QuasiStatic
from pushplan.world import InvalidInputError, RobotModel, StaticMap, World


def straight_path(x0: float, x1: float, y: float, steps: int) -> np.ndarray:
    return np.column_stack([np.linspace(x0, x1, steps), np.full(steps, y), np.zeros(steps)])


def open_floor(boxes, **changes) -> World:
    return make_u_maze(boxes, static=StaticMap.build(bounds=[-50, -50, 50, 50]), **changes)


def test_it_is_an_interaction_model():
    assert isinstance(QuasiStatic(), InteractionModel)


def test_a_flat_push_moves_the_box_straight():
    # front of the octagon at x + 0.7; the box's near face is at 2.5
    result = QuasiStatic().sweep(open_floor([[3, 5, 0]]), straight_path(1, 5, 5, 41))
    assert result.object_poses[-1, 0] == pytest.approx([5 + 0.7 + 0.5, 5, 0], abs=1e-6)
    assert result.lengths == pytest.approx([3.2], abs=1e-6)
    assert result.work == pytest.approx(3.2, abs=1e-6)
    assert result.jammed_at == -1


def test_work_counts_mass_and_path_length_there_and_back():
    world = open_floor([[3, 5, 0], [-1, 5, 0]])
    path = np.concatenate([straight_path(1, 2.3, 5, 14), straight_path(2.3, -0.3, 5, 27)])
    result = QuasiStatic().sweep(world, path)
    assert result.lengths == pytest.approx([0.5, 0.5], abs=1e-6)
    heavy = Interaction(result.object_poses, np.array([2.0, 3.0]))
    assert heavy.work == pytest.approx(2.5, abs=1e-6)


def test_a_point_push_off_centre_turns_the_box_by_the_limit_surface():
    # one small push d at lever arm a along a face: rotation / advance = (a / c²) / (1 + a² / c²)
    tip = RobotModel.from_outline(
        [[0.0, 0.0], [-0.5, 0.05], [-0.5, -0.05]],
        mass=1.0,
        drive="differential",
        max_speed=1.0,
        max_turn_rate=1.0,
    )
    arm, advance = 0.3, 1e-3
    world = open_floor([[0.5, 0, 0]], robot=tip, robot_pose=[0, arm, 0])
    path = np.array([[0, arm, 0], [advance, arm, 0]])
    for scale, gyration in ((1.0, 1 / 6), (0.383 / np.sqrt(1 / 6), 0.383**2)):
        pose = QuasiStatic(gyration_scale=scale).sweep(world, path).object_poses[-1, 0]
        pushed = advance / (1 + arm**2 / gyration)
        assert pose[0] - 0.5 == pytest.approx(pushed, rel=1e-3)
        assert pose[2] == pytest.approx(-pushed * arm / gyration, rel=1e-3)


def test_a_chain_moves_together_and_a_wall_stops_it():
    world = make_u_maze([[3, 12.5, 0], [4.2, 12.5, 0]])
    result = QuasiStatic().sweep(world, straight_path(1.5, 14, 12.5, 126))
    reached = result.object_poses[result.jammed_at - 1]
    assert reached[0, 0] - reached[1, 0] == pytest.approx(-1.0, abs=0.01)
    assert reached[1, 0] == pytest.approx(14.0, abs=0.02)
    # the nose would have to pass 14.5 - 2 boxes
    assert 1.5 + 0.1 * (result.jammed_at - 1) == pytest.approx(11.8, abs=0.11)
    assert np.array_equal(result.object_poses[-1], reached)


def test_the_robot_itself_is_held_by_a_wall():
    result = QuasiStatic().sweep(make_u_maze(), straight_path(9, 15, 12.5, 61))
    # the nose would have to pass 14.5
    assert 9 + 0.1 * (result.jammed_at - 1) == pytest.approx(13.8, abs=0.11)


def test_friction_carries_the_box_sideways():
    # the robot slides along the box's face: without friction nothing happens
    world = open_floor([[1.19, 0, 0]], robot_pose=[0, 0, 0])
    path = np.column_stack([np.zeros(21), np.linspace(0, 0.2, 21), np.zeros(21)])
    assert abs(QuasiStatic().sweep(world, path).object_poses[-1, 0, 1]) < 1e-3
    push = np.column_stack([np.linspace(0, 0.3, 31), np.linspace(0, 0.05, 31), np.zeros(31)])
    free = QuasiStatic().sweep(world, push).object_poses[-1, 0, 1]
    held = QuasiStatic(friction=0.5).sweep(world, push).object_poses[-1, 0, 1]
    assert abs(free) < 1e-3
    assert held > 0.02


def test_an_object_that_is_not_touched_does_not_move():
    world = make_u_maze(scattered_boxes(10, 0))
    result = QuasiStatic().sweep(world, [world.robot_pose, world.robot_pose])
    assert np.array_equal(result.object_poses[-1], world.movables.poses)
    assert result.work == 0.0


def random_drive(seed: int, steps: int = 120) -> np.ndarray:
    rng = np.random.default_rng(seed)
    path = np.empty((steps, 3))
    path[0] = [11.25, 3.75, np.pi / 2]
    bend = 0.0
    for i in range(1, steps):
        bend = np.clip(bend + rng.normal(0, 0.02), -0.06, 0.06)
        heading = path[i - 1, 2] + bend
        path[i] = [*(path[i - 1, :2] + 0.1 * np.array([np.cos(heading), np.sin(heading)])), heading]
    return path


@settings(max_examples=30)
@given(st.integers(0, 10_000))
def test_nothing_overlaps_after_a_sweep(seed):
    world = make_u_maze(scattered_boxes(10, seed))
    path = random_drive(seed)
    model = QuasiStatic()
    result = model.sweep(world, path)
    depth = model.settings(world).jam_depth + 1e-9
    reached = result.jammed_at if result.jammed_at >= 0 else len(path)
    at = min(reached, len(path)) - 1
    after = world.moved(robot_pose=path[at], movable_poses=result.object_poses[at])
    outlines = [after.movables.outline_world(k) for k in range(10)]
    for k, outline in enumerate(outlines):
        for other in [*after.robot_outline_world(), *outlines[:k], *world.static.convex_parts]:
            assert convex_penetration(np.ascontiguousarray(other), outline)[0] <= depth


@settings(max_examples=20)
@given(st.integers(0, 10_000), st.floats(-3, 3), st.floats(-20, 20), st.floats(-20, 20))
def test_it_does_not_matter_where_the_scene_is(seed, turn, dx, dy):
    boxes = scattered_boxes(6, seed)
    path = random_drive(seed, 80)
    here = QuasiStatic().sweep(open_floor(boxes), path)

    def moved(poses):
        c, s = np.cos(turn), np.sin(turn)
        xy = poses[:, :2] @ np.array([[c, s], [-s, c]]) + [dx, dy]
        return np.column_stack([xy, poses[:, 2] + turn])

    there = QuasiStatic().sweep(open_floor(moved(boxes)), moved(path))
    assert there.work == pytest.approx(here.work, rel=0.02, abs=0.02)


def test_finer_steps_change_little():
    coarse, fine = QuasiStatic(), QuasiStatic(step=0.01, iterations=40)
    works = []
    for seed in range(20):
        world = open_floor(scattered_boxes(8, seed))
        path = random_drive(seed)
        a, b = coarse.sweep(world, path), fine.sweep(world, path)
        if a.jammed_at < 0 and b.jammed_at < 0:
            works.append((a.work, b.work))
    works = np.array(works)
    assert len(works) >= 8
    assert works[:, 0].mean() == pytest.approx(works[:, 1].mean(), rel=0.05)


def test_same_input_same_bytes():
    world, path = make_u_maze(scattered_boxes(10, 3)), random_drive(3)
    first, second = (QuasiStatic().sweep(world, path).object_poses for _ in range(2))
    assert first.tobytes() == second.tobytes()


def test_hundreds_of_objects_and_none(u_maze):
    grid = [[x, y, 0] for x in np.arange(-20, 20, 1.2) for y in np.arange(2.5, 12, 1.2)][:200]
    crowd = make_boxes(grid)
    world = open_floor([], movables=crowd, robot_pose=[-24, 5, 0])
    result = QuasiStatic().sweep(world, straight_path(-24, -16, 5, 81))
    assert result.work > 1.0
    empty = QuasiStatic().sweep(make_u_maze(), random_drive(0))
    assert empty.work == 0.0
    assert empty.object_poses.shape == (120, 0, 3)


def test_a_robot_of_several_parts_pushes_with_each():
    fork = RobotModel(
        (
            np.array([[0, 0.4], [-0.4, 0.4], [-0.4, -0.4], [0, -0.4]]),
            np.array([[0.5, 0.5], [0, 0.5], [0, 0.4], [0.5, 0.4]]),
        ),
        1.0,
        make_robot().drive,
        0.15,
        0.105,
    )
    world = open_floor([[1.5, 0.95, 0]], robot=fork, robot_pose=[0, 0, 0])
    result = QuasiStatic().sweep(world, straight_path(0, 2, 0, 41))
    assert result.work > 0.05  # only the upper prong touches it, and shoves it aside
    outline = Polygon(world.movables.moved_to(result.object_poses[-1]).outline_world(0))
    for part in fork.parts:
        assert outline.intersection(Polygon(part + np.array([2, 0]))).area < 1e-3


def test_a_wheel_pushes_a_box_but_holds_the_robot_at_no_wall():
    body = np.array([(-0.5, -0.3), (0.5, -0.3), (0.5, 0.3), (-0.5, 0.3)])
    wheel = np.array([(-0.2, 0.3), (0.2, 0.3), (0.2, 0.5), (-0.2, 0.5)])
    rolling = RolloutInteraction("pymunk")
    for wheels, held in ((1, False), (0, True)):
        robot = RobotModel((body, wheel), 1.0, make_robot().drive, 0.15, 0.105, wheel_parts=wheels)
        wall = StaticMap.build([[(1, 0.4), (3, 0.4), (3, 0.6), (1, 0.6)]], bounds=(-2, -2, 6, 3))
        boxes = [[4.0, 0.9, 0]]
        world = make_u_maze(boxes, robot=robot, robot_pose=[0, 0, 0], static=wall)
        path = straight_path(0, 5, 0, 51)
        result, true = QuasiStatic().sweep(world, path), rolling.sweep(world, path)
        assert (result.jammed_at >= 0) == (true.jammed_at >= 0) == held
        if not held:
            assert result.work == pytest.approx(true.work, rel=0.1) and result.work > 0.05


@pytest.mark.parametrize("path", [[], [[1, 2]], [[np.nan, 0, 0]], "path", [[0, 0, 0], [1, 1]]])
def test_bad_paths(u_maze, path):
    with pytest.raises(InvalidInputError, match="path"):
        QuasiStatic().sweep(u_maze, path)


@pytest.mark.parametrize(
    "options", [{"friction": -1}, {"step": 0}, {"iterations": 0}, {"gyration_scale": np.inf}]
)
def test_bad_settings(options):
    with pytest.raises(InvalidInputError):
        QuasiStatic(**options)
