"""The logic of the ROS 2 node, in a closed loop without ROS."""

from __future__ import annotations

import itertools
import math
import sys
import time
from pathlib import Path
from types import SimpleNamespace as Some

import numpy as np
import pytest

from pushplan.planners import make_planner
from pushplan.ros import Messages, path_from
from pushplan.world import Cancellation, GoalDisc, InvalidInputError, MaxIterations, Twist
from pushplan.world.stored.robots import turtlebot3_burger

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "examples" / "ros2"))
from navigator import NavigationError, Navigator
from scene import Scene

MESSAGES = Messages()
LIMITS = {"max_acceleration": 0.5, "max_turn_acceleration": 3.0}
PERIOD = 0.05


def room():
    """4 m by 3 m with walls, and a wall in the middle that leaves a door of 1 m at y > 1.9."""
    grid = np.zeros((60, 80), dtype=int)
    grid[[0, -1]] = 100
    grid[:, [0, -1]] = 100
    grid[:38, 39:41] = 100
    return MESSAGES.occupancy(grid, 0.05)


def odometry(pose, twist, time):
    nothing = np.zeros(36)
    make = MESSAGES.make
    velocity = MESSAGES.twist(twist)
    return make(
        "nav_msgs/Odometry",
        header=MESSAGES.header(time),
        child_frame_id="base_link",
        pose=make("geometry_msgs/PoseWithCovariance", pose=MESSAGES.pose(pose), covariance=nothing),
        twist=make("geometry_msgs/TwistWithCovariance", twist=velocity, covariance=nothing),
    )


class Robot:
    """A differential drive without noise, and a navigator at its wheel."""

    def __init__(self, pose=(1.0, 0.75, 0.0), *, stamped=100.0, **options):
        self.scene = Scene(turtlebot3_burger(**LIMITS))
        options = {"planner": "straight", **options}
        self.navigator = Navigator(self.scene, MESSAGES, period=PERIOD, **options)
        self.pose, self.twist, self.now = np.array(pose), Twist(0.0, 0.0), stamped
        self.scene.take_map(room())
        self.see()

    def see(self):
        self.scene.take_odometry(odometry(self.pose, self.twist, self.now))
        self.navigator.see()

    def drive(self, *, steps=600, sees=True, moves=True, until=None, pause=0.0):
        """Commands and what was said of them until the robot stands."""
        said = []
        for _ in range(steps):
            step = self.navigator.step(self.now)
            gain = abs(step.twist.linear - self.twist.linear)
            assert gain <= LIMITS["max_acceleration"] * PERIOD + 1e-9
            assert step.twist.linear <= 0.22
            self.twist = step.twist
            said.append(step)
            if step.outcome or (until is not None and until(step)):
                break
            self.now += PERIOD
            if moves:
                self.pose[2] += PERIOD * self.twist.angular
                heading = np.array([math.cos(self.pose[2]), math.sin(self.pose[2])])
                self.pose[:2] += PERIOD * self.twist.linear * heading
            if sees:
                self.see()
            time.sleep(pause)
        return said

    def path(self, x, y, **options):
        return self.navigator.compute_path(pose(x, y), **options)[0]


def pose(x, y, theta=0.0):
    return MESSAGES.pose_stamped((x, y, theta), 0.0)


def code_of(call):
    with pytest.raises(NavigationError) as caught:
        call()
    assert "\n" not in str(caught.value) and str(caught.value)
    return caught.value.code


def test_a_path_leads_through_the_door():
    robot = Robot()
    message, seconds = robot.navigator.compute_path(pose(3.0, 0.75))
    _, poses = path_from(message, "map")
    at_wall = poses[np.abs(poses[:, 0] - 2.0) < 0.1]
    assert len(at_wall) and (at_wall[:, 1] > 1.9).all()
    assert math.dist(poses[-1, :2], (3.0, 0.75)) <= 0.1 and seconds > 0.0
    other = robot.path(3.0, 0.75, start=pose(3.0, 2.0))
    assert path_from(other)[1][0, :2].tolist() == [3.0, 2.0]


