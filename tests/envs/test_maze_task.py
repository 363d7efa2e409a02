import itertools

import numpy as np
import pytest
import shapely
from conftest import quickest

from pushplan.envs.tasks.maze import MazeTask
from pushplan.geometry.distance_field import geodesic_field
from pushplan.world import ScenarioError, UnknownNameError, stream

PRESETS = ("benchmark", "testbed")
SHAPES = ("u", "z")


def task(preset="benchmark", action="turn_rate", **variations):
    return MazeTask(preset=preset, variations=variations, action=action)


def obstacles(static):
    parts = [shapely.Polygon(polygon) for polygon in static.polygons]
    for line, radius in zip(static.segments, static.radii, strict=True):
        parts.append(shapely.LineString(line.reshape(2, 2)).buffer(radius, quad_segs=64))
    return shapely.union_all(parts)


def boxes(world):
    return [shapely.Polygon(world.movables.outline_world(k)) for k in range(len(world.movables))]


@pytest.mark.parametrize("yaw", ["aligned", "random"])
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("preset", PRESETS)
def test_nothing_overlaps_at_the_start(preset, shape, yaw):
    maze = task(preset, shape=shape, boxes=10, box_yaw=yaw, random_start=True)
    walls = obstacles(maze.static)
    for seed in range(15):
        world = maze.start(stream(seed, "layout"))
        robot = shapely.Polygon(world.robot_outline_world()[0])
        goal = shapely.Point(world.goal.center)
        shapes = boxes(world)
        assert not robot.intersects(walls)
        for i, box in enumerate(shapes):
            assert not box.intersects(walls)
            assert not box.intersects(robot)
            assert box.distance(goal) > world.goal.radius
            assert not any(box.intersects(other) for other in shapes[:i])


@pytest.mark.parametrize("preset", PRESETS)
def test_random_starts_lead_to_the_goal_and_do_not_doom(preset):
    maze = task(preset, random_start=True, boxes=0)
    robot = maze.robot
    field = geodesic_field(
        maze.static,
        maze.goal,
        resolution=maze.preset.field_resolution,
        clearance=robot.inscribed_radius,
    )
    headings = []
    for seed in range(30):
        pose = maze.start(stream(seed, "layout")).robot_pose
        assert np.isfinite(field.exact(pose[0], pose[1]))
        assert maze.goal.distance(pose[0], pose[1]) > 0.0
        headings.append(pose[2])
    assert np.ptp(headings) > 4.0


def test_fixed_start_and_dimensions_of_the_benchmark():
    world = task().start(stream(0, "layout"))
    np.testing.assert_allclose(world.robot_pose, (11.25, 3.75, np.pi / 2))
    np.testing.assert_array_equal(world.goal.center, (3.75, 3.75))
    assert world.goal.radius == pytest.approx(1.86)
    assert world.robot.circumscribed_radius == pytest.approx(0.86, abs=1e-3)
    np.testing.assert_array_equal(np.ptp(world.robot.vertices, axis=0), (1.4, 1.2))
    assert world.robot.mass == 1.0 and (world.movables.masses == 1.0).all()
    assert world.static.segments[-1].tolist() == [7.5, 0.0, 7.5, 10.0]


def test_dimensions_of_the_testbed():
    world = task("testbed", shape="z", boxes=6).start(stream(0, "layout"))
    assert world.static.bounds.tolist() == [0.0, 0.0, 2.5, 2.845]
    assert world.goal.radius == pytest.approx(0.3)
    assert world.robot.mass == 1.07
    np.testing.assert_allclose(world.movables.masses, 0.1)
    np.testing.assert_allclose(np.ptp(world.movables.outline(0), axis=0), 0.08)


def test_twenty_big_boxes_come_fast_and_impossible_requests_are_refused():
    maze = task(boxes=20, random_start=True)
    seeds = itertools.count()
    assert quickest(lambda: maze.start(stream(next(seeds), "layout")), 20) < 0.01
    with pytest.raises(ScenarioError, match="300 boxes of 1 m do not fit"):
        task(boxes=300).start(stream(0, "layout"))
    with pytest.raises(ScenarioError, match="1 boxes of 9 m do not fit"):
        task(boxes=1, box_size=9.0).start(stream(0, "layout"))


