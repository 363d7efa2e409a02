"""Robots of other kinds: cars, discs, bodies of several parts, and origins off the centre."""

from __future__ import annotations

import math

import numpy as np
import pytest
from conftest import OCTAGON, make_robot, make_u_maze

from pushplan.control import MpcTracker, PathFollower, PurePursuit
from pushplan.geometry.transforms import arc_step
from pushplan.planners import PlanFollower, make_planner, make_policy
from pushplan.world import (
    Drive,
    InvalidInputError,
    MaxIterations,
    PlanStatus,
    Receptacle,
    RobotModel,
    Twist,
    World,
    load_world,
    save_world,
)

RADIUS = 1.5
ANGLES = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
DISC = 0.6 * np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
CAR = make_robot(
    drive=Drive.CAR,
    max_speed=0.6,
    max_turn_rate=1.0,
    min_turning_radius=RADIUS,
    max_acceleration=1.0,
)
FORKLIFT = {
    "parts": (
        [[0.0, -0.4], [0.7, -0.4], [0.7, 0.4], [0.0, 0.4]],
        [[0.7, 0.2], [1.1, 0.2], [1.1, 0.35], [0.7, 0.35]],
        [[0.7, -0.35], [1.1, -0.35], [1.1, -0.2], [0.7, -0.2]],
    ),
    "mass": 1.0,
    "max_speed": 0.6,
    "max_turn_rate": 1.0,
}
ROBOTS = {
    "car": CAR,
    "car that reverses": make_robot(
        drive=Drive.CAR,
        max_speed=0.6,
        min_speed=-0.3,
        max_turn_rate=1.0,
        min_turning_radius=RADIUS,
    ),
    "disc": RobotModel.from_outline(
        DISC, mass=1.0, drive=Drive.DIFFERENTIAL, max_speed=0.6, max_turn_rate=2.0
    ),
    "origin off the centre": RobotModel.from_outline(
        OCTAGON + np.array([0.35, 0.0]),
        mass=1.0,
        drive=Drive.DIFFERENTIAL,
        max_speed=0.6,
        max_turn_rate=1.0,
    ),
    "several parts": RobotModel(drive=Drive.DIFFERENTIAL, **FORKLIFT),
    "car of several parts": RobotModel(drive=Drive.CAR, min_turning_radius=RADIUS, **FORKLIFT),
}
PLANNERS = ("kinodynamic-rrt", "push-aware")
BOXES = [[11, 9, 0.3], [7.5, 12.3, 0.0]]


def drive(world: World, policy, seconds: float, period: float = 0.1) -> tuple[World, list[Twist]]:
    """An ideal robot, until it is at its goal or the time is over."""
    policy.reset(world, np.random.default_rng(0))
    twists = []
    while world.time < seconds and world.goal.distance(*world.robot_pose[:2]) > 0.0:
        twist = policy.act(world, None)
        pose = np.empty(3)
        arc_step(np.array(world.robot_pose), twist.linear * period, twist.angular * period, pose)
        velocity = [twist.linear * math.cos(pose[2]), twist.linear * math.sin(pose[2])]
        world = world.moved(
            robot_pose=pose, robot_twist=[*velocity, twist.angular], time=world.time + period
        )
        twists.append(twist)
    return world, twists


@pytest.mark.warm(*PLANNERS)
@pytest.mark.parametrize("name", PLANNERS)
@pytest.mark.parametrize("kind", ROBOTS)
def test_plans_for_every_kind_of_robot_keep_its_turning_radius(kind, name):
    robot = ROBOTS[kind]
    world = make_u_maze(BOXES, robot=robot)
    result = make_planner(name).plan(world, stop=MaxIterations(3000))
    assert result.status is PlanStatus.SOLVED
    plan = result.plan
    assert (plan.speeds <= robot.max_speed + 1e-9).all()
    assert (np.abs(plan.turn_rates) <= robot.max_turn_rate + 1e-9).all()
    if robot.drive is Drive.CAR:
        moving = plan.speeds > 1e-9
        curvature = np.abs(plan.turn_rates[moving]) / plan.speeds[moving]
        assert curvature.max() <= 1.0 / RADIUS + 1e-6


