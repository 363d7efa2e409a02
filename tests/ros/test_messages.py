"""Messages against the library's own types, CDR and back."""

from __future__ import annotations

import array
import math
import re

import numpy as np
import pytest
from conftest import make_robot, make_u_maze
from hypothesis import given
from hypothesis import strategies as st

from pushplan.ros import (
    Messages,
    RosbagsTypes,
    frame_of,
    path_from,
    plan_from,
    polygon_from,
    pose_from,
    price_map_from,
    static_map_from,
    time_from,
    twist_from,
)
from pushplan.world import (
    InvalidInputError,
    Plan,
    PushplanError,
    SchemaError,
    StaticMap,
    Twist,
    UnknownNameError,
)

MESSAGES = Messages()
TYPES = RosbagsTypes()
COORDINATES = st.floats(-1e4, 1e4)
POSES = st.tuples(COORDINATES, COORDINATES, st.floats(-math.pi, math.pi))


def sent(message):
    """A message that went over the wire."""
    data = TYPES.serialize(message)
    read = TYPES.deserialize(data, message.__msgtype__)
    assert TYPES.serialize(read) == data
    return read


def some_plan() -> Plan:
    times = np.array([0.0, 0.5, 1.25, 2.0])
    poses = np.array([[0.0, 0, 0], [0.1, 0, 0.3], [0.25, 0.1, -3.1], [0.3, 0.1, 3.1]])
    return Plan(times, poses, np.ones(4), np.zeros(4), travel_cost=1.0)


@given(POSES, st.floats(0.0, 2e9))
def test_a_pose_comes_back(pose, time):
    read = sent(MESSAGES.pose_stamped(pose, time))
    assert type(read).__name__ == "geometry_msgs__msg__PoseStamped"
    back = pose_from(read, "map")
    assert back[:2].tolist() == list(pose[:2])
    assert math.cos(back[2] - pose[2]) == pytest.approx(1.0, abs=1e-12)
    assert abs(math.sin(back[2] - pose[2])) < 1e-12
    assert time_from(read) == pytest.approx(time, abs=5e-7)
    assert pose_from(read.pose).tolist() == back.tolist()


@given(st.floats(-10, 10), st.floats(-10, 10), st.floats(0, 1e6))
def test_a_twist_comes_back(linear, angular, time):
    twist = Twist(linear, angular)
    read = sent(MESSAGES.twist_stamped(twist, time))
    assert twist_from(read) == twist == twist_from(sent(MESSAGES.twist(twist)))
    assert frame_of(read) == "base_link"


def test_a_plan_comes_back_as_a_path():
    plan = some_plan()
    read = sent(MESSAGES.path(plan, 12.5))
    assert [pose.header.frame_id for pose in read.poses] == ["map"] * 4
    times, poses = path_from(read, "map")
    np.testing.assert_allclose(times, 12.5 + plan.times, atol=1e-9)
    np.testing.assert_allclose(poses, plan.poses, atol=1e-12)
    again = plan_from(read, make_robot(max_speed=1.0, max_turn_rate=4.0))
    np.testing.assert_allclose(again.times, plan.times, atol=1e-9)
    assert again.travel_cost == pytest.approx(plan.length)
    assert again.turn_rates[2] == pytest.approx((6.2 - 2 * math.pi) / 0.75)  # the short way round


def test_a_path_with_times_turns_on_the_spot_and_goes_back_as_the_plan_does():
    robot = make_robot(drive="differential", max_speed=1.0, min_speed=-1.0, max_turn_rate=2.0)
    poses = np.array([[0.0, 0, 0], [0, 0, 1.5], [0, 1, 1.5], [0, 0.2, 1.6]])
    times, rates = np.array([0.0, 1, 2, 3]), np.array([[0.0, 1.5], [1, 0], [-0.8, 0.1], [0, 0]])
    plan = Plan(times, poses, rates[:, 0], rates[:, 1], travel_cost=1.8)
    assert plan_from(sent(MESSAGES.path(plan, 0.0)), robot).stages == plan.stages
    assert [stage.direction for stage in plan.stages] == [0, 1, -1]