def test_a_path_is_that_of_the_planner_with_the_same_seed():
    robot, stop = Robot(planner="push-aware", budget=600.0), MaxIterations(80)
    goal = GoalDisc([3.0, 0.75], 0.5 * robot.navigator.tolerance)
    result = make_planner("push-aware").plan(
        robot.scene.world(goal), stop=stop, rng=np.random.default_rng(0)
    )
    _, poses = path_from(robot.path(3.0, 0.75, stop=stop))
    assert poses[:, :2].tobytes() == result.plan.poses[:, :2].tobytes()


@pytest.mark.parametrize(
    ("code", "call"),
    [
        ("INVALID_PLANNER", lambda r: r.path(3, 1, planner_id="straigth")),
        ("INVALID_PLANNER", lambda r: r.path(3, 1, planner_id="ship-predictive")),
        ("GOAL_OUTSIDE_MAP", lambda r: r.path(9, 1)),
        ("START_OUTSIDE_MAP", lambda r: r.path(3, 1, start=pose(-2, 1))),
        ("GOAL_OCCUPIED", lambda r: r.path(2.0, 0.75)),
        ("START_OCCUPIED", lambda r: r.path(3, 1, start=pose(2.0, 0.75))),
        ("TF_ERROR", lambda r: r.navigator.compute_path(in_frame("odom"))),
        ("CANCELED", lambda r: r.path(3, 1, stop=cancelled())),
        ("INVALID_PATH", lambda r: r.navigator.follow(MESSAGES.make("nav_msgs/Path", **EMPTY))),
        ("INVALID_CONTROLLER", lambda r: r.navigator.follow(r.path(3, 1), "gtsp-mpc")),
        ("INVALID_CONTROLLER", lambda r: r.navigator.follow(r.path(3, 1), "paht")),
    ],
)
def test_what_cannot_be_served_has_the_code_of_nav2(code, call):
    robot = Robot()
    assert code_of(lambda: call(robot)) == code
    assert not robot.navigator.is_driving


@pytest.mark.parametrize(
    ("planner", "controller"),
    [
        ("straight", "path"),
        ("push-aware", "push-aware"),
        pytest.param("straight", "push-aware", marks=pytest.mark.slow),
        pytest.param("push-aware", "path", marks=pytest.mark.slow),
    ],
)
def test_the_orientation_of_a_goal_counts_where_a_tolerance_is_set(planner, controller):
    tolerance = math.radians(4.0)
    robot = Robot(planner=planner, heading_tolerance=tolerance)
    path, _ = robot.navigator.compute_path(pose(3.1, 1.8, -2.0))
    robot.navigator.follow(path, controller)
    said = robot.drive(pause=0.0 if controller == "path" else 0.005)
    assert said[-1].outcome == "SUCCEEDED"
    assert math.dist(robot.pose[:2], (3.1, 1.8)) <= 0.1
    assert abs(math.remainder(robot.pose[2] + 2.0, math.tau)) <= tolerance


EMPTY = {"header": MESSAGES.header(0.0), "poses": []}


def in_frame(frame):
    message = pose(3, 1)
    message.header.frame_id = frame
    return message


def cancelled():
    token = Cancellation()
    token.cancel()
    return token


def test_a_goal_that_comes_before_the_map_or_the_odometry_is_refused():
    scene = Scene(turtlebot3_burger())
    navigator = Navigator(scene, MESSAGES, planner="straight")
    assert code_of(lambda: navigator.compute_path(pose(3, 1))) == "UNKNOWN"
    scene.take_map(room())
    assert code_of(lambda: navigator.compute_path(pose(3, 1))) == "TF_ERROR"
    with pytest.raises(InvalidInputError, match="OccupancyGrid"):
        scene.take_map(pose(0, 0))


def test_a_path_is_driven_to_its_end():
    robot = Robot()
    robot.navigator.follow(robot.path(3.0, 0.75))
    said = robot.drive()
    assert said[-1].outcome == "SUCCEEDED" and not robot.navigator.is_driving
    assert math.dist(robot.pose[:2], (3.0, 0.75)) <= 0.1
    assert said[0].distance == pytest.approx(3.3, abs=0.3) and said[-1].distance < 0.2
    assert max(step.twist.linear for step in said) > 0.2


