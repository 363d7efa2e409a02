from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pushplan.envs import PushEnv
from pushplan.envs.registry import ACTIONS
from pushplan.envs.tasks.base import drive_of
from pushplan.envs.tasks.maze import PRESETS
from pushplan.imports.on_demand import look_up
from pushplan.world import (
    GoalDisc,
    InvalidInputError,
    Movables,
    StaticMap,
    Twist,
    UnknownNameError,
    WheelSpeeds,
    World,
)

unit = st.floats(-1.0, 1.0, width=32)


VELOCITIES = ("turn_rate", "velocity", "wheels")
ROOM = StaticMap.build(
    polygons=[[(1.0, -1.0), (1.2, -1.0), (1.2, 0.6), (1.0, 0.6)]], bounds=(-3.0, -3.0, 3.0, 3.0)
)


def mode(name, preset="testbed"):
    robot = PRESETS[preset].robot(*PRESETS[preset].robots, drive_of(name))
    task = SimpleNamespace(robot=robot, heading_step=0.5, waypoint_window=4.0, control_step=0.15)
    return look_up("action", ACTIONS, name)(task)


def driven(name, action, pose, static=ROOM):
    """Poses of a robot that does exactly as told."""
    m = mode(name)
    world = World(m.robot, np.array(pose), static, Movables.empty(), GoalDisc((2.5, 2.5), 0.1))
    motion = m.start(m.read(action), world)
    poses, time = [np.array(pose, dtype=float)], 0.0
    while (wanted := motion(poses[-1], time, False)) is not None:
        twist, duration = wanted[0], 0.15 * wanted[1]
        start = poses[-1]
        poses += [advanced(start, twist, f * duration) for f in np.linspace(0.1, 1.0, 10)]
        time += duration
    return np.array(poses)


def advanced(pose, twist, h):
    middle = pose[2] + 0.5 * twist.angular * h
    step = np.sinc(0.5 * twist.angular * h / np.pi) * twist.linear * h
    return pose + np.array([step * np.cos(middle), step * np.sin(middle), twist.angular * h])


def command(m, values):
    motion = m.start(m.read(values), None)
    twist, periods = motion(None, 0.0, False)
    assert periods == 1
    assert motion(None, 0.0, False) is None  # these modes last one control step
    return twist


@pytest.mark.parametrize("name", VELOCITIES)
@given(a=unit, b=unit)
def test_commands_keep_the_limits_and_come_back(name, a, b):
    m = mode(name)
    values = np.array([a, b][: m.size], dtype=np.float32)
    twist = command(m, values)
    assert abs(twist.linear) <= m.robot.max_speed * (1 + 1e-9)
    assert abs(twist.angular) <= m.robot.max_turn_rate * (1 + 1e-9)
    back = command(m, m.encode(twist))
    assert back.linear == pytest.approx(twist.linear, abs=1e-6)
    assert back.angular == pytest.approx(twist.angular, abs=1e-5)


def test_turn_rate_scales_and_keeps_speed():
    assert command(mode("turn_rate", "benchmark"), [0.5]) == Twist(0.15, 0.0525)


def test_wheels_are_rim_speeds():
    m = mode("wheels")
    assert m.encode(WheelSpeeds(0.1, 0.1)) == pytest.approx([0.5, 0.5])
    assert command(m, [0.5, 0.6]).angular == pytest.approx(0.02 / 0.16)
    spin = command(m, [-1.0, 1.0])
    assert spin.linear == 0.0 and spin.angular == m.robot.max_turn_rate


def test_too_fast_a_curve_keeps_its_radius():
    m = mode("wheels")
    twist = command(m, m.encode(Twist(0.2, 0.5)))
    assert twist.linear < 0.2
    assert twist.linear / twist.angular == pytest.approx(0.4, rel=1e-5)


@pytest.mark.parametrize("name", ACTIONS)
def test_bad_actions_are_refused(name):
    m = mode(name)
    for bad in (np.zeros(m.size + 1), 0.0, np.zeros((1, m.size)), ["a"] * m.size, None):
        with pytest.raises(InvalidInputError, match="shape"):
            m.read(bad)
    for bad in (np.nan, np.inf):
        with pytest.raises(InvalidInputError, match="finite, got"):
            m.read(np.full(m.size, bad))
    assert (np.abs(m.encode(np.full(m.size, 7.0))) == 1.0).all()


def test_velocity_reverses():
    assert command(mode("velocity"), [-1.0, 0.0]).linear == -0.2


def test_unknown_names_list_the_choices():
    with pytest.raises(UnknownNameError, match="did you mean 'wheels'"):
        look_up("action", ACTIONS, "wheel")


@pytest.mark.parametrize("turn", [0.0, 0.25, -0.5, 1.0])
def test_heading_drives_its_distance_relative_to_the_robot(turn):
    poses = driven("heading", [turn], (-1.0, 0.0, 0.3))
    heading = 0.3 + turn * np.pi
    ahead = np.array([-1.0 + 0.5 * np.cos(heading), 0.5 * np.sin(heading)])
    np.testing.assert_allclose(poses[-1, :2], ahead, atol=0.005)
    straight = np.hypot(*np.diff(poses[:, :2], axis=0).T).sum()
    assert straight == pytest.approx(0.5, abs=0.005)


def test_waypoint_goes_around_what_is_static():
    # two metres ahead, behind the column that reaches from y = -1 to 0.6
    poses = driven("waypoint", [1.0, 0.0], (0.0, 0.0, 0.0))
    np.testing.assert_allclose(poses[-1, :2], (2.0, 0.0), atol=0.01)
    over = poses[(poses[:, 0] > 1.0) & (poses[:, 0] < 1.2)]
    assert len(over) > 0 and (over[:, 1] > 0.6).all()


def test_waypoint_that_cannot_be_reached_ends_where_the_robot_is_stopped():
    m = mode("waypoint")
    world = World(m.robot, np.zeros(3), ROOM, Movables.empty(), GoalDisc((2.5, 2.5), 0.1))
    motion = m.start(m.read([0.55, 0.0]), world)  # inside the column
    calls = 0
    while motion(np.zeros(3), 0.15 * calls, False) is not None:  # something holds the robot
        calls += 1
    assert calls < 10


@pytest.mark.parametrize("name", ["heading", "waypoint"])
def test_places_take_no_velocities(name):
    with pytest.raises(InvalidInputError, match="takes no velocities"):
        mode(name).encode(Twist(0.1, 0.0))


def test_a_robot_at_a_wall_makes_room_for_its_turn():
    """Random headings drive it into walls and corners; it never stands there for long."""
    env = PushEnv(task="box_delivery", observation="state", action="heading")
    env.reset(seed=2)
    rng = np.random.default_rng(2)
    still = longest = 0
    for _ in range(90):
        before = env.world.robot_pose[:2]
        *_, terminated, truncated, _ = env.step(rng.uniform(-1.0, 1.0, 1))
        moved = np.hypot(*(env.world.robot_pose[:2] - before))
        still = still + 1 if moved < 0.02 * env.task.heading_step else 0
        longest = max(longest, still)
        if terminated or truncated:
            break
    assert longest <= 5
