from __future__ import annotations

import numpy as np
import pytest
import shapely
from conftest import make_u_maze
from hypothesis import given, settings
from hypothesis import strategies as st

from pushplan.core import perception as core
from pushplan.envs import PushEnv
from pushplan.learned import FeatureObservation
from pushplan.world import InvalidInputError
from pushplan.world.outline import flatten


@settings(max_examples=60)
@given(st.integers(0, 2**31), st.integers(1, 40))
def test_rays_are_as_long_as_shapely_says(seed, count):
    rng = np.random.default_rng(seed)
    middles = rng.uniform(-4, 4, (5, 1, 2))
    angles = np.sort(rng.uniform(0, 2 * np.pi, (5, 6)), axis=1)
    shapes = list(middles + 0.8 * np.stack([np.cos(angles), np.sin(angles)], axis=-1))
    x, y, heading = rng.uniform(-4, 4), rng.uniform(-4, 4), rng.uniform(-np.pi, np.pi)
    vertices, offsets = flatten(shapes)
    lengths = np.full(count, 6.0)
    core.cast_rays(lengths, x, y, heading, vertices, offsets)
    rings = shapely.union_all([shapely.LinearRing(shape) for shape in shapes])
    for i, found in enumerate(lengths):
        angle = heading + 2 * np.pi * i / count
        ray = shapely.LineString([(x, y), (x + 6 * np.cos(angle), y + 6 * np.sin(angle))])
        hit = ray.intersection(rings)
        wanted = 6.0 if hit.is_empty else shapely.Point(x, y).distance(hit)
        assert found == pytest.approx(wanted, abs=1e-6)


def test_what_the_numbers_mean():
    view = FeatureObservation(rays=8, objects=2, range=5.0)
    world = make_u_maze([[11.25, 6.25, 0.2], [2.0, 2.0, 0.0], [12.25, 4.75, 0.0]])
    seen = view.observe(world)
    assert seen.shape == view.shape == (10 + 16 + 18,)
    assert seen.dtype == np.float32
    assert seen[:2] == pytest.approx([0.0, 1.0], abs=1e-6)  # it heads up
    assert seen[2] > 0 and seen[3] > 0  # round the end of the wall, ahead and to the left
    assert seen[6] * 5.0 == pytest.approx(world_length(world), rel=0.02)
    walls, boxes = seen[10:18], seen[18:26]
    assert (1 - walls[2]) * 5.0 == pytest.approx(11.25 - 8.0, abs=0.05)  # the wall to the left
    assert (1 - boxes[0]) * 5.0 == pytest.approx(2.5 - 0.5, abs=0.15)
    assert boxes[4] == 0.0
    rows = seen[26:].reshape(2, 9)
    assert rows[0, :2] * 5.0 == pytest.approx([1.0, -1.0], abs=1e-5)  # nearest first
    assert rows[1, :2] * 5.0 == pytest.approx([2.5, 0.0], abs=1e-5)
    assert rows[1, 2:4] == pytest.approx([np.cos(0.8), np.sin(0.8)], abs=1e-5)
    assert (rows[:, 8] == 1.0).all() and (rows[:, 5:8] == 0.0).all()


def world_length(world):
    from pushplan.geometry import VisibilityGraph

    graph = VisibilityGraph(world.static, clearance=world.robot.inscribed_radius)
    return graph.to_goal(world.robot_pose[:2], world.goal).length


TASKS = ["maze", "ship_ice", "box_delivery", "area_clearing", "rearrange"]


@pytest.mark.parametrize("task", TASKS)
def test_every_task_observes_it(task):
    env = PushEnv(task=task, observation=FeatureObservation())
    seen, _ = env.reset(seed=1001)
    assert env.observation_space.contains(seen)
    again = FeatureObservation().observe(env.world)
    assert seen.tobytes() == again.tobytes()
    seen, *_ = env.step(env.action_space.sample())
    assert np.isfinite(seen).all()


def test_objects_that_have_to_be_moved_come_first():
    env = PushEnv(task="area_clearing", observation="state")
    env.reset(seed=1002)
    world = env.world
    poses = np.array(world.movables.poses)
    poses[0, :2] = world.robot_pose[:2] - [0.0, 2.2]  # near, but outside the area
    rows = FeatureObservation(rays=0, objects=10).observe(world.moved(movable_poses=poses))
    rows = rows[10:].reshape(10, 9)
    assert rows[-1, 7] == 0.0 and (rows[:-1, 7] > 0.0).all()
    assert np.hypot(*rows[:-1, 5:7].T) == pytest.approx(1.0)