@pytest.mark.warm("push-aware")
def test_a_car_that_reverses_backs_off_from_a_wall_that_it_faces():
    """No forward path begins there."""
    world = make_u_maze([], robot=ROBOTS["car that reverses"])
    x = world.static.bounds[2] - 0.75
    world = world.moved(robot_pose=[x, 3.0, 0.0])
    plan = make_planner("push-aware").plan(world, stop=MaxIterations(2000))
    assert plan.plan is None
    policy = PlanFollower(make_planner("push-aware"), stop=MaxIterations(2000))
    world, twists = drive(world, policy, 120.0)
    assert min(twist.linear for twist in twists) < 0.0
    assert world.goal.distance(*world.robot_pose[:2]) == 0.0


@pytest.mark.warm("push-aware")
@pytest.mark.parametrize("controller", [PathFollower, PurePursuit, MpcTracker])
@pytest.mark.parametrize("kind", ["car", "car that reverses", "disc", "several parts"])
def test_controllers_bring_every_kind_of_robot_to_its_goal(kind, controller):
    robot = ROBOTS[kind]
    planner = make_planner("push-aware")
    policy = PlanFollower(planner, controller(), stop=MaxIterations(3000))
    world, twists = drive(make_u_maze(BOXES, robot=robot), policy, 200.0)
    assert world.goal.distance(*world.robot_pose[:2]) == 0.0
    for twist in twists:
        assert robot.min_speed - 1e-9 <= twist.linear <= robot.max_speed + 1e-9
        if robot.drive is Drive.CAR:
            assert abs(twist.angular) * RADIUS <= abs(twist.linear) + 1e-9


@pytest.mark.parametrize("controller", [PathFollower, PurePursuit, MpcTracker])
def test_a_car_that_faces_away_from_its_path_drives_round_to_it(controller):
    """It cannot turn on the spot, so it must not stand and wait for that."""
    room = make_u_maze(robot=CAR, robot_pose=[11.25, 3.75, np.pi / 2])
    plan = make_planner("push-aware").plan(room, stop=MaxIterations(3000)).plan
    follower, world = controller(), room.moved(robot_pose=[11.25, 6.0, -0.4])
    for _ in range(220):
        twist = follower.command(world, plan)
        pose = np.empty(3)
        arc_step(np.array(world.robot_pose), 0.1 * twist.linear, 0.1 * twist.angular, pose)
        world = world.moved(robot_pose=pose, time=world.time + 0.1)
    nearest = np.hypot(*(plan.poses[:, :2] - world.robot_pose[:2]).T).argmin()
    error = math.remainder(world.robot_pose[2] - plan.poses[nearest, 2], math.tau)
    assert abs(error) < 0.5
    assert math.dist(plan.poses[nearest, :2], world.robot_pose[:2]) < 0.5


@pytest.mark.parametrize("name", ["greedy", "gtsp", "gtsp-mpc"])
def test_policies_that_turn_on_the_spot_refuse_a_car_in_one_line(name):
    goal = Receptacle([[12, 12], [15, 12], [15, 15], [12, 15]])
    world = make_u_maze(BOXES, robot=CAR, goal=goal)
    policy = make_policy(name)
    with pytest.raises(InvalidInputError, match="differential drive"):
        policy.reset(world, np.random.default_rng(0))
        policy.act(world, None)


@pytest.mark.parametrize(
    ("drive", "radius"), [("car", 0.0), ("car", -1.0), ("car", math.nan), ("differential", 1.0)]
)
def test_a_turning_radius_belongs_to_a_car(drive, radius):
    with pytest.raises(InvalidInputError, match="min_turning_radius"):
        make_robot(drive=drive, min_turning_radius=radius)


def test_a_car_survives_a_world_file(tmp_path):
    world = make_u_maze(robot=CAR)
    save_world(world, tmp_path / "car.yaml")
    assert load_world(tmp_path / "car.yaml").robot == CAR
