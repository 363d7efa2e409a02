import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pushplan.control import DriveTo
from pushplan.world import Drive, InvalidInputError, RobotModel

ROBOT = RobotModel.from_outline(
    [(0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1)],
    mass=1.0,
    drive=Drive.DIFFERENTIAL,
    max_speed=0.2,
    min_speed=-0.2,
    max_turn_rate=1.5,
)
PERIOD = 0.2
places = st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))


def run(points, pose=(0.0, 0.0, 0.0), follow=1.0):
    """Poses of a robot whose speeds are ``follow`` times what it is told."""
    driver, poses = DriveTo(ROBOT, points, PERIOD), [np.array(pose, dtype=float)]
    while (twist := driver.command(poses[-1])) is not None:
        assert driver.periods >= 1
        assert abs(twist.linear) <= ROBOT.max_speed and abs(twist.angular) <= ROBOT.max_turn_rate
        x, y, theta = poses[-1]
        v, w = follow * twist.linear * PERIOD, follow * twist.angular * PERIOD
        poses.append(
            np.array([x + v * np.cos(theta + w / 2), y + v * np.sin(theta + w / 2), theta + w])
        )
    return driver, np.array(poses)


@given(points=st.lists(places, min_size=1, max_size=4), heading=st.floats(-np.pi, np.pi))
def test_it_arrives_by_every_point(points, heading):
    driver, poses = run(points, (0.0, 0.0, heading))
    assert driver.arrived
    for point in points:
        assert np.hypot(*(poses[:, :2] - point).T).min() < 0.02
    length = np.hypot(*np.diff(poses[:, :2], axis=0).T).sum()
    way = np.hypot(*np.diff([(0.0, 0.0), *points], axis=0).T).sum()
    assert length <= way + 0.02 * len(points)


@given(point=places, follow=st.floats(0.7, 1.0))
def test_a_robot_that_lags_arrives_too(point, follow):
    driver, poses = run([point], follow=follow)
    assert driver.arrived
    assert np.hypot(*(poses[-1, :2] - point)) < 0.02


def test_it_gives_up_where_it_is_stopped():
    driver, poses = run([(1.0, 0.0)], follow=0.0)
    assert not driver.arrived
    assert len(poses) < 8


def test_bad_points_are_refused():
    for bad in ([], [(0.0, np.nan)], [(1.0,)], "ab"):
        with pytest.raises(InvalidInputError, match="points"):
            DriveTo(ROBOT, bad, PERIOD)