def test_places_are_told_in_the_frames_of_their_objects():
    env = PushEnv(task="rearrange", variations={"objects": 3, "obstacles": 1})
    env.reset(seed=1003)
    world = env.world
    poses = np.array(world.movables.poses)
    poses[1] = world.goal.poses[1] + [0.0, 0.0, np.pi / 2]  # there, as a square
    world = world.moved(movable_poses=poses)
    view = FeatureObservation(rays=0, objects=4, places=True)
    rows = view.observe(world)[10:].reshape(4, 15)
    nearest = np.argsort(np.hypot(*(poses - world.robot_pose)[:, :2].T))
    order = [k for k in nearest if k in (0, 2)] + [k for k in nearest if k in (1, 3)]
    for row, k in zip(rows, order, strict=True):
        assert np.hypot(*row[9:11]) == pytest.approx(np.hypot(*row[:2]), abs=1e-6)
        if k == 3:  # has no place
            assert not row[[5, 6, 7, 11, 12, 13, 14]].any()
            continue
        turn = np.arctan2(row[14], row[13])
        assert abs(turn) <= np.pi / 4 + 1e-6
        x, y, heading = world.goal.poses[k]
        at = heading - turn  # the object, up to quarters of a turn
        assert np.remainder(4 * (at - poses[k, 2]) + 1.0, 2 * np.pi) == pytest.approx(1.0, abs=1e-4)
        c, s = np.cos(at), np.sin(at)
        there = poses[k, :2] + 6.0 * np.array([[c, -s], [s, c]]) @ row[11:13]
        assert there == pytest.approx([x, y], abs=1e-5)
        assert row[7] * 6.0 == pytest.approx(np.hypot(x - poses[k, 0], y - poses[k, 1]), abs=1e-5)
    # a T that is turned by a quarter is seen to be
    env = PushEnv(task="rearrange", variations={"objects": 1, "shape": "t"})
    env.reset(seed=1004)
    turned = env.world.moved(movable_poses=env.world.movables.poses + np.array([0, 0, np.pi / 2]))
    one, other = (view.observe(world)[10:25] for world in (env.world, turned))
    assert other[2:4] == pytest.approx([-one[3], one[2]], abs=1e-5)
    assert other[13:] == pytest.approx([one[14], -one[13]], abs=1e-5)


@pytest.mark.parametrize("options", [{"rays": -1}, {"objects": 1.5}, {"range": 0.0}])
def test_nonsense_is_refused(options):
    with pytest.raises(InvalidInputError):
        FeatureObservation(**options)


@pytest.mark.parametrize(
    "pose",
    [(8.0, 5.0, 0.0), (7.5, 5.0, 1.0), (3.75, 3.75, 0.0), (-4.0, 40.0, 2.0), (0.0, 0.0, 0.0)],
)
def test_odd_places_give_numbers_too(pose):
    """At a wall, inside it, at the goal, outside, in a corner."""
    for boxes in ((), [[pose[0], pose[1], 0.3]]):
        world = make_u_maze(boxes, robot_pose=list(pose))
        seen = FeatureObservation(rays=6, objects=3).observe(world)
        assert np.isfinite(seen).all() and np.abs(seen).max() <= 5.0


def test_turning_the_world_turns_the_heading_only():
    view = FeatureObservation(rays=12, objects=3, range=6.0)
    world = make_u_maze([[11.0, 7.0, 0.2], [12.0, 9.0, 1.0]])
    seen = view.observe(world)
    turned = view.observe(
        world.moved(robot_pose=world.robot_pose + np.array([0.0, 0.0, np.pi / 2]))
    )
    assert turned[10:22] == pytest.approx(np.roll(seen[10:22], -3), abs=1e-6)  # rays
    rows, again = seen[34:].reshape(3, 9), turned[34:].reshape(3, 9)
    assert again[:, 0] == pytest.approx(rows[:, 1], abs=1e-6)  # what was left is ahead
    assert again[:, 1] == pytest.approx(-rows[:, 0], abs=1e-6)
    assert again[:, 2:4] == pytest.approx(rows[:, 2:4], abs=1e-5)
