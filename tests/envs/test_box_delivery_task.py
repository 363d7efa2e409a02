from dataclasses import replace

import numpy as np
import pytest
import shapely
from manipulation_checks import check_reach, check_start, shapes

from pushplan.envs import PushEnv
from pushplan.envs.tasks.box_delivery import LAYOUTS, PRESETS, BoxDeliveryTask
from pushplan.world import (
    ScenarioError,
    UnknownNameError,
    area_clearing_robot,
    stream,
)

OTHERS = [pytest.param(name, marks=pytest.mark.slow) for name in PRESETS if name != "benchmark"]
BY_DEFAULT = ["benchmark", *OTHERS]


def task(preset="benchmark", action="velocity", **variations):
    return BoxDeliveryTask(preset=preset, variations=variations, action=action)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("preset", BY_DEFAULT)
@pytest.mark.parametrize("seeds", [12, pytest.param(200, marks=pytest.mark.slow)])
def test_starts_are_valid(preset, layout, seeds):
    delivery = task(preset, layout=layout)
    goal = shapely.Polygon(delivery.goal.polygon)
    dimensions = delivery.preset
    columns = []
    for seed in range(seeds):
        world = delivery.start(stream(seed, "layout"))
        check_start(world, dimensions.box_spacing)
        assert not shapely.union_all(shapes(world)).intersects(goal)
        extra = world.static.polygons[len(delivery._walls) :]
        columns.append(len(extra))
        if seed % 20 == 0:
            check_reach(world, delivery.preset.field_resolution)
        if layout.endswith("columns"):
            middles = np.array([part.mean(axis=0) for part in extra])
            apart = np.hypot(*(middles[:, None] - middles[None]).T)
            others = apart[~np.eye(len(middles), dtype=bool)]
            assert others.min(initial=np.inf) >= dimensions.column_spacing
            assert np.abs(np.ptp(np.array(extra), axis=1) - dimensions.column).max() < 1e-9
            room = np.array(delivery.bounds[2:])
            gap = (room - np.abs(np.concatenate(extra))).min()
            assert gap >= dimensions.column_margin - 1e-9
    if layout.endswith("columns"):
        assert min(columns) == 1
        assert max(columns) > (2 if preset == "benchmark" else 1)


def test_dimensions_of_the_benchmark():
    small, large = task(), task(layout="large_divider")
    world = small.start(stream(0, "layout"))
    np.testing.assert_allclose(world.static.bounds, (-5, -2.5, 5, 2.5))
    np.testing.assert_allclose(small.goal.polygon, [(3.5, 1), (5, 1), (5, 2.5), (3.5, 2.5)])
    assert len(world.movables) == 10 and world.movables.masses[0] == pytest.approx(0.44**2)
    assert small.materials.robot_object == 0.0 and small.materials.solids is None
    assert small.heading_step == 1.75 and small.control_step == 0.2
    world = large.start(stream(1, "layout"))
    assert len(world.movables) == 20
    divider = world.static.polygons[7]
    np.testing.assert_allclose(np.ptp(divider, axis=0), (8.0, 0.5))
    assert divider[:, 0].max() == 5.0 and np.abs(divider[:, 1].mean()) <= 1.5


def test_dimensions_of_the_testbed():
    delivery = task("testbed", bumper="collector", layout="small_columns")
    world = delivery.start(stream(0, "layout"))
    np.testing.assert_allclose(np.ptp(world.static.bounds.reshape(2, 2), axis=0), (1.505, 1.55))
    np.testing.assert_allclose(np.ptp(delivery.goal.polygon, axis=0), 0.3)
    np.testing.assert_allclose(np.ptp(world.movables.outline(0), axis=0), 0.08)
    assert world.movables.masses[0] == 0.075 and world.robot.mass == 1.07
    assert len(world.robot.parts) > 2 and delivery.materials.solids.wheel_radius == 0.033
    big = task("testbed", robot="jackal", layout="large_divider")
    assert big.start(stream(0, "layout")).robot.name == "jackal"
    assert big.materials.solids.wheel_radius == 0.098


def test_variations_take_effect():
    delivery = task(boxes=7, box_size=0.3, box_yaw="aligned", wheeled=0.5, bumper_friction=0.6)
    world = delivery.start(stream(2, "layout"))
    assert len(world.movables) == 7 and world.movables.wheeled.sum() == 4
    np.testing.assert_allclose(np.ptp(world.movables.outline(0), axis=0), 0.3)
    assert not world.movables.poses[:, 2].any() and delivery.materials.robot_object == 0.6
    fixed = task(random_start=False)
    poses = {tuple(fixed.start(stream(seed, "layout")).robot_pose) for seed in range(5)}
    assert len(poses) == 1
    assert len({tuple(task().start(stream(seed, "layout")).robot_pose) for seed in range(5)}) == 5