def test_layout_depends_on_the_seed_alone():
    maze = task(boxes=8, wheeled=0.5)
    one = maze.start(stream(3, "layout"))
    maze.start(stream(4, "layout"))
    assert (
        maze.start(stream(3, "layout"))
        == one
        == task(boxes=8, wheeled=0.5).start(stream(3, "layout"))
    )
    assert maze.start(stream(4, "layout")) != one
    assert one.movables.wheeled.sum() == 4


def test_rewards_by_hand():
    maze = task(boxes=2)
    before = maze.start(stream(0, "layout"))
    after = before.moved(robot_pose=(11.25, 3.87, np.pi / 2), time=0.8)
    ahead = maze.score(before, after, work=0.0, touched_static=False)
    # from (11.25, 3.75) the way leads over the wall's round end at (7.5, 10), radius 0.5: straight
    # up it gets shorter by nearly cos(30 deg) of the way driven
    way = maze.field.exact(11.25, 3.75)
    farthest = maze.field.values[np.isfinite(maze.field.values)].max()
    gain = way - maze.field.exact(11.25, 3.87)
    assert 0.1 < gain < 0.12
    assert ahead.reward == pytest.approx(150.0 * gain / farthest, rel=0.02)
    assert not (ahead.terminated or ahead.truncated or ahead.success)

    moved = maze.score(before, before, work=1.0, touched_static=False)
    assert moved.reward == pytest.approx(-1.5)


def test_ends_of_an_episode():
    maze = task(boxes=0)
    before = maze.start(stream(0, "layout"))
    wall = maze.score(before, before, work=0.0, touched_static=True)
    assert (wall.reason, wall.success, wall.terminated) == ("wall", False, True)
    assert wall.reward == pytest.approx(-50.0)
    for distance, success in ((1.855, True), (1.865, False)):
        inside = before.moved(robot_pose=(3.75 + distance, 3.75, 0.0))
        outcome = maze.score(inside, inside, work=0.0, touched_static=False)
        assert outcome.success is success and outcome.terminated is success
        assert outcome.reward == pytest.approx(200.0 if success else 0.0)
        assert outcome.reason == ("goal" if success else "")
    maze.start(stream(0, "layout"))
    outcomes = [maze.score(before, before, work=0.0, touched_static=False) for _ in range(400)]
    assert [outcome.truncated for outcome in outcomes] == [False] * 399 + [True]
    assert outcomes[-1].reason == "time_limit" and not outcomes[-1].terminated


@pytest.mark.parametrize(
    ("bad", "error", "text"),
    [
        ({"shpe": "u"}, UnknownNameError, "did you mean 'shape'"),
        ({"shape": "w"}, ScenarioError, "valid: u, z"),
        ({"boxes": -1}, ScenarioError, "boxes must be at least 0"),
        ({"boxes": 2.5}, ScenarioError, "whole number"),
        ({"wheeled": 1.5}, ScenarioError, "wheeled"),
        ({"box_size": 0.0}, ScenarioError, "box_size"),
        ({"random_start": "yes"}, ScenarioError, "random_start"),
        ({"bumper_friction": float("nan")}, ScenarioError, "bumper_friction"),
        ({"box_yaw": "alined"}, ScenarioError, "did you mean 'aligned'"),
    ],
)
def test_bad_variations_are_refused(bad, error, text):
    with pytest.raises(error, match=text):
        task(**bad)
    with pytest.raises(UnknownNameError, match="did you mean 'benchmark'"):
        MazeTask(preset="benchmrk", variations={}, action="turn_rate")


def test_bumper_friction_is_a_parameter():
    assert task().materials.robot_object == 0.0
    assert task(bumper_friction=0.7).materials.robot_object == 0.7
    assert task("testbed").materials.robot_object == 0.4


def test_the_testbed_robot_can_carry_a_bumper():
    plain, armed = task("testbed"), task("testbed", bumper="collector")
    assert len(plain.robot.parts) == 1 < len(armed.robot.parts)
    assert armed.robot.max_speed == plain.robot.max_speed == 0.2
    assert armed.materials.solids.object_height == 0.08
    armed.start(stream(0, "layout"))
    assert task(bumper="none").robot == task().robot and task().materials.solids is None
    with pytest.raises(ScenarioError, match="does not fit the robot of this preset"):
        task(bumper="pusher")
    with pytest.raises(ScenarioError, match="valid: collector"):
        task("testbed", bumper="shovel")