def test_another_path_is_taken_up_without_a_stop():
    robot = Robot()
    robot.navigator.follow(robot.path(3.0, 0.75))
    robot.drive(steps=100)
    before = robot.twist.linear
    assert before > 0.15
    began = time.thread_time()
    robot.navigator.follow(robot.path(3.0, 2.2))
    assert time.thread_time() - began < 1.0
    said = robot.drive()
    assert abs(said[0].twist.linear - before) < 0.03 and said[-1].outcome == "SUCCEEDED"
    assert math.dist(robot.pose[:2], (3.0, 2.2)) <= 0.1


@pytest.mark.slow
def test_a_policy_drives_on_plans_of_its_own():
    robot = Robot()
    path = robot.path(3.0, 0.75)
    robot.navigator.follow(path, "straight")
    said = robot.drive(steps=60, pause=0.005)
    robot.navigator.follow(path, "straight")  # the same goal once more changes nothing
    said += robot.drive(pause=0.005)
    assert said[-1].outcome == "SUCCEEDED"
    assert [step.twist.linear for step in said[40:80]] != [0.0] * 40


@pytest.mark.parametrize(
    ("outcome", "options"),
    [
        ("CANCELED", {}),
        ("TF_ERROR", {"sees": False}),
        ("FAILED_TO_MAKE_PROGRESS", {"moves": False}),
    ],
)
def test_the_robot_brakes_before_a_goal_ends_early(outcome, options):
    robot = Robot(patience=(4.0, 0.5))
    robot.navigator.follow(robot.path(3.0, 0.75))
    said = robot.drive(steps=100)
    assert robot.twist.linear > 0.15
    if outcome == "CANCELED":
        robot.navigator.cancel()
    said = robot.drive(**options)
    assert said[-1].outcome == outcome and said[-1].reason
    assert said[-1].twist == Twist(0.0, 0.0) and len(said) > 5
    assert not robot.navigator.is_driving


def test_odometry_that_comes_in_while_a_path_is_taken_up_does_not_end_it() -> None:
    robot = Robot()
    robot.navigator.follow(robot.path(1.0, 1.5))
    robot.drive(until=lambda step: step.distance < 0.03)
    runner = robot.navigator._runners["path"]
    start = runner.start

    def slow_start(world):
        command = start(world)
        robot.scene.take_odometry(odometry(robot.pose, robot.twist, robot.now + 0.02))
        robot.navigator.see()  # by another thread, at the goal of before
        return command

    runner.start = slow_start
    robot.navigator.follow(robot.path(3.0, 2.2))
    robot.drive(steps=3, sees=False)
    assert robot.drive()[-1].outcome == "SUCCEEDED"
    assert math.dist(robot.pose[:2], (3.0, 2.2)) <= 0.1


def test_a_path_that_is_refused_leaves_the_old_one():
    robot = Robot()
    path = robot.path(3.0, 0.75)
    robot.navigator.follow(path)
    robot.drive(steps=100)
    assert code_of(lambda: robot.navigator.follow(path, "gtsp-mpc")) == "INVALID_CONTROLLER"
    assert robot.navigator.is_driving and robot.drive()[-1].outcome == "SUCCEEDED"


CIRCLE = [
    (2 + math.cos(a), 1.5 + math.sin(a)) for a in np.linspace(-math.pi / 2, 3 * math.pi / 2, 40)
]
SHAPES = {
    "a loop": [(1, 1), (3, 1), (3, 2), (1, 2), (1, 1)],
    "passes its end": [(0.5, 1), (3, 1), (3, 2.5), (1.5, 2.5), (1.5, 1)],
    "a lollipop": [(0.6, 0.5), *CIRCLE, (0.6, 0.5)],
    "a figure eight": [(2, 1.5), (3, 2.5), (3, 0.5), (1, 2.5), (1, 0.5), (2, 1.5)],
    "there and back": [(1, 1), (3, 1), (1, 1)],
}
DRIVEN = [("a loop", 100.0), ("passes its end", 3.0), ("there and back", 100.0)]
"""The slow tests drive every shape, with stamps of both kinds."""


