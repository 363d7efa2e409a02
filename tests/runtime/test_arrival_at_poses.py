"""`Runner` brings a robot to rest at a pose: both tolerances, with noise and without."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pushplan.control import ImmediateExecutor
from pushplan.core import geometry
from pushplan.runtime import CommandStatus, Runner
from pushplan.world import GoalPose, MaxIterations, Movables, RobotModel, StaticMap, World

PERIOD = 0.05
OUTLINE = [[0.25, 0.2], [-0.25, 0.2], [-0.25, -0.2], [0.25, -0.2]]
WALL = np.array([[2.0, 2.4], [5.0, 2.4], [5.0, 2.6], [2.0, 2.6]])
GOAL = GoalPose([4.0, 3.5], 0.02, 2.0, math.radians(3.0))


def scene(drive, **limits):
    given = {"mass": 10.0, "max_speed": 0.5, "max_turn_rate": 1.5, **limits}
    robot = RobotModel.from_outline(OUTLINE, drive=drive, **given)
    static = StaticMap.build(polygons=[WALL], bounds=[0, 0, 5, 5])
    return World(robot, [4.0, 1.0, 0.3], static, Movables.empty(), GOAL)


def rest(world, name, noise=(0.0, 0.0), seconds=60.0):
    """The pose at which the robot comes to rest after the runner has said that it is done."""
    rng = np.random.default_rng(0)
    true = world
    options = {"position_noise": noise[0], "heading_noise": noise[1]}
    stop = MaxIterations(200)
    with Runner(
        name, period=PERIOD, plan_stop=stop, executor=ImmediateExecutor(), **options
    ) as runner:
        command = runner.start(world)
        while command.status is not CommandStatus.DONE or command.twist.linear:
            assert true.time < seconds, command
            drive = command.twist
            pose = geometry.arc_step(true.robot_pose, drive.linear * PERIOD, drive.angular * PERIOD)
            heading = pose[2]
            twist = [drive.linear * np.cos(heading), drive.linear * np.sin(heading), drive.angular]
            true = true.moved(robot_pose=pose, robot_twist=twist, time=true.time + PERIOD)
            seen = pose + rng.normal(size=3) * [noise[0], noise[0], noise[1]]
            runner.update(true.moved(robot_pose=seen))
            command = runner.command(true.time)
    return true


@pytest.mark.slow
@pytest.mark.parametrize("noise", [(0.0, 0.0), (0.005, 0.01)])
@pytest.mark.parametrize(
    ("drive", "limits"),
    [
        ("differential", {}),
        ("differential", {"max_acceleration": 1.0, "max_turn_acceleration": 3.0}),
        ("car", {"min_turning_radius": 0.5, "max_acceleration": 1.0}),
    ],
)
def test_it_comes_to_rest_at_the_pose(drive, limits, noise):
    assert rest(scene(drive, **limits), "kinodynamic-rrt", noise).goal_reached


def test_the_shortest_path_ends_at_the_pose_too():
    assert rest(scene("differential"), "straight").goal_reached


def test_the_place_alone_is_not_the_goal():
    world = scene("differential").moved(robot_pose=[4.0, 3.5, 1.9])
    with Runner("straight", period=PERIOD, executor=ImmediateExecutor()) as runner:
        command = runner.start(world)
        assert command.status is CommandStatus.DRIVING
        assert command.twist.linear == 0.0 < command.twist.angular
        assert runner.start(world.moved(robot_pose=[4.0, 3.5, 2.0])).status is CommandStatus.DONE
