"""Robots of other kinds: cars, discs, bodies of several parts, and origins off the centre."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from conftest import OCTAGON, make_robot, make_u_maze
from plan_checks import check_plan

from pushplan.control import MpcTracker, PathFollower, Progress, PurePursuit
from pushplan.geometry.transforms import arc_step
from pushplan.planners import PlanFollower, make_planner, make_policy
from pushplan.runtime.disturbed_policy import Disturbances, DisturbedPolicy
from pushplan.world import (
    Drive,
    InvalidInputError,
    MaxIterations,
    Plan,
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


def test_a_car_that_reverses_backs_off_from_a_wall_that_it_overlaps():
    """No plan begins there."""
    world = make_u_maze([], robot=ROBOTS["car that reverses"])
    x = world.static.bounds[2] - 0.75
    world = world.moved(robot_pose=[x, 3.0, 0.0])
    plan = make_planner("push-aware").plan(world, stop=MaxIterations(2000))
    assert plan.status is PlanStatus.START_BLOCKED
    policy = PlanFollower(make_planner("push-aware"), stop=MaxIterations(2000))
    world, twists = drive(world, policy, 120.0)
    assert min(twist.linear for twist in twists) < 0.0
    assert world.goal.distance(*world.robot_pose[:2]) == 0.0


FACING_A_WALL = [13.785, 3.0, 0.0]
"""Nose a centimetre and a half before a wall of the maze, the goal beyond the wall behind it."""
NEAR_A_WALL = [13.895, 3.0, 0.0]
"""The same of the disc."""


def test_a_plan_is_driven_in_stages_ahead_back_and_on_the_spot():
    plan = Plan(
        times=np.arange(7.0),
        poses=np.array(
            [[0.0, 0, 0], [0, 0, 1], [0, 0, 2], [1, 0, 2], [2, 0, 2], [1, 0, 2], [0, 0, 2]]
        ),
        speeds=np.array([0.0, 0.0, 1.0, 1.0, -1.0, -1.0, -1.0]),
        turn_rates=np.array([1.0, 1.0, 0, 0, 0, 0, 0]),
        travel_cost=4.0,
    )
    assert plan.stages == ((0, 2, 0), (2, 4, 1), (4, 6, -1))
    progress = Progress(window=2.0)
    places = [(0, 0, 0.5), (0, 0, 2), (1, 0.1, 2), (2, 0, 2), (1.5, 0, 2), (0, 0, 2)]
    along = [progress.update(plan, np.array(pose)) for pose in places[:1]]
    assert (progress.time, progress.index(0.0)) == (pytest.approx(0.5), 0)
    along += [progress.update(plan, np.array(pose)) for pose in places[1:]]
    assert along == pytest.approx([0.0, 0.0, 1.0, 2.0, 2.5, 4.0])
    assert progress.index(along[-1]) == 6


@pytest.mark.parametrize("name", PLANNERS)
def test_a_robot_that_faces_a_wall_plans_to_turn_on_the_spot_first(name):
    """No arc leads on from there; the corners of the robot push the box beside it."""
    robot = make_robot(drive=Drive.DIFFERENTIAL)
    world = make_u_maze([[13.5, 4.13, 0.0]], robot=robot, robot_pose=[13.55, 3.0, 0.0])
    result = make_planner(name).plan(world, stop=MaxIterations(6000))
    assert result.status is PlanStatus.SOLVED
    plan = result.plan
    check_plan(world, plan, result.status)
    assert [stage.direction for stage in plan.stages] == [0, 1]
    end = plan.stages[0].last
    assert abs(plan.poses[end, 2]) > 1.0
    assert plan.times[end] >= abs(plan.poses[end, 2]) / robot.max_turn_rate
    assert np.abs(plan.object_poses[end] - world.movables.poses).max() > 1e-3
    swept = make_planner(name).interaction.sweep(world, plan.poses)
    assert swept.work == pytest.approx(plan.interaction_cost, rel=1e-3)


def test_a_robot_that_faces_away_turns_on_the_spot_rather_than_driving_round():
    robot = make_robot(drive=Drive.DIFFERENTIAL)
    world = make_u_maze([], robot=robot, robot_pose=[11.25, 3.75, -np.pi / 2])
    ahead = world.moved(robot_pose=[11.25, 3.75, np.pi / 2])
    costs = []
    for start in (world, ahead):
        result = make_planner("push-aware").plan(start, stop=MaxIterations(6000))
        check_plan(start, result.plan, result.status)
        costs.append(result.stats.detail["cost"])
    assert max(costs) < 1.02 * min(costs)


@pytest.mark.parametrize("name", PLANNERS)
def test_a_car_that_faces_a_wall_plans_to_reverse_where_it_can(name):
    car = ROBOTS["car that reverses"]
    world = make_u_maze(BOXES, robot=car, robot_pose=FACING_A_WALL)
    result = make_planner(name).plan(world, stop=MaxIterations(6000))
    assert result.status is PlanStatus.SOLVED
    plan = result.plan
    check_plan(world, plan, result.status)
    assert {stage.direction for stage in plan.stages} == {1, -1}
    assert plan.speeds.min() == pytest.approx(car.min_speed)
    assert np.abs(plan.turn_rates / plan.speeds).max() <= 1.0 / RADIUS + 1e-6
    blocked = make_planner(name).plan(replace(world, robot=CAR), stop=MaxIterations(6000))
    assert blocked.status is PlanStatus.START_BLOCKED
    assert "no room ahead" in blocked.status.remedy


@pytest.mark.parametrize(
    ("kind", "pose", "controller"),
    [
        ("disc", NEAR_A_WALL, PathFollower),
        ("car that reverses", FACING_A_WALL, MpcTracker),
        *(
            pytest.param("disc", NEAR_A_WALL, one, marks=pytest.mark.slow)
            for one in (PurePursuit, MpcTracker)
        ),
        *(
            pytest.param("car that reverses", FACING_A_WALL, one, marks=pytest.mark.slow)
            for one in (PathFollower, PurePursuit)
        ),
    ],
)
def test_turns_on_the_spot_and_reverse_arcs_are_driven_to_the_goal(kind, pose, controller):
    robot = replace(ROBOTS[kind], max_acceleration=1.0, max_turn_acceleration=4.0)
    world = make_u_maze([], robot=robot, robot_pose=pose)
    policy = PlanFollower(make_planner("kinodynamic-rrt"), controller(), stop=MaxIterations(4000))
    end, twists = drive(world, policy, 120.0)
    assert world.goal.distance(*end.robot_pose[:2]) == 0.0
    (result,) = policy.plan_log
    assert end.time < 1.2 * result.plan.duration
    first = twists[2]
    assert first.linear < 0.0 if robot.drive is Drive.CAR else first == Twist(0.0, first.angular)


@pytest.mark.parametrize(
    ("kind", "controller"),
    [
        pytest.param(kind, one, marks=() if (n + k) % 3 == 0 else pytest.mark.slow)
        for n, kind in enumerate(["car", "car that reverses", "disc", "several parts"])
        for k, one in enumerate([PathFollower, PurePursuit, MpcTracker])
    ],
)
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


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "pose"), [("disc", NEAR_A_WALL), ("car that reverses", FACING_A_WALL)]
)
@pytest.mark.parametrize("name", PLANNERS)
def test_a_runner_turns_and_reverses_out_through_noise_and_delay(name, kind, pose):
    robot = replace(ROBOTS[kind], max_acceleration=1.0, max_turn_acceleration=4.0)
    noise = Disturbances(position_noise=0.01, heading_noise=math.radians(2.0), delay=0.1)
    world = make_u_maze(BOXES, robot=robot, robot_pose=pose)
    world, twists = drive(world, DisturbedPolicy(name, noise, period=0.1), 100.0)
    assert world.goal.distance(*world.robot_pose[:2]) == 0.0
    first = [twist for twist in twists if twist != Twist(0.0, 0.0)][3]
    assert first.linear < 0.0 or (first.linear == 0.0 and robot.drive is Drive.DIFFERENTIAL)


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