def given_path(corners, stamp=100.0):
    corners = np.array(corners, dtype=float)
    points = [a + (b - a) * k / 20 for a, b in itertools.pairwise(corners) for k in range(20)]
    points = np.array([*points, corners[-1]])
    steps = np.diff(points, axis=0)
    headings = np.arctan2(steps[:, 1], steps[:, 0])
    poses = np.column_stack([points, np.append(headings, headings[-1])])
    header = MESSAGES.header(stamp)
    poses = [MESSAGES.pose_stamped(pose, stamp) for pose in poses]
    length = float(np.hypot(*steps.T).sum())
    return MESSAGES.make("nav_msgs/Path", header=header, poses=poses), length


def empty_room(*blocks):
    """4 m by 3 m; what is static beside the walls as boxes of cells."""
    grid = np.zeros((60, 80), dtype=int)
    grid[[0, -1]] = 100
    grid[:, [0, -1]] = 100
    for rows, columns in blocks:
        grid[rows, columns] = 100
    return MESSAGES.occupancy(grid, 0.05)


@pytest.mark.parametrize(
    ("shape", "stamp"),
    [
        pytest.param(shape, stamp, marks=() if (shape, stamp) in DRIVEN else pytest.mark.slow)
        for shape in SHAPES
        for stamp in (3.0, 100.0)
    ],
)
def test_a_path_that_passes_its_own_end_is_driven_to_its_end(shape, stamp):
    corners = SHAPES[shape]
    path, length = given_path(corners, stamp)
    robot = Robot((*corners[0], 0.0))
    robot.scene.take_map(empty_room())
    robot.navigator.follow(path)
    said = robot.drive(steps=2000)
    driven = PERIOD * sum(abs(step.twist.linear) for step in said)
    assert said[-1].outcome == "SUCCEEDED" and driven > length - 0.3
    assert math.dist(robot.pose[:2], corners[-1]) <= 0.1
    assert said[0].distance == pytest.approx(length, abs=0.1)


BLOCK = (slice(24, 37), slice(40, 44))  # x 2 to 2.2 m, y 1.2 to 1.85 m


@pytest.mark.slow
@pytest.mark.parametrize("controller", ["", "straight"])
def test_a_robot_stops_or_drives_around_what_comes_into_its_path(controller):
    path, _ = given_path([(0.5, 1.5), (3.5, 1.5)])
    robot = Robot((0.5, 1.5, 0.0), patience=(3.0, 1.0))
    robot.scene.take_map(empty_room())
    robot.navigator.follow(path, controller)
    robot.drive(until=lambda step: robot.pose[0] > 1.6, pause=0.002)
    assert robot.twist.linear > 0.2
    robot.scene.take_map(empty_room(BLOCK))
    places = []
    said = robot.drive(steps=1500, until=lambda step: places.append(robot.pose.copy()), pause=0.002)
    hull = robot.scene.robot.circumscribed_radius
    for x, y, _ in places:
        away = np.maximum([2.0 - x, x - 2.2, 1.2 - y], [0.0, 0.0, y - 1.85])
        assert np.hypot(max(away[0], away[1], 0.0), max(away[2], 0.0)) > 0.5 * hull
    if controller:
        assert said[-1].outcome == "SUCCEEDED"
    else:
        assert said[-1].outcome == "FAILED_TO_MAKE_PROGRESS"
        assert "static" in said[-1].reason


def test_a_blocked_path_is_aborted_with_a_reason_and_driven_when_it_is_free_again():
    path, _ = given_path([(0.5, 1.5), (3.5, 1.5)])
    robot = Robot((0.5, 1.5, 0.0), patience=(3.0, 1.0))
    robot.scene.take_map(empty_room(BLOCK))
    robot.navigator.follow(path)
    robot.drive(steps=40)
    assert robot.navigator.is_driving and robot.twist == Twist(0.0, 0.0)
    robot.scene.take_map(empty_room())
    robot.drive(steps=100)
    assert robot.twist.linear > 0.15
    robot.scene.take_map(empty_room(BLOCK))
    said = robot.drive()
    assert said[-1].outcome == "FAILED_TO_MAKE_PROGRESS"
    assert "the path leads through something static near (2." in said[-1].reason


def test_names_of_nav2s_own_files_stand_for_what_is_configured():
    robot = Robot()
    assert path_from(robot.path(3.0, 0.75, planner_id="GridBased"))
    path, _ = given_path([(1, 0.75), (1, 2)])
    robot.navigator.follow(path, "FollowPath")
    assert robot.drive()[-1].outcome == "SUCCEEDED"