@pytest.mark.parametrize(
    ("preset", "bad", "error", "text"),
    [
        ("benchmark", {"layot": "small_empty"}, UnknownNameError, "did you mean 'layout'"),
        ("benchmark", {"layout": "small"}, ScenarioError, "small_columns"),
        ("benchmark", {"boxes": 0}, ScenarioError, "boxes must be at least 1"),
        ("benchmark", {"boxes": True}, ScenarioError, "whole number"),
        ("benchmark", {"wheeled": float("nan")}, ScenarioError, "wheeled"),
        ("benchmark", {"box_size": -1.0}, ScenarioError, "box_size"),
        ("benchmark", {"bumper": "collector"}, ScenarioError, "one of its own"),
        ("benchmark", {"robot": "jackal"}, ScenarioError, "valid: benchmark"),
        ("testbed", {"robot": ""}, ScenarioError, "unknown robot ''"),
        ("testbed", {"robot": "jackl"}, ScenarioError, "did you mean 'jackal'"),
        ("testbed", {"bumper": "scoop"}, ScenarioError, "valid: collector"),
        ("benchmark", {"random_start": 1}, ScenarioError, "random_start"),
        ("benchmark", {"bumper_friction": -0.1}, ScenarioError, "bumper_friction"),
    ],
)
def test_bad_variations_are_refused(preset, bad, error, text):
    with pytest.raises(error, match=text):
        task(preset, **bad)


def test_requests_that_cannot_be_met_are_refused():
    with pytest.raises(ScenarioError, match=r"500 boxes of 0\.44 m do not fit"):
        task(boxes=500).start(stream(0, "layout"))
    with pytest.raises(ScenarioError, match="1 boxes of 6 m do not fit"):
        task(boxes=1, box_size=6.0).start(stream(0, "layout"))
    with pytest.raises(UnknownNameError, match="did you mean 'heading'"):
        task(action="headin")
    with pytest.raises(UnknownNameError, match="did you mean 'testbed'"):
        task("testbad")


def test_a_robot_that_fits_nowhere_is_refused():
    delivery = task("testbed", robot="jackal")
    delivery.start(stream(0, "layout"))
    delivery.robot = area_clearing_robot()
    with pytest.raises(ScenarioError, match="no free start for robot 'area-clearing robot'"):
        delivery.start(stream(0, "layout"))


def test_layout_depends_on_the_seed_alone():
    delivery = task(layout="large_columns")
    one = delivery.start(stream(3, "layout"))
    delivery.start(stream(4, "layout"))
    again = task(layout="large_columns").start(stream(3, "layout"))
    assert delivery.start(stream(3, "layout")) == one == again


def shifted(world, change):
    """Another pose of the robot."""
    return world.robot_pose + np.array(change)


def placed(world, rows):
    """The start with its boxes at other poses (K, 3)."""
    return world.moved(movable_poses=np.asarray(rows, dtype=float))


def test_rewards_by_hand():
    delivery = task(boxes=2)
    start = delivery.start(stream(0, "layout"))
    before = placed(start, [(1.0, 1.5, 0.0), (-1.0, 1.5, 0.0)])
    # straight way along y = 1.5 to the receptacle's edge at x = 3.5
    np.testing.assert_allclose(
        delivery.goal_distances(before.movables.poses), (2.5, 4.5), atol=0.01
    )
    nearer = placed(start, [(1.5, 1.5, 0.0), (-1.0, 1.5, 0.0)])
    outcome = delivery.score(before, nearer, work=0.1, touched_static=False)
    assert outcome.reward == pytest.approx(0.2 * 3.0 * 0.5, abs=0.005)
    assert not outcome.success and not outcome.terminated and outcome.reason == ""
    assert outcome.completed.tolist() == [False, False]
    farther = delivery.score(nearer, before, work=0.1, touched_static=True)
    assert farther.reward == pytest.approx(-0.2 * 0.5 - 0.25, abs=0.005)
    both = placed(start, [(1.5, 1.5, 0.0), (-1.5, 1.5, 0.0)])  # each box counts for itself
    outcome = delivery.score(before, both, work=0.1, touched_static=False)
    assert outcome.reward == pytest.approx(0.2 * (3.0 * 0.5 - 0.5), abs=0.005)


def without(world, ids):
    return replace(world, movables=world.movables.select(~np.isin(world.movables.ids, ids)))


