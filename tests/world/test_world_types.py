"""The ground floor refuses what makes no sense and treats equal things as equal."""

from __future__ import annotations

import pickle
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import shapely
from conftest import OCTAGON, SQUARE, make_boxes, make_robot, make_u_maze
from hypothesis import given
from hypothesis import strategies as st

from pushplan.world import (
    ClearanceArea,
    Episode,
    GoalDisc,
    GoalLine,
    GoalPose,
    InvalidInputError,
    Movables,
    Plan,
    PlanResult,
    PlanStats,
    PlanStatus,
    Receptacle,
    RobotModel,
    SchemaError,
    StaticMap,
    Twist,
    World,
    stream,
)
from pushplan.world.stored.world_files import world_from_dict, world_to_dict

NAN = float("nan")
LIMITS = {"mass": 1.0, "drive": "differential", "max_speed": 1.0, "max_turn_rate": 1.0}


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: make_robot(mass=-1), "robot.mass"),
        (lambda: make_robot(mass="heavy"), "must be a number"),
        (lambda: make_robot(max_speed=NAN), "must lie in (0, inf), got nan"),
        (lambda: make_robot(drive="diferential"), "did you mean 'differential'"),
        (lambda: RobotModel((), 1.0, "differential", 1.0, 1.0), "non-empty"),
        (lambda: make_boxes([[0, 0, NAN]]), "finite"),
        (lambda: Movables.from_polygons([[[0, 0], [1, 1]]]), "at least 3 corners"),
        (lambda: Movables.from_polygons([[[0, 0], [1, 1], [2, 2]]]), "area"),
        (lambda: Movables.from_polygons([[[0, 0], [2, 0], [0, 2], [2, 2]]]), "crosses itself"),
        (lambda: Movables.from_polygons([[[0, 0], [1, 0], [1, 0], [0, 0]]]), "3 corners"),
        (lambda: Movables.from_polygons([[[0, 0], [1, 0], [1e80, 1]]]), "within 1e+70 m"),
        (lambda: Movables.from_polygons(3), "list of outlines, got 3"),
        (lambda: RobotModel.from_outline([[0, 0], [1]], **LIMITS), "array of float64"),
        (lambda: Movables.from_polygons([[["a", 0], [1, 0], [0, 1]]]), "array of float64"),
        (lambda: Movables.from_outlines([SQUARE + 3], [[0, 0, 0]]), "centroid"),
        (lambda: Movables.from_outlines([SQUARE], [[0, 0, 0]], masses=[0.0]), "positive"),
        (lambda: Movables.from_outlines([SQUARE] * 2, np.zeros((2, 3)), ids=[1, 1]), "distinct"),
        (lambda: Movables.from_outlines([SQUARE] * 2, np.zeros((3, 3))), "shape (2, 3)"),
        (lambda: StaticMap.build(), "needs bounds"),
        (lambda: StaticMap.build(segments=[[0, 0, 1, 1]], radii=-1.0), "negative"),
        (lambda: StaticMap.build(bounds=[0, 0, 0, 1]), "min < max"),
        (lambda: GoalDisc([0, 0], 0.0), "goal.radius"),
        (lambda: GoalLine([0, 0], [0, 0]), "not be zero"),
        (lambda: GoalPose([0, 0, 0], 0.1, 0.0, 0.1), "goal.center must have shape (2,)"),
        (lambda: GoalPose([0, 0], -0.1, 0.0, 0.1), "goal.radius"),
        (
            lambda: GoalPose([0, 0], 0.1, NAN, 0.1),
            "goal.heading must lie in [-1000, 1000], got nan",
        ),
        (lambda: GoalPose([0, 0], 0.1, 0.0, 0.0), "goal.heading_tolerance must lie in (0, 3.14"),
        (lambda: GoalPose([0, 0], 0.1, 0.0, 4.0), "goal.heading_tolerance must lie in (0, 3.14"),
        (lambda: ClearanceArea(SQUARE, [True] * 3), "goal.open_edges must have shape (4,)"),
        (lambda: Receptacle([[0, 0], [1, 0]]), "3 corners"),
        (lambda: make_u_maze(robot_pose=[0, 0]), "shape (3,)"),
        (lambda: make_u_maze(goal="there"), "world.goal"),
        (lambda: make_u_maze(movables=[1]), "world.movables"),
        (lambda: make_u_maze(goal=Receptacle(SQUARE)).navigation_goal, "goal for the robot"),
        (lambda: Twist(NAN, 0.0), "twist.linear"),
        (lambda: Plan([1, 0], np.zeros((2, 3)), [0, 0], [0, 0], 0.0), "not decrease"),
        (lambda: PlanResult(PlanStatus.SOLVED, None, PlanStats(0.0)), "must have a plan"),
    ],
)
def test_bad_input_gives_one_clear_error(build, words):
    with pytest.raises(InvalidInputError) as caught:
        build()
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_equality_and_hash_go_by_content(u_maze):
    twin = make_u_maze([[4, 9, 0.3], [10, 12, 0.0], [13, 8, 0.7]])
    assert twin == u_maze
    assert hash(twin) == hash(u_maze)
    assert u_maze.moved(robot_pose=[1, 2, 3]) != u_maze
    assert len({u_maze, twin, u_maze.moved(time=1.0)}) == 2