def test_a_path_without_times_is_driven_at_the_robots_speed():
    robot = make_robot(max_speed=0.5, max_turn_rate=1.0)
    poses = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 1.5]])
    still = Plan(np.zeros(3), poses, np.zeros(3), np.zeros(3), travel_cost=1.0)
    plan = plan_from(sent(MESSAGES.path(still, 3.0)), robot)
    assert plan.times.tolist() == pytest.approx([0.0, 2.0, 3.5])
    assert plan.speeds.tolist() == pytest.approx([0.5, 0.0, 0.0])
    assert plan.turn_rates.tolist() == pytest.approx([0.0, 1.0, 0.0])


@given(
    st.lists(st.tuples(st.integers(2, 12), st.floats(-3, 3)), min_size=1, max_size=5),
    st.sampled_from(["equal", "later", "earlier", "micro", "driven"]),
    st.sampled_from([0.0, 1.8e9]),
    st.sampled_from(["differential", "car"]),
)
def test_stamps_of_joined_legs_are_times_only_where_the_robot_can_drive_in_them(
    legs, stamps, begin, drive
):
    car = {"min_turning_radius": 0.3} if drive == "car" else {}
    robot = make_robot(drive=drive, max_speed=0.22, min_speed=0.0, max_turn_rate=2.84, **car)
    points, times, at, now = [], [], np.zeros(2), begin
    for count, heading in legs:
        step = 0.05 * np.array([math.cos(heading), math.sin(heading)])
        points += [(*(at + k * step), heading) for k in range(count + 1)]
        at = at + count * step
        each = {"micro": 1e-6, "driven": 3.0}.get(stamps, 0.0)
        times += [now + k * each for k in range(count + 1)]
        now += {"later": 0.08, "earlier": -0.08, "equal": 0.0}.get(stamps, each * (count + 1))
        now = max(now, 0.0)
    poses = [MESSAGES.pose_stamped(p, time) for p, time in zip(points, times, strict=True)]
    header = MESSAGES.header(begin)
    plan = plan_from(MESSAGES.make("nav_msgs/Path", header=header, poses=poses), robot)
    length = 0.05 * sum(count for count, _ in legs)
    assert plan.duration >= length / robot.max_speed - 1e-6
    assert np.abs(plan.speeds).max() <= robot.max_speed * (1 + 1e-9)
    assert np.abs(plan.turn_rates).max() <= robot.max_turn_rate * (1 + 1e-9)
    driven = np.abs(plan.speeds[:-1]) * np.diff(plan.times)
    np.testing.assert_allclose(driven, np.hypot(*np.diff(plan.poses[:, :2], axis=0).T), atol=1e-9)
    if stamps == "driven":
        assert plan.duration == pytest.approx(times[-1] - times[0], abs=1e-5)


def test_outlines_come_back_in_single_precision():
    corners = np.array([[0.1, 0.2], [3.0, 0.2], [3.0, 4.4]])
    read = sent(MESSAGES.polygon(corners, 1.0))
    assert polygon_from(read, "map").tolist() == corners.astype(np.float32).tolist()
    assert polygon_from(read.polygon).shape == (3, 2)


@pytest.mark.parametrize("origin", [(0.0, 0.0, 0.0), (-3.0, 2.5, 0.7)])
def test_a_grid_becomes_the_same_map(origin):
    grid = np.random.default_rng(4).choice([-1, 0, 100, 64, 65], size=(7, 11))
    read = sent(MESSAGES.occupancy(grid, 0.05, origin))
    assert read.data.dtype == np.int8 and (read.info.width, read.info.height) == (11, 7)
    for unknown in ("obstacle", "free"):
        seen = static_map_from(read, "map", unknown=unknown)
        meant = StaticMap.from_occupancy(grid, 0.05, origin, unknown=unknown)
        np.testing.assert_allclose(seen.bounds, meant.bounds, atol=1e-12)
        assert len(seen.polygons) == len(meant.polygons)
        for a, b in zip(seen.polygons, meant.polygons, strict=True):
            np.testing.assert_allclose(a, b, atol=1e-12)


CELLS = [[0, 100, -1], [50, 65, 0]]


@pytest.mark.parametrize(
    "shown",
    [
        lambda cells: cells.view(np.uint8),
        lambda cells: cells.view(np.uint8).astype(np.int64),
        lambda cells: cells.view(np.uint8).astype(np.uint64),
        lambda cells: cells.view(np.uint8).tolist(),
        lambda cells: array.array("B", cells.tobytes()),
        lambda cells: array.array("b", cells.tolist()),
        lambda cells: cells.tobytes(),
        lambda cells: bytearray(cells.tobytes()),
        lambda cells: cells.tolist(),
    ],
)
def test_cells_may_be_signed_or_unsigned(shown):
    message = MESSAGES.occupancy(CELLS, 0.5)
    meant = static_map_from(message), price_map_from(message, most=2.0)
    message.data = shown(np.array(CELLS, dtype=np.int8).ravel())
    assert (static_map_from(message), price_map_from(message, most=2.0)) == meant


