from __future__ import annotations

import itertools
import math
import pickle

import numpy as np
import pytest
import shapely
from conftest import quickest

from pushplan.geometry import goal_distances
from pushplan.observation import CHANNELS, ImageObservation, StateObservation
from pushplan.world import (
    ClearanceArea,
    Drive,
    GoalDisc,
    GoalLine,
    InvalidInputError,
    Movables,
    ObjectGoals,
    Receptacle,
    RobotModel,
    StaticMap,
    UnknownNameError,
    World,
)

WALLS = [[0, 0, 15, 0], [15, 0, 15, 15], [15, 15, 0, 15], [0, 15, 0, 0], [7.5, 0, 7.5, 10]]
SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


def scene(pose: tuple[float, float, float] = (11.0, 5.0, 2.0), seed: int = 0) -> World:
    rng = np.random.default_rng(seed)
    poses = rng.uniform([1, 1, -3], [14, 14, 3], (6, 3))
    triangle = np.array([[-0.6, -0.4], [0.9, -0.4], [-0.3, 0.8]])
    return World(
        robot=RobotModel(
            parts=(SQUARE * [1.4, 1.0], SQUARE * [0.3, 2.0] + np.array([0.8, 0.0])),
            mass=1.0,
            drive=Drive.CONSTANT_SPEED,
            max_speed=0.15,
            max_turn_rate=0.1,
        ),
        robot_pose=np.array(pose),
        static=StaticMap.build([[[2, 11], [4, 11], [3, 13]]], WALLS, 0.5, bounds=[0, 0, 15, 15]),
        movables=Movables.from_outlines([SQUARE] * 5 + [triangle], poses),
        goal=GoalDisc(np.array([3.75, 3.75]), 1.86),
    )


def pixel_points(world: World, view: ImageObservation) -> tuple[np.ndarray, np.ndarray]:
    """World position of each pixel centre, from the definition of the window."""
    (rows, cols), (height, width) = view.pixels, view.window
    ahead = height * (0.5 - (np.arange(rows) + 0.5) / rows)
    left = width * (0.5 - (np.arange(cols) + 0.5) / cols)
    f, s = np.meshgrid(ahead, left, indexing="ij")
    x, y, theta = world.robot_pose
    return (
        x + f * np.cos(theta) - s * np.sin(theta),
        y + f * np.sin(theta) + s * np.cos(theta),
    )


VIEWS = [
    ImageObservation(),
    ImageObservation(window=(6.0, 9.0), pixels=(60, 45)),
]


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("seed", range(3))
def test_occupancy_equals_a_test_of_each_pixel(view: ImageObservation, seed: int) -> None:
    angle = float(np.random.default_rng(seed).uniform(-3, 3))
    world = scene((11.0 - seed, 5.0 + seed, angle), seed)
    image = view.observe(world)
    assert image.shape == view.shape and image.dtype == view.dtype
    x, y = pixel_points(world, view)
    expected = {
        "footprint": world.robot_outline_world(),
        "movable": [world.movables.outline_world(k) for k in range(len(world.movables))],
        "static": world.static.convex_parts,
    }
    for name, outlines in expected.items():
        union = shapely.union_all([shapely.Polygon(outline) for outline in outlines])
        sure = shapely.distance(union.boundary, shapely.points(x, y)) > 1e-9
        layer = image[view.channels.index(name)]
        inside = shapely.contains_xy(union, x, y)
        np.testing.assert_array_equal(layer[sure], np.where(inside, 255, 0)[sure])
        assert inside.any()


@pytest.mark.parametrize("view", VIEWS)
def test_goal_distance_is_the_shortest_way_at_each_pixel(view: ImageObservation) -> None:
    world = scene((9.0, 8.0, 0.4))
    layer = view.observe(world)[view.channels.index("goal_distance")]
    x, y = pixel_points(world, view)
    source = goal_distances(world.static, world.goal)
    rng = np.random.default_rng(0)
    pixel = max(s / n for s, n in zip(view.window, view.pixels, strict=True))
    shown, lengths = [], []
    rows, cols = (rng.integers(0, n, 80) for n in view.pixels)
    for r, c in zip(rows, cols, strict=True):
        here = shapely.Point(x[r, c], y[r, c])
        wall = min(shapely.Polygon(part).distance(here) for part in world.static.convex_parts)
        length = source.path_from((x[r, c], y[r, c])).length
        if wall > 3.0 * pixel and math.isfinite(length):
            shown.append(float(layer[r, c]))
            lengths.append(length)
    assert len(shown) > 10
    per_metre = np.dot(shown, lengths) / np.dot(lengths, lengths)  # the scale is the view's choice
    assert per_metre * max(lengths) <= 256.0
    np.testing.assert_allclose(
        shown, per_metre * np.array(lengths), atol=per_metre * 1.5 * pixel + 1.0
    )