def test_arrays_cannot_be_changed_in_place_even_after_a_pickle(u_maze):
    for world in (u_maze, pickle.loads(pickle.dumps(u_maze))):
        with pytest.raises(ValueError, match="read-only"):
            world.movables.poses[0, 0] = 1.0
    assert pickle.loads(pickle.dumps(u_maze)) == u_maze


def test_callers_arrays_are_copied():
    pose = np.array([1.0, 2.0, 3.0])
    world = make_u_maze(robot_pose=pose)
    pose[0] = 9.0
    assert world.robot_pose[0] == 1.0


def test_radii_of_the_octagon():
    robot = make_robot()
    assert robot.inscribed_radius == pytest.approx(0.6)
    assert robot.circumscribed_radius == pytest.approx(np.hypot(0.7, 0.3))
    assert robot.turning_radius == pytest.approx(0.15 / 0.105)


def test_clockwise_outlines_are_turned_around():
    limits = LIMITS
    forward = RobotModel.from_outline(OCTAGON, **limits).vertices
    backward = RobotModel.from_outline(OCTAGON[::-1], **limits).vertices
    assert np.array_equal(np.sort(forward, axis=0), np.sort(backward, axis=0))
    edges = np.roll(backward, -1, axis=0) - backward
    turns = edges[:, 0] * np.roll(edges[:, 1], -1) - edges[:, 1] * np.roll(edges[:, 0], -1)
    assert (turns > 0).all()


@given(
    st.floats(-50, 50),
    st.floats(-50, 50),
    st.floats(-7, 7),
    st.floats(0.05, 4),
)
def test_a_polygon_becomes_an_object_at_the_same_place(x, y, angle, size):
    c, s = np.cos(angle), np.sin(angle)
    corners = size * SQUARE @ np.array([[c, s], [-s, c]]) + [x, y]
    objects = Movables.from_polygons([corners])
    assert np.allclose(objects.outline_world(0), corners, atol=1e-9 * (50 + size))
    assert objects.masses[0] == pytest.approx(size**2)


def test_thick_segments_become_polygons_around_them():
    static = StaticMap.build(segments=[[1, 1, 4, 1], [2, 2, 2, 2]], radii=0.5)
    from shapely import LineString, Point, Polygon

    wall, dot = (Polygon(part) for part in static.convex_parts)
    assert wall.covers(LineString([[1, 1], [4, 1]]).buffer(0.499, quad_segs=64))
    assert LineString([[1, 1], [4, 1]]).buffer(0.5 * 1.016, quad_segs=64).covers(wall)
    assert dot.covers(Point(2, 2).buffer(0.499, quad_segs=64))


def test_goals_measure_and_contain():
    disc, line = GoalDisc([1, 1], 0.5), GoalLine([0, 9], [0, 3])
    assert disc.distance(1, 3) == pytest.approx(1.5)
    assert disc.distance(1.2, 1.2) == 0.0
    assert line.distance(4, 7) == pytest.approx(2.0)
    assert line.distance(4, 10) == 0.0
    points = np.array([[[1.0, 1.4], [1.0, 9.0]]])
    assert disc.contains(points).tolist() == [[True, False]]
    assert line.contains(points).tolist() == [[False, True]]


def test_a_pose_is_reached_within_both_tolerances():
    goal = GoalPose([1, 1], 0.02, heading=3.1, heading_tolerance=0.1)
    assert goal != GoalDisc([1, 1], 0.02)
    assert goal.distance(1, 1.12) == pytest.approx(0.1)
    assert goal.heading_error(-3.1) == pytest.approx(6.2 - 2.0 * np.pi)
    for pose, there in [
        ((1.0, 1.01, 3.1), True),
        ((1.0, 1.01, -3.15), True),  # across the cut at π
        ((1.0, 1.01, 3.1 + 4.0 * np.pi), True),
        ((1.0, 1.01, 2.9), False),
        ((1.0, 1.03, 3.1), False),
    ]:
        assert make_u_maze(goal=goal, robot_pose=pose).goal_reached is there


