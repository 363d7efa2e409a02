"""A box behind the robot is reached, whatever the control rate and the greatest turn rate."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import make_boxes

from pushplan.planners.rearrangement import Gtsp, GtspMpc
from pushplan.planners.rearrangement.greedy import GreedyPusher
from pushplan.world import ClearanceArea, StaticMap, World, area_clearing_robot

DEFAULT = ((0.05, 0.2), (0.5, 0.02))
"""Turn rates [rad/s] and periods [s] of the default run."""
SQUARE = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])


def reach(policy, turn_rate, period):
    """Time [s] and path [m] until an ideal unicycle begins to push a box 3 m behind it."""
    robot = replace(area_clearing_robot(), max_turn_rate=turn_rate)
    world = World(
        robot=robot,
        robot_pose=[1.5, 0.0, 0.0],
        static=StaticMap.build(bounds=(-9.0, -9.0, 9.0, 9.0)),
        movables=make_boxes([(-1.5, 0.2, 0.3)]),
        goal=ClearanceArea(4.0 * SQUARE, [True] * 4),
    )
    driven = 0.0
    for _ in range(round(400.0 / period)):
        if np.hypot(*(world.robot_pose - world.movables.poses[0])[:2]) < 1.5:
            return world.time, driven
        twist = policy.act(world, None)
        x, y, theta = world.robot_pose
        theta += 0.5 * period * twist.angular
        x += period * twist.linear * np.cos(theta)
        y += period * twist.linear * np.sin(theta)
        pose = [x, y, theta + 0.5 * period * twist.angular]
        world = world.moved(robot_pose=pose, time=world.time + period)
        driven += period * abs(twist.linear)
    return np.inf, driven


@pytest.mark.parametrize(
    ("turn_rate", "period"),
    [
        pytest.param(rate, period, marks=() if (rate, period) in DEFAULT else pytest.mark.slow)
        for rate in (0.05, 0.1, 0.5, 1.5)
        for period in (0.02, 0.2)
    ],
)
@pytest.mark.parametrize("policy", [GreedyPusher, Gtsp, GtspMpc])
def test_a_box_behind_the_robot_is_reached(policy, turn_rate, period):
    seconds, driven = reach(policy(), turn_rate, period)
    print(
        f"{policy.__name__}, {turn_rate} rad/s, every {period} s: {seconds:.1f} s, {driven:.1f} m"
    )
    assert driven < 5.0
    assert seconds < 30.0 + 5.0 / turn_rate
