"""Random offices: what stands in them, and that there is a way."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from pushplan.geometry import VisibilityGraph
from pushplan.scenarios import generate_office
from pushplan.scenarios.office import office_diagonal
from pushplan.world import InvalidInputError, ScenarioError, World, jackal, turtlebot3_burger

ROBOT = turtlebot3_burger()


def office(seed: int, polygons: int = 300, **options: object) -> World:
    rng = np.random.default_rng(seed)
    return generate_office(rng, robot=ROBOT, polygons=polygons, **options)


def boxes_of(world: World) -> list[shapely.Polygon]:
    objects = world.movables
    return [shapely.Polygon(objects.outline_world(k)) for k in range(len(objects))]


@pytest.mark.parametrize("seed", range(8))
def test_a_way_leads_from_the_start_to_a_far_goal(seed: int) -> None:
    world = office(seed)
    start = world.robot_pose[:2]
    goal = world.navigation_goal
    path = VisibilityGraph(world.static, ROBOT.circumscribed_radius).to_goal(start, goal)
    away = goal.distance(*start) + 0.25
    assert 0.5 * np.ptp(world.static.bounds.reshape(2, 2), axis=0).max() <= away
    assert away - 0.25 <= path.length < np.inf


@pytest.mark.parametrize("seed", range(8))
def test_bodies_overlap_nothing(seed: int) -> None:
    world = office(seed, boxes=1.0)
    walls = shapely.STRtree([shapely.Polygon(part) for part in world.static.convex_parts])
    boxes = boxes_of(world)
    robot = shapely.Point(world.robot_pose[:2]).buffer(ROBOT.circumscribed_radius)
    assert not walls.query([*boxes, robot], predicate="intersects").size
    pairs = shapely.STRtree(boxes).query([*boxes, robot], predicate="intersects")
    assert pairs.T.tolist() == [[k, k] for k in range(len(boxes))]


@pytest.mark.parametrize("polygons", [100, 1000, pytest.param(3000, marks=pytest.mark.slow)])
def test_there_are_about_as_many_polygons_as_asked_for(polygons: int) -> None:
    counts = [len(office(seed, polygons).static.polygons) for seed in range(3)]
    assert np.mean(counts) == pytest.approx(polygons, rel=0.15 if polygons < 1000 else 0.06)


def test_every_office_fits_into_its_diagonal_at_any_angle() -> None:
    for seed in range(8):
        corners = np.concatenate(office(seed).static.polygons)
        hull = shapely.MultiPoint(corners).convex_hull
        across = shapely.minimum_bounding_radius(hull) * 2.0
        assert across == pytest.approx(office_diagonal(300))
        assert np.hypot(*corners.T).max() <= office_diagonal(300)


def test_boxes_narrow_the_doors_that_have_one() -> None:
    assert len(office(0, boxes=0.0).movables) == 0
    world = office(0, boxes=1.0)
    walls = shapely.union_all([shapely.Polygon(part) for part in world.static.convex_parts])
    beside = [box for box in boxes_of(world) if box.buffer(0.33).intersection(walls).area > 0.01]
    assert len(beside) >= len(world.movables) // 2


def test_the_same_seed_is_the_same_office() -> None:
    assert office(3) == office(3)
    assert office(3) != office(4)


@pytest.mark.parametrize("bad", [{"polygons": 99}, {"polygons": 20_001}, {"boxes": 1.1}])
def test_values_out_of_range_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(InvalidInputError, match="office"):
        office(0, **bad)


def test_a_robot_that_fits_nowhere_is_refused() -> None:
    robot = jackal()
    wide = type(robot)(**{**vars(robot), "parts": [30.0 * part for part in robot.parts]})
    with pytest.raises(ScenarioError, match="smaller"):
        generate_office(np.random.default_rng(0), robot=wide, polygons=100)