def test_an_unknown_controller_is_refused_before_there_is_a_goal():
    assert code_of(lambda: Robot(controller="paht")) == "INVALID_CONTROLLER"


@pytest.mark.parametrize("back", [pytest.param(0.3, marks=pytest.mark.slow), 50.0])
def test_a_clock_that_steps_back_stops_the_robot_and_the_path_is_driven_on(back):
    path, length = given_path(SHAPES["passes its end"])
    robot = Robot((0.5, 1.0, 0.0), patience=(3.0, 1.0))
    robot.scene.take_map(empty_room())
    robot.navigator.follow(path)
    said = robot.drive(until=lambda step: robot.pose[1] > 1.8)
    before = robot.twist.linear
    robot.now -= back
    robot.see()
    said += robot.drive(steps=1)
    assert robot.twist.linear < before
    said += robot.drive()
    driven = PERIOD * sum(abs(step.twist.linear) for step in said)
    assert said[-1].outcome == "SUCCEEDED" and driven == pytest.approx(length, abs=0.3)


def test_a_clock_that_stands_at_another_time_ends_the_goal():
    path, _ = given_path([(0.5, 1.5), (3.5, 1.5)])
    robot = Robot((0.5, 1.5, 0.0), patience=(3.0, 1.0))
    robot.scene.take_map(empty_room())
    robot.navigator.follow(path)
    robot.drive(steps=60)
    robot.now -= 50.0  # of the node; odometry is as before
    said = robot.drive(sees=False)
    assert said[-1].outcome == "TF_ERROR" and "went back by" in said[-1].reason


def test_objects_of_the_future_are_refused_and_those_of_a_clock_set_back_are_taken():
    scene = Scene(turtlebot3_burger())

    def seen(stamp, now):
        header = MESSAGES.header(stamp)
        one = marker(7, (1.5, 1.0, 0.3), cube=0.2)
        one.header = header
        scene.take_objects(MESSAGES.make("visualization_msgs/MarkerArray", markers=[one]), now)
        return scene._movables.poses[:, 0].tolist()

    assert seen(100.0, 100.0) == [1.5]
    with pytest.raises(InvalidInputError, match="60 s later"):
        seen(160.0, 100.0)
    assert scene._tracker.time == 100.0
    assert seen(20.0, 20.1) == [1.5] and scene._tracker.time == 20.0


def test_markers_become_objects_that_keep_their_ids():
    robot = Robot()
    corners = [(-0.1, -0.1), (0.1, -0.1), (0.0, 0.2)]
    for x in (1.5, 1.5, 1.52):
        markers = [marker(7, (x, 1.0, 0.3), cube=0.2), marker(3, (1.0, 2.0, 0.0), corners)]
        array = MESSAGES.make("visualization_msgs/MarkerArray", markers=markers)
        robot.scene.take_objects(array, 1e3)
    world = robot.scene.world(robot.navigator._goal_at(np.array([3.0, 1.0])))
    by_id = dict(zip(world.movables.ids.tolist(), range(2), strict=True))
    assert sorted(by_id) == [3, 7]
    box = world.movables.outline_world(by_id[7])
    np.testing.assert_allclose(box.mean(axis=0), [1.5, 1.0], atol=0.03)
    np.testing.assert_allclose(np.hypot(*(box - box.mean(axis=0)).T), 0.1 * math.sqrt(2), atol=0.01)
    assert len(world.movables.outline(by_id[3])) == 3
    wrong = marker(1, (0.0, 0.0, 0.0), cube=0.1, frame="camera")
    with pytest.raises(InvalidInputError, match="'camera'"):
        robot.scene.take_objects(
            MESSAGES.make("visualization_msgs/MarkerArray", markers=[wrong]), 1.0
        )


def costmap():
    """The room as a costmap of Nav2: what lies within 0.6 m of the middle wall has a price."""
    grid = np.zeros((60, 80), dtype=int)
    grid[:50, 28:52] = 60
    grid[:38, 38:42] = 99
    walls = np.reshape(room().data, grid.shape)
    return MESSAGES.occupancy(np.where(walls == 100, 100, grid), 0.05)


