"""Margins: outlines and robots that grow, and the distance that plans keep from what is static."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from pushplan.motion.keep_out import keep_out
from pushplan.planners import make_planner
from pushplan.world import (
    GoalDisc,
    InvalidInputError,
    MaxIterations,
    Movables,
    PlanStatus,
    StaticMap,
    World,
    turtlebot3_burger,
    world_from_dict,
    world_to_dict,
)
from pushplan.world.outline import grown_outline

Array = NDArray[np.float64]
MARGIN = 0.05


def polygon(rng: np.random.Generator) -> Array:
    """A random convex outline, counter-clockwise."""
    hull = shapely.MultiPoint(rng.normal(size=(int(rng.integers(3, 9)), 2))).convex_hull
    return np.array(shapely.normalize(hull).exterior.reverse().coords[:-1])


def room(y: float, margin: float) -> World:
    """A robot between a wall along y = 0 and one along y = 1.2, and a column in its way."""
    static = StaticMap.build(
        polygons=[[(1.0, 0.45), (1.2, 0.45), (1.2, 0.65), (1.0, 0.65)]],
        segments=[(0.0, 0.0, 2.4, 0.0), (0.0, 1.2, 2.4, 1.2)],
        radii=0.01,
        bounds=(0.0, 0.0, 2.4, 1.2),
    )
    return World(
        robot=turtlebot3_burger(),
        robot_pose=np.array([0.3, y, 0.0]),
        static=static,
        movables=Movables.empty(),
        goal=GoalDisc(np.array([2.1, 0.6]), 0.1),
        margin=margin,
    )


def distances(world: World, poses: Array) -> Array:
    """Distance of the footprint to what is static at each pose [m]."""
    walls = shapely.union_all([shapely.Polygon(part) for part in world.static.convex_parts])
    found = []
    for pose in poses:
        parts = world.moved(robot_pose=pose).robot_outline_world()
        found.append(min(shapely.distance(shapely.Polygon(part), walls) for part in parts))
    return np.array(found)


@given(st.integers(0, 10**6), st.floats(0.01, 2.0))
def test_a_grown_outline_holds_all_within_the_margin_and_little_more(
    seed: int, margin: float
) -> None:
    corners = polygon(np.random.default_rng(seed))
    grown = shapely.Polygon(grown_outline(corners, margin))
    assert grown.buffer(1e-9).contains(shapely.Polygon(corners).buffer(margin))
    assert shapely.Polygon(corners).buffer(1.56 * margin, quad_segs=64).contains(grown)


def test_an_inflated_robot_is_larger_on_all_sides() -> None:
    robot = turtlebot3_burger("collector")
    large = robot.inflated(0.02)
    assert large.inscribed_radius == pytest.approx(robot.inscribed_radius + 0.02)
    assert len(large.parts) == len(robot.parts) and large.mass == robot.mass
    assert robot.inflated(0.0) is robot
    for bad in (-0.1, math.nan):
        with pytest.raises(InvalidInputError, match="margin"):
            robot.inflated(bad)


def test_a_margin_is_checked_and_kept_in_files_and_moves() -> None:
    world = room(0.6, MARGIN)
    assert world.moved(time=2.0).margin == MARGIN
    assert world_from_dict(world_to_dict(world)) == world
    assert "margin" not in world_to_dict(room(0.6, 0.0))
    with pytest.raises(InvalidInputError, match=r"world\.margin"):
        room(0.6, -1.0)


@given(st.integers(0, 10**6))
def test_a_robot_that_is_free_stays_free_of_what_it_keeps_away_from(seed: int) -> None:
    rng = np.random.default_rng(seed)
    world = room(0.6, float(rng.uniform(0.01, 0.3)))
    pose = np.array([*rng.uniform((0.2, 0.1), (2.2, 1.1)), rng.uniform(-np.pi, np.pi)])
    world = world.moved(robot_pose=pose)
    if distances(world, pose[None])[0] <= 0.0:
        return
    kept = replace(world, static=keep_out(world), margin=0.0)
    assert distances(kept, pose[None])[0] > -1e-12
    robot = shapely.union_all([shapely.Polygon(part) for part in kept.robot_outline_world()])
    walls = [shapely.Polygon(part) for part in kept.static.convex_parts]
    assert all(robot.intersection(wall).area < 1e-12 for wall in walls)
    for before, after in zip(world.static.convex_parts, walls, strict=True):
        plain = shapely.Polygon(before)
        assert after.buffer(1e-9).contains(plain)
        if plain.distance(robot) > 1.6 * world.margin:  # the whole margin
            assert after.buffer(1e-9).contains(plain.buffer(0.98 * world.margin))


def test_the_same_map_is_given_again() -> None:
    world = room(0.6, MARGIN)
    assert keep_out(world) is keep_out(world.moved(robot_pose=[0.35, 0.6, 0.1]))
    bare = room(0.6, 0.0)
    assert keep_out(bare) is bare.static


PLANNERS = [
    "push-aware",
    "kinodynamic-rrt",
    "straight",
    "skeleton",
    "geometric-rrt",
    "ship-lattice",
]

STOPS = {"push-aware": MaxIterations(200), "ship-lattice": MaxIterations(40)}


@pytest.mark.parametrize("name", PLANNERS)
def test_plans_keep_the_margin(name: str) -> None:
    world = room(0.55, MARGIN)
    result = make_planner(name).plan(world, stop=STOPS.get(name), rng=np.random.default_rng(0))
    assert result.plan is not None
    keeps = distances(world, result.plan.poses)
    # paths of discs count the inscribed radius alone, corners of the footprint may reach in
    whole = name in ("push-aware", "kinodynamic-rrt", "ship-lattice")
    assert keeps.min() >= (MARGIN if whole else 0.5 * MARGIN) - 1e-3


@pytest.mark.parametrize("name", PLANNERS)
def test_a_robot_inside_the_margin_drives_out_of_it(name: str) -> None:
    world = room(0.125, MARGIN)  # 0.02 m from the wall
    assert 0.0 < distances(world, world.robot_pose[None])[0] < 0.6 * MARGIN
    result = make_planner(name).plan(world, stop=STOPS.get(name), rng=np.random.default_rng(0))
    assert result.status is not PlanStatus.START_BLOCKED
    assert result.plan is not None
    keeps = distances(world, result.plan.poses)
    assert keeps.min() > 0.0 and keeps[-1] > MARGIN