def test_streams_depend_on_seed_and_purpose_only():
    code = "from pushplan.world import stream; print(stream(7, 'layout').random(3).tolist())"
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert other.stdout.strip() == str(stream(7, "layout").random(3).tolist())
    assert stream(7, "policy").random() != stream(7, "layout").random()
    with pytest.raises(InvalidInputError, match="seed"):
        stream(-1, "layout")


def make_episode(world: World) -> Episode:
    count = len(world.movables)
    rng = np.random.default_rng(0)
    return Episode(
        world,
        times=np.arange(4.0),
        robot_poses=rng.normal(size=(4, 3)),
        object_poses=rng.normal(size=(4, count, 3)),
        success=True,
        reason="goal",
        actions=rng.normal(size=(3, 1)),
        rewards=rng.normal(size=3),
        about={"policy": "straight", "seed": 3},
    )


@pytest.mark.parametrize("boxes", [[], [[4, 9, 0.3]]])
def test_an_episode_survives_its_file(tmp_path, boxes):
    episode = make_episode(make_u_maze(boxes))
    episode.save(tmp_path / "run.npz")
    loaded = Episode.load(tmp_path / "run.npz")
    assert loaded == episode
    assert loaded.about == {"policy": "straight", "seed": 3}
    assert loaded.world_at(2).robot_pose.tolist() == episode.robot_poses[2].tolist()


@pytest.mark.parametrize("damage", ["missing", "empty", "truncated", "text", "pickle"])
def test_a_damaged_episode_file_is_refused(tmp_path, damage, u_maze):
    path = tmp_path / "run.npz"
    if damage == "empty":
        path.write_bytes(b"")
    elif damage == "truncated":
        make_episode(u_maze).save(path)
        path.write_bytes(path.read_bytes()[:-200])
    elif damage == "text":
        path.write_text("not an episode")
    elif damage == "pickle":
        with path.open("wb") as file:
            np.savez(file, header=np.array([{"a": 1}], dtype=object))
    with pytest.raises(SchemaError, match=r"run\.npz"):
        Episode.load(path)


def test_episode_shapes_are_checked(u_maze):
    with pytest.raises(InvalidInputError, match="increase"):
        Episode(u_maze, [0, 0], np.zeros((2, 3)), np.zeros((2, 3, 3)), True, "goal")
    with pytest.raises(InvalidInputError, match=r"\(1, 3, 3\)"):
        Episode(u_maze, [0], np.zeros((1, 3)), np.zeros((1, 2, 3)), True, "goal")


def test_goals_of_objects_agree_with_shapely():
    rng = np.random.default_rng(0)
    area = np.array([(-1.0, -1.0), (1.0, -0.8), (0.8, 1.0), (-0.6, 0.9)])
    square = 0.3 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    triangle = 0.4 * np.array([(-1, -1), (2, -1), (-1, 2)])
    outlines = [square if i % 2 else triangle for i in range(300)]
    boxes = Movables.from_outlines(outlines, rng.uniform((-2, -2, -4), (2, 2, 4), (300, 3)))
    polygons = [shapely.Polygon(boxes.outline_world(k)) for k in range(300)]
    goal = shapely.Polygon(area)
    corners = (boxes.vertices_world, boxes.offsets)
    inside = Receptacle(area), [goal.covers(polygon) for polygon in polygons]
    outside = ClearanceArea(area, np.ones(4, bool)), [not goal.intersects(p) for p in polygons]
    for mine, expected in (inside, outside):
        np.testing.assert_array_equal(mine.contains_each(*corners), expected)
        assert [mine.contains(boxes.outline_world(k)) for k in range(300)] == expected
        assert mine.contains_each(*(Movables.empty().vertices, Movables.empty().offsets)).size == 0


def test_fixed_objects_survive_files_and_become_static():
    boxes = Movables.from_outlines(
        [SQUARE] * 3, [[2, 0, 0], [4, 0, 0.3], [6, 0, 0]], fixed=[False, True, False]
    )
    world = replace(make_u_maze(), movables=boxes)
    assert world_from_dict(world_to_dict(world)) == world
    solid = world.with_fixed_as_static()
    assert solid.movables.ids.tolist() == [0, 2] and not solid.movables.fixed.any()
    np.testing.assert_array_equal(solid.static.polygons[-1], boxes.outline_world(1))
    assert solid.with_fixed_as_static() is solid
    assert not world.believing([False] * 3).movables.fixed.any()
    assert boxes.select([1, 2]).fixed.tolist() == [True, False]
    with pytest.raises(InvalidInputError, match="fixed"):
        Movables.from_outlines([SQUARE], [[0, 0, 0]], fixed=[1.5])
