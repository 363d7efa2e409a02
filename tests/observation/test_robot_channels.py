"""Channels that start at the robot, and windows that do not turn with it."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from conftest import quickest

from pushplan.geometry import VisibilityGraph
from pushplan.observation import ImageObservation
from pushplan.world import (
    ClearanceArea,
    Drive,
    GoalDisc,
    InvalidInputError,
    Movables,
    RobotModel,
    StaticMap,
    World,
)

SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
COLUMNS = [np.array([x, y]) + 0.8 * SQUARE for x in (1.5, 3.5, 5.5, 7.5) for y in (2.5, 6.5)]


def scene(static: StaticMap, pose: tuple[float, float, float], boxes: int = 3) -> World:
    rng = np.random.default_rng(1)
    return World(
        robot=RobotModel.from_outline(
            0.4 * SQUARE, mass=1.0, drive=Drive.DIFFERENTIAL, max_speed=1.0, max_turn_rate=1.0
        ),
        robot_pose=np.array(pose),
        static=static,
        movables=Movables.from_outlines([SQUARE] * boxes, rng.uniform(1, 9, (boxes, 3))),
        goal=GoalDisc(np.array([1.0, 1.0]), 0.3),
    )


def pixel_points(world: World, view: ImageObservation) -> np.ndarray:
    """(H, W, 2) world position of each pixel centre, from the definition of the window."""
    (rows, cols), (height, width) = view.pixels, view.window
    up = height * (0.5 - (np.arange(rows) + 0.5) / rows) + view.shift
    left = width * (0.5 - (np.arange(cols) + 0.5) / cols)
    u, v = np.meshgrid(up, left, indexing="ij")
    angle = math.pi / 2 if view.north_up else world.robot_pose[2]
    x, y, _ = world.robot_pose
    return np.stack(
        [x + u * np.cos(angle) - v * np.sin(angle), y + u * np.sin(angle) + v * np.cos(angle)],
        axis=-1,
    )


MAPS = {
    "columns": StaticMap.build(COLUMNS, bounds=[0, 0, 10, 10]),
    "divider": StaticMap.build([[[0, 4.8], [7, 4.8], [7, 5.2], [0, 5.2]]], bounds=[0, 0, 10, 10]),
    "thick": StaticMap.build([], [[3, 0, 3, 7], [7, 3, 7, 10]], 0.4, bounds=[0, 0, 10, 10]),
    "touching": StaticMap.build(
        [[[2, 4], [6, 4], [6, 5], [2, 5]], [[5, 1], [6, 1], [6, 4.5], [5, 4.5]]],
        bounds=[0, 0, 10, 10],
    ),
    "triangle": StaticMap.build([[[3, 3], [8, 4], [4, 8]]], bounds=[0, 0, 10, 10]),
}


@pytest.mark.parametrize("name", MAPS)
@pytest.mark.parametrize(
    "view",
    [
        ImageObservation(("robot_distance",), (10.0, 10.0), (96, 96)),
        ImageObservation(("robot_distance",), (6.0, 9.0), (80, 120), north_up=True, shift=1.5),
    ],
)
def test_robot_distance_is_the_shortest_way_to_each_pixel(
    name: str, view: ImageObservation
) -> None:
    rng = np.random.default_rng(5)
    static = MAPS[name]
    parts = shapely.union_all([shapely.Polygon(part) for part in static.convex_parts])
    graph, pixel = VisibilityGraph(static), 10.0 / 96
    per_metre = 255.0 / math.hypot(*view.window)
    compared = 0
    while compared < 60:
        pose = tuple(rng.uniform([0.3, 0.3, -3], [9.7, 9.7, 3]))
        if parts.distance(shapely.Point(pose[:2])) < 0.05:
            continue
        world = scene(static, pose)
        layer, points = view.observe(world)[0], pixel_points(world, view)
        for r, c in rng.integers(0, view.pixels, (40, 2)):
            point = points[r, c]
            if not (0.0 < point.min() and point.max() < 10.0):
                continue
            away = parts.distance(shapely.Point(point))
            if away == 0.0:
                assert layer[r, c] == 255
            elif away > 0.05:
                length = graph.shortest_path(pose[:2], point).length
                error = 0.5 + per_metre * 0.75 * pixel
                assert layer[r, c] == pytest.approx(min(255.0, per_metre * length), abs=error)
                compared += 1


def test_robot_distance_where_no_way_leads_and_beyond_the_bounds() -> None:
    wall = StaticMap.build([[[4, 0], [5, 0], [5, 10], [4, 10]]], bounds=[0, 0, 10, 10])
    view = ImageObservation(("robot_distance",), (20.0, 20.0), (100, 100))
    world = scene(wall, (2.0, 5.0, 0.7))
    layer, points = view.observe(world)[0], pixel_points(world, view)
    behind = (points[..., 0] > 4.0) & (points[..., 1] > 0) & (points[..., 1] < 10)
    assert (layer[behind] == 255).all()
    near = (points[..., 0] < 4.0) & (points[..., 0] > 0)
    assert layer[near].min() < 255
    # on top of an obstacle, as perception may have it, nothing fails
    view.observe(scene(wall, (4.5, 5.0, 0.0)))
    view.observe(scene(MAPS["columns"], (1.5, 2.5, 0.0)))


def test_robot_distance_keeps_its_scale_from_frame_to_frame() -> None:
    view = ImageObservation(("robot_distance",), (10.0, 10.0), (101, 101))
    empty = StaticMap.build(bounds=[0, 0, 10, 10])
    layers = [view.observe(scene(empty, pose))[0] for pose in ((5, 5, 0.3), (1, 9, -2.0))]
    np.testing.assert_array_equal(layers[0], layers[1])
    assert layers[0][50, 50] == 0
    assert layers[0][50, 0] == round(255 * (10 * 50 / 101) / math.hypot(10, 10))


def test_occupancy_tells_static_from_movable() -> None:
    world = scene(MAPS["columns"], (5.0, 5.0, 0.4))
    names = ("occupancy", "static", "movable")
    occupancy, static, movable = ImageObservation(names, (12.0, 12.0)).observe(world)
    expected = np.where(static > 0, 255, np.where(movable > 0, 128, 0))
    np.testing.assert_array_equal(occupancy, expected)
    assert len(np.unique(occupancy)) == 3


@pytest.mark.parametrize("north_up", [False, True])
@pytest.mark.parametrize("heading", [0.0, 0.4, math.pi / 2, 2.5, -math.pi / 2, -2.0, math.pi])
def test_heading_line_is_one_pixel_wide_and_leaves_the_robot(
    heading: float, north_up: bool
) -> None:
    world = scene(MAPS["columns"], (5.0, 5.0, heading))
    view = ImageObservation(("heading_line",), (6.0, 6.0), (75, 75), north_up, 1.0)
    layer, points = view.observe(world)[0], pixel_points(world, view)
    assert set(np.unique(layer)) == {0, 255}
    on = points[layer > 0] - world.robot_pose[:2]
    along = on @ [math.cos(heading), math.sin(heading)]
    across = on @ [-math.sin(heading), math.cos(heading)]
    assert np.abs(across).max() <= 0.71 * 6 / 75
    assert along.min() >= -6 / 75
    rows, cols = np.nonzero(layer)
    assert len(rows) == max(np.ptp(rows), np.ptp(cols)) + 1  # one pixel a row, or a column
    edge = (rows.min(), cols.min(), 74 - rows.max(), 74 - cols.max())
    assert min(edge) == 0


def test_a_heading_line_whose_robot_is_outside_the_window() -> None:
    for shift in (-5.0, 5.0):
        view = ImageObservation(("heading_line",), (6.0, 6.0), (60, 60), shift=shift)
        layer = view.observe(scene(MAPS["columns"], (5.0, 5.0, 1.0)))[0]
        assert layer.any() == (shift > 0)


def test_north_up_keeps_the_axes_of_the_world() -> None:
    view = ImageObservation(("movable", "footprint"), (8.0, 8.0), (80, 80), True, 2.0)
    box = Movables.from_outlines([SQUARE], [[6.0, 8.0, 0.0]])
    for heading in (0.0, 1.0, -2.0):
        world = scene(MAPS["columns"], (5.0, 5.0, heading))
        world = World(world.robot, world.robot_pose, world.static, box, world.goal)
        movable, footprint = view.observe(world)
        rows, cols = np.nonzero(movable)
        # the middle of the window is at (5, 7)
        assert (rows.mean() + 0.5, cols.mean() + 0.5) == (40 - 10, 40 + 10)
        rows, cols = np.nonzero(footprint)
        assert (rows.mean() + 0.5, cols.mean() + 0.5) == pytest.approx((60, 40), abs=0.5)


@pytest.mark.parametrize("wrong", [{"shift": math.nan}, {"shift": "1"}, {"north_up": 1}])
def test_wrong_windows_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(InvalidInputError):
        ImageObservation(**wrong)  # type: ignore[arg-type]


def test_lists_from_a_file_are_taken() -> None:
    view = ImageObservation(["static"], [4.0, 4.0], [8, 8])  # type: ignore[arg-type]
    assert view == ImageObservation(("static",), (4.0, 4.0), (8, 8))
    assert hash(view) == hash(ImageObservation(("static",), (4.0, 4.0), (8, 8)))


def test_images_are_fast_enough_for_every_control_step() -> None:
    names = ("occupancy", "footprint", "robot_distance", "goal_distance")
    view = ImageObservation(names, (10.0, 10.0), (224, 224))
    world = scene(MAPS["columns"], (4.5, 4.5, 0.4), boxes=20)
    view.observe(world)

    def ten_times() -> None:
        for _ in range(10):
            view.observe(world)

    # some 0.7 ms on a free machine
    assert quickest(ten_times, 20) / 10 < 4e-3
    area = ClearanceArea(8.0 * SQUARE + 5.0, np.ones(4, dtype=bool))
    open_floor = StaticMap.build(bounds=[0, 0, 10, 10])
    world = World(world.robot, world.robot_pose, open_floor, world.movables, area)
    view.observe(world)
    assert quickest(ten_times, 20) / 10 < 1e-3


@pytest.mark.parametrize("shift", [1e12, -1e12])
def test_a_heading_line_from_far_away_takes_no_time(shift: float) -> None:
    view = ImageObservation(("heading_line",), window=(4.0, 4.0), pixels=(40, 40), shift=shift)
    assert view.observe(scene(MAPS["columns"], (5.0, 5.0, 1.0))).shape == (1, 40, 40)