def test_the_robot_faces_up() -> None:
    world = scene((10.0, 7.0, -2.5))
    box = np.array([[10 + 2 * math.cos(-2.5), 7 + 2 * math.sin(-2.5), 0.3]])
    world = World(
        robot=world.robot,
        robot_pose=world.robot_pose,
        static=world.static,
        movables=Movables.from_outlines([SQUARE], box),
        goal=world.goal,
    )
    rows, cols = np.nonzero(ImageObservation(channels=("movable",)).observe(world)[0])
    assert rows.mean() == pytest.approx(96 - 2 * 16 - 0.5, abs=0.5)
    assert cols.mean() == pytest.approx(95.5, abs=0.5)


def test_goal_distance_uses_the_whole_range() -> None:
    view = ImageObservation(channels=("goal_distance",), window=(20.0, 20.0))
    layer = view.observe(scene((7.5, 7.5, 0.0)))[0]
    assert layer.min() == 0
    assert layer.max() >= 250


@pytest.mark.parametrize(
    "goal",
    [
        GoalLine(np.array([0.0, 9.0]), np.array([0.0, 1.0])),
        Receptacle(np.array([[1.0, 1.0], [3, 1], [3, 3], [1, 3]])),
        GoalDisc(np.array([7.5, 5.0]), 0.2),  # inside a wall
    ],
)
def test_any_goal_that_is_a_place_can_be_shown(goal: GoalLine | Receptacle | GoalDisc) -> None:
    world = scene()
    world = World(world.robot, world.robot_pose, world.static, world.movables, goal)
    layer = ImageObservation(channels=("goal_distance",)).observe(world)[0]
    buried = isinstance(goal, GoalDisc)
    assert (layer == 255).all() == buried


def test_same_world_same_bytes_and_a_new_array() -> None:
    view, world = ImageObservation(), scene()
    first, second = view.observe(world), pickle.loads(pickle.dumps(view)).observe(scene())
    assert first is not second
    assert first.tobytes() == second.tobytes()


def test_the_field_is_computed_once_for_equal_maps() -> None:
    view = ImageObservation()
    view.observe(scene())
    seeds = itertools.count()
    assert quickest(lambda: view.observe(scene(seed=next(seeds))), 20) < 0.02  # own, equal maps


def test_a_world_without_objects_or_walls() -> None:
    world = World(
        robot=scene().robot,
        robot_pose=np.zeros(3),
        static=StaticMap.build(bounds=[-5, -5, 5, 5]),
        movables=Movables.empty(),
        goal=GoalDisc(np.array([2.0, 0.0]), 0.5),
    )
    footprint, movable, static, distance = ImageObservation().observe(world)
    assert footprint.any() and not movable.any() and not static.any()
    assert distance[96 - 32, 96] == 0
    assert StateObservation(2).observe(world)[6:].tolist() == [0.0] * 10


@pytest.mark.parametrize(
    "wrong",
    [
        {"channels": "static"},
        {"channels": ()},
        {"window": (0.0, 1.0)},
        {"pixels": (10,)},
        {"pixels": (0, 10)},
        {"pixels": (10.5, 10)},
    ],
)
def test_wrong_settings_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(InvalidInputError):
        ImageObservation(**wrong)  # type: ignore[arg-type]


def test_an_unknown_channel_names_the_nearest() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'movable'"):
        ImageObservation(channels=("movables",))
    assert set(ImageObservation().channels) < set(CHANNELS)


def test_state_holds_what_it_says() -> None:
    world = World(
        robot=scene().robot,
        robot_pose=np.array([1.0, 2.0, math.pi / 2]),
        static=scene().static,
        movables=Movables.from_outlines([SQUARE, SQUARE], [[1.0, 5.0, math.pi / 2], [0.0, 2.0, 0]]),
        goal=GoalDisc(np.array([5.0, 2.0]), 1.0),
    )
    view = StateObservation(max_objects=3)
    vector = view.observe(world)
    assert vector.shape == view.shape == (4 + 2 + 15,) and vector.dtype == np.float32
    expected = [1, 2, 0, 1, 0, -4, 3, 0, 1, 0, 1, 0, 1, 0, -1, 1, 0, 0, 0, 0, 0]
    np.testing.assert_allclose(vector, expected, atol=1e-6)
    assert StateObservation(1).observe(world)[6:].tolist() == pytest.approx([0, 1, 0, -1, 1])