def test_lethal_cells_of_a_costmap_are_walls_and_others_a_price():
    robot = Robot(planner="push-aware")
    robot.scene.take_costmap(costmap(), most=5.0)
    world = robot.scene.world(robot.navigator._goal_at(np.array([3.0, 0.75, 0.0])))
    plain = Robot().scene.world(world.goal)
    assert world.static == plain.static
    assert world.price.prices.max() == 5.0 and world.price.prices[45, 40] > 0.0
    _, poses = path_from(robot.path(3.0, 0.75), "map")
    at_wall = poses[np.abs(poses[:, 0] - 2.0) < 0.1]
    assert len(at_wall) and (at_wall[:, 1] > 1.9).all()


ODOM = np.array([0.5, -0.25, 0.6])
"""Pose of the frame ``odom`` in ``map``."""


def pose_of(header):
    if header.frame_id != "odom":
        raise InvalidInputError(f"no transform from {header.frame_id!r} to 'map'")
    return ODOM


def in_odom(pose):
    """A pose of the map as it is in ``odom``."""
    c, s = math.cos(ODOM[2]), math.sin(ODOM[2])
    dx, dy = pose[0] - ODOM[0], pose[1] - ODOM[1]
    return np.array([c * dx + s * dy, c * dy - s * dx, pose[2] - ODOM[2]])


def test_messages_in_other_frames_are_transformed():
    robot = Robot()
    plain = robot.scene.world(robot.navigator._goal_at(np.array([3.0, 0.75, 0.0])))
    robot.scene._pose_of = pose_of
    message = odometry(in_odom(robot.pose), Twist(0.2, 0.1), robot.now)
    message.header.frame_id = "odom"
    robot.scene.take_odometry(message)
    box = marker(7, in_odom((1.5, 1.0, 0.3)), cube=0.2, frame="odom")
    robot.scene.take_objects(
        MESSAGES.make("visualization_msgs/MarkerArray", markers=[box]), robot.now
    )
    world = robot.scene.world(plain.goal)
    np.testing.assert_allclose(world.robot_pose, plain.robot_pose, atol=1e-12)
    np.testing.assert_allclose(world.robot_twist, [0.2, 0.0, 0.1], atol=1e-12)
    np.testing.assert_allclose(world.movables.poses[0, :2], [1.5, 1.0], atol=1e-12)
    goal = MESSAGES.pose_stamped(in_odom((3.0, 2.2, 0.0)), 0.0)
    goal.header.frame_id = "odom"
    assert math.dist(path_from(robot.navigator.compute_path(goal)[0])[1][-1, :2], (3.0, 2.2)) < 0.1
    path, _ = given_path([in_odom((1.0, 0.75, 0.0))[:2], in_odom((1.0, 2.0, 0.0))[:2]])
    for part in (path, *path.poses):
        part.header.frame_id = "odom"
    robot.see()
    robot.navigator.follow(path)
    assert robot.drive()[-1].outcome == "SUCCEEDED"
    assert math.dist(robot.pose[:2], (1.0, 2.0)) <= 0.1


def test_a_frame_that_cannot_be_transformed_is_named():
    robot = Robot()
    with pytest.raises(NavigationError, match=r"'map', got one in 'odom'.*no tf2") as caught:
        robot.navigator.compute_path(in_frame("odom"))
    assert caught.value.code == "TF_ERROR"
    robot.scene._pose_of = pose_of
    with pytest.raises(NavigationError, match="no transform from 'camera' to 'map'"):
        robot.navigator.compute_path(in_frame("camera"))
    path, _ = given_path([(1, 0.75), (1, 2)])
    for part in (path, *path.poses):
        part.header.frame_id = "camera"
    assert code_of(lambda: robot.navigator.follow(path)) == "TF_ERROR"


STAMPS = iter(range(1, 10**6))


def marker(number, at, corners=(), *, cube=0.0, frame="map"):
    make = MESSAGES.make
    vector = make("geometry_msgs/Vector3", x=cube, y=cube, z=0.1)
    points = [make("geometry_msgs/Point", x=x, y=y, z=0.0) for x, y in corners]
    header = MESSAGES.header(0.1 * next(STAMPS), frame)
    return Some(
        header=header, id=number, type=1 if cube else 4, pose=MESSAGES.pose(at), scale=vector,
        points=points,
    )  # fmt: skip
