"""The first pose of a plan at which the robot touches something static."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import make_robot

from pushplan.motion.polyline_plan import blocked_pose
from pushplan.world import GoalDisc, Movables, RobotModel, StaticMap, World

LONG = RobotModel.from_outline(
    [(-1.0, -0.2), (1.0, -0.2), (1.0, 0.2), (-1.0, 0.2)],
    mass=1.0,
    drive="differential",
    max_speed=1.0,
    max_turn_rate=1.0,
)
CORRIDOR = StaticMap.build(
    segments=[[0.0, 0.5, 9.0, 0.5], [0.0, -0.5, 9.0, -0.5]], radii=0.05, bounds=(0, -2, 9, 2)
)


def world(robot: RobotModel, static: StaticMap = CORRIDOR) -> World:
    return World(robot, (4.0, 0.0, 0.0), static, Movables.empty(), GoalDisc((8.0, 0.0), 0.3))


def test_headings_go_on_beyond_half_a_turn() -> None:
    """From just below pi to just above -pi the robot turns by little."""
    poses = np.array([(7.0, 0.0, np.pi - 0.05), (4.0, 0.0, -np.pi + 0.05), (2.0, 0.0, np.pi)])
    assert blocked_pose(world(LONG), poses) is None


def test_a_turn_on_the_spot_sweeps_the_walls() -> None:
    poses = np.array([(4.0, 0.0, 0.0), (4.0, 0.0, np.pi * 0.999)])
    at = blocked_pose(world(LONG), poses)
    assert at is not None and 0.2 < at[2] < 0.6


@pytest.mark.parametrize("x", [3.0, 6.5])
def test_it_is_the_first_pose_that_touches(x: float) -> None:
    robot = make_robot()
    wall = StaticMap.build(segments=[[x, -1.0, x, 1.0]], radii=0.05, bounds=(0, -2, 9, 2))
    there = replace(world(robot, wall), robot_pose=(1.0, 0.0, 0.0))
    at = blocked_pose(there, np.array([(1.0, 0.0, 0.0), (8.0, 0.0, 0.0)]))
    nose = robot.vertices[:, 0].max()
    assert at is not None
    assert 0.0 <= at[0] + nose - (x - 0.05) <= 0.02 * robot.circumscribed_radius + 1e-9