@pytest.mark.parametrize(("action", "each"), [("heading", 10.0), ("waypoint", 1.0)])
def test_delivered_boxes_pay_and_stay_completed(action, each):
    delivery = task(action=action, boxes=3)
    start = delivery.start(stream(0, "layout"))
    before = placed(start, [(3.6, 1.5, 0.0), (-1.0, 1.5, 0.0), (0.0, 0.0, 0.0)])
    gone = without(before.moved(robot_pose=shifted(start, [0.5, 0.0, 0.0])), [0])
    outcome = delivery.score(before, gone, work=0.0, touched_static=False)
    assert outcome.reward == pytest.approx(each)
    assert outcome.completed.tolist() == [True, False, False] and not outcome.terminated
    moved = gone.moved(robot_pose=shifted(gone, [0.5, 0.0, 0.0]))
    later = delivery.score(gone, moved, work=0.0, touched_static=False)
    assert later.reward == 0.0 and later.completed.tolist() == [True, False, False]
    last = without(moved, [1, 2]).moved(robot_pose=start.robot_pose)
    end = delivery.score(moved, last, work=0.0, touched_static=False)
    assert end.success and end.terminated and end.reason == "delivered" and end.completed.all()


def test_boxes_leave_when_all_their_corners_are_inside():
    delivery = task(boxes=4)
    delivery.start(stream(0, "layout"))
    ids = np.arange(4)
    poses = np.array(
        [
            (4.2, 1.8, 0.7),  # well inside
            (3.7, 1.8, 0.0),  # sticks out to the left by 2 cm
            (4.78, 2.281, 0.0),  # leans on the walls, 1 mm in
            (3.72, 1.8, 0.5),  # would be inside if it were aligned
        ]
    )
    assert delivery.leaving(ids, poses).tolist() == [0, 2]
    assert delivery.leaving(ids[1:], poses[1:]).tolist() == [2]
    assert delivery.leaving(ids[:0], poses[:0]).tolist() == []


@pytest.mark.parametrize(("action", "limit"), [("heading", 200), ("waypoint", 100)])
def test_cut_off_after_actions_without_a_delivery(action, limit):
    delivery = task(action=action, boxes=2)
    world = delivery.start(stream(0, "layout"))

    def idle(count, world):
        poses = [world.robot_pose, shifted(world, [0.3, 0.0, 0.0])]
        steps = [world.moved(robot_pose=pose) for pose in poses]
        return [
            delivery.score(steps[i % 2], steps[1 - i % 2], work=0.0, touched_static=False)
            for i in range(count)
        ]

    assert not any(outcome.truncated for outcome in idle(limit - 1, world))
    fewer = without(world, [1])
    assert not delivery.score(world, fewer, work=0.0, touched_static=False).truncated
    outcomes = idle(limit, fewer)
    assert [outcome.truncated for outcome in outcomes] == [False] * (limit - 1) + [True]
    assert outcomes[-1].reason == "no_progress" and not outcomes[-1].terminated


def test_velocity_is_cut_off_after_the_time_of_the_heading_actions():
    delivery = task(boxes=1)
    world = delivery.start(stream(0, "layout"))
    assert delivery.idle_time == pytest.approx(200 * 1.75 / 0.3)
    early = world.moved(time=delivery.idle_time - 0.2)
    assert not delivery.score(world, early, work=0.0, touched_static=False).truncated
    late = world.moved(time=delivery.idle_time)
    assert delivery.score(early, late, work=0.0, touched_static=False).truncated


def test_standing_still_costs_with_waypoints_only():
    for action, reward in (("waypoint", -0.25), ("heading", 0.0)):
        delivery = task(action=action)
        world = delivery.start(stream(0, "layout"))
        still = world.moved(robot_pose=shifted(world, [0.02, 0.0, 0.0]))
        assert delivery.score(world, still, work=0.0, touched_static=False).reward == reward
        turned = world.moved(robot_pose=shifted(world, [0.0, 0.0, 0.5]))
        assert delivery.score(world, turned, work=0.0, touched_static=False).reward == 0.0


def test_a_pushed_box_leaves_the_floor_of_the_environment():
    env = PushEnv(
        task="box_delivery",
        preset="testbed",
        action="velocity",
        observation="state",
        variations={"boxes": 2},
    )
    env.reset(seed=0)
    x, y = env.task.bounds[2:]
    world = env.world.moved(
        robot_pose=(x - 0.6, y - 0.15, 0.0),
        movable_poses=[(x - 0.45, y - 0.15, 0.0), (-0.3, -0.3, 0.0)],
    )
    env._simulator.build(world, env.task.materials)
    env._world = world
    rewards = []
    for _ in range(12):
        _, reward, terminated, truncated, info = env.step([1.0, 0.0])
        rewards.append(reward)
    assert env.world.movables.ids.tolist() == [1]
    assert info["completed"].tolist() == [True, False] and not (terminated or truncated)
    per_metre = 3.0 * 0.2 / 0.2845  # towards the receptacle, at the scale of the testbed
    assert sum(rewards) == pytest.approx(10.0 + per_metre * 0.15, abs=0.01)