def test_state_says_where_objects_belong() -> None:
    world = World(
        robot=scene().robot,
        robot_pose=np.array([1.0, 2.0, math.pi / 2]),
        static=scene().static,
        movables=Movables.from_outlines([SQUARE, SQUARE], [[1.0, 5.0, 1.5], [0.0, 2.0, 0]]),
        goal=ObjectGoals([0], [[2.0, 2.0, 0.0]], [0.1], [0.1], [4]),
    )
    rows = StateObservation(2, places=True).observe(world)[6:].reshape(2, 10)
    np.testing.assert_array_equal(rows[:, :5], StateObservation(2).observe(world)[6:].reshape(2, 5))
    np.testing.assert_allclose(rows[0, 5:], [0, -1, 1, 0, 1], atol=1e-6)  # a quarter turn is equal
    assert not rows[1, 5:].any()
    with pytest.raises(InvalidInputError, match="goal"):
        StateObservation(2, places=True).observe(scene())


def test_state_of_other_goals() -> None:
    world = scene((1.0, 1.0, 0.0))
    line = GoalLine(np.array([0.0, 9.0]), np.array([0.0, 1.0]))
    world_line = World(world.robot, world.robot_pose, world.static, world.movables, line)
    np.testing.assert_allclose(StateObservation(0).observe(world_line)[4:], [0, 8], atol=1e-6)
    far = World(world.robot, np.array([1e6, 1.0, 0.0]), world.static, world.movables, line)
    vector = StateObservation(1, limit=50.0).observe(far)
    assert np.abs(vector).max() == 50.0
    with pytest.raises(InvalidInputError):
        StateObservation(-1)


def test_state_rows_belong_to_objects_while_others_leave() -> None:
    world = scene()
    rest = World(
        world.robot, world.robot_pose, world.static, world.movables.select([1, 3]), world.goal
    )
    full, less = (StateObservation(8).observe(w)[6:].reshape(8, 5) for w in (world, rest))
    np.testing.assert_array_equal(less[[1, 3]], full[[1, 3]])
    assert not less[[0, 2, 4, 5, 6, 7]].any()
    packed = StateObservation(3).observe(rest)[6:].reshape(3, 5)  # 3 is no row
    np.testing.assert_array_equal(packed[:2], full[[1, 3]])


@pytest.mark.parametrize("kind", ["receptacle", "area"])
def test_state_gives_the_middle_of_an_area(kind: str) -> None:
    corners = np.array([[2.0, 1], [4, 1], [4, 3], [3, 3], [2, 3]])
    goal = Receptacle(corners) if kind == "receptacle" else ClearanceArea(corners, [True] * 5)
    world = scene((1.0, 1.0, 0.0))
    world = World(world.robot, world.robot_pose, world.static, world.movables, goal)
    np.testing.assert_allclose(StateObservation(0).observe(world)[4:], [2, 1], atol=1e-6)


def test_goal_distance_of_a_clearance_area_ends_at_its_open_edges() -> None:
    corners = np.array([[4.0, 4], [12, 4], [12, 12], [4, 12]])
    world = scene((8.0, 8.0, math.pi / 2))
    static = StaticMap.build(bounds=[0, 0, 16, 16])
    area = ClearanceArea(corners, np.array([False, True, False, False]))
    world = World(world.robot, world.robot_pose, static, world.movables, area)
    layer = ImageObservation(channels=("goal_distance",), window=(16.0, 16.0)).observe(world)[0]
    inside = layer[52:140, 52:140]
    assert (np.diff(inside[50].astype(int)) <= 0).all()  # towards the right
    assert inside[50, 0] > 240 and inside[50, -1] < 15
    assert not layer[:, :44].any() and not layer[:, 150:].any()
    shut = World(
        world.robot, world.robot_pose, static, world.movables, ClearanceArea(corners, [False] * 4)
    )
    layer = ImageObservation(channels=("goal_distance",), window=(16.0, 16.0)).observe(shut)[0]
    assert (layer[52:140, 52:140] == 255).all() and not layer[:, :44].any()