@pytest.mark.parametrize(
    ("cells", "told"),
    [
        (np.array([0, 300, 0, 0, 0, 0]), "0 to 100 [%], got 300"),
        (np.array([0, 2**64 - 1, 0, 0, 0, 0], dtype=np.uint64), f"got {2**64 - 1}"),
        (np.array([0, 200, 0, 0, 0, 0], dtype=np.uint8), "0 to 100 [%], got 200"),
        ([0, -2, 0, 0, 0, 0], "0 to 100 [%], got -2"),
        (np.full(6, 0.5), "holds whole numbers"),
        (["a"] * 6, "holds whole numbers"),
        (None, "holds whole numbers"),
    ],
)
def test_cells_that_no_grid_holds_are_refused(cells, told):
    message = MESSAGES.occupancy(CELLS, 0.5)
    message.data = cells
    for read in (static_map_from, lambda grid: price_map_from(grid, most=2.0)):
        with pytest.raises(InvalidInputError, match=re.escape(told)):
            read(message)


def bad(name):
    pose = MESSAGES.pose_stamped((0, 0, 0), 0.0)
    path, grid = MESSAGES.path(some_plan()), MESSAGES.occupancy(np.zeros((2, 3), int), 0.1)
    twist = MESSAGES.twist(Twist(1, 0))
    if name == "tilted":
        pose.pose.orientation.x = 1.0
        pose.pose.orientation.w = 0.0
        return pose_from, pose
    if name == "quaternion":
        pose.pose.orientation.w = 0.0
        return pose_from, pose
    if name == "nan":
        pose.pose.position.x = math.nan
        return pose_from, pose
    if name == "nan quaternion":
        pose.pose.orientation.z = math.nan
        return pose_from, pose
    if name == "frame":
        return lambda message: path_from(message, "odom"), path
    if name == "frame within":
        path.poses[2].header.frame_id = "odom"
        return path_from, path
    if name == "empty":
        path.poses.clear()
        return path_from, path
    if name == "cells":
        grid.info.width = 4
        return static_map_from, grid
    if name == "type":
        return static_map_from, path
    if name == "no message":
        return pose_from, "pose"
    if name == "sideways":
        twist.linear.y = 0.2
        return twist_from, twist
    twist.linear.x = math.inf
    return twist_from, twist


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("tilted", "15 degrees"),
        ("quaternion", "length 1"),
        ("nan", "finite"),
        ("nan quaternion", "length 1"),
        ("frame", "'odom', got one in 'map'"),
        ("frame within", "'map', got one in 'odom'"),
        ("empty", "at least one pose"),
        ("cells", "needs 8 cells, got 6"),
        ("type", "OccupancyGrid, got nav_msgs/Path"),
        ("no message", "got builtins/str"),
        ("sideways", "linear.y"),
        ("infinite", "finite"),
    ],
)
def test_a_bad_message_is_one_clear_error(name, says):
    read, message = bad(name)
    with pytest.raises(InvalidInputError, match=says) as caught:
        read(message)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("call", "error", "says"),
    [
        (lambda: MESSAGES.stamp(-1.0), InvalidInputError, "time must lie"),
        (lambda: MESSAGES.pose((0, math.nan, 0)), InvalidInputError, "finite"),
        (lambda: MESSAGES.occupancy([[101]], 0.1), InvalidInputError, "101"),
        (lambda: MESSAGES.occupancy([[0.5]], 0.1), InvalidInputError, "whole numbers"),
        (lambda: MESSAGES.path(make_u_maze()), InvalidInputError, "plan"),
        (lambda: TYPES("nav_msgs/msg/Pat"), UnknownNameError, "nav_msgs/msg/Path"),
        (lambda: TYPES.deserialize(b"\0\1\0\0ab", "nav_msgs/msg/Path"), SchemaError, "no nav_msgs"),
    ],
)
def test_what_cannot_be_a_message_is_one_clear_error(call, error, says):
    with pytest.raises(error, match=says):
        call()
    assert issubclass(error, PushplanError)
