"""Robots that move sideways: plans checked by Shapely, closed loops, actions and commands."""

from __future__ import annotations

import math

import numpy as np
import pytest
from plan_checks import check_plan

from pushplan.control.limits import clamp_twist, ramp_twist
from pushplan.control.stopping import stopping_path
from pushplan.envs.making import make_env
from pushplan.envs.simulators.base import Materials, Solids
from pushplan.envs.simulators.mujoco_simulator import MujocoSimulator
from pushplan.envs.simulators.pymunk_simulator import PymunkSimulator
from pushplan.planners import make_planner, make_policy
from pushplan.world import (
    Drive,
    GoalDisc,
    GoalPose,
    MaxIterations,
    Movables,
    PlanStatus,
    StaticMap,
    Twist,
    World,
    jackal,
    load_world,
    save_world,
)

FAST = jackal(drive=Drive.OMNIDIRECTIONAL)
CAREFUL = jackal(
    drive=Drive.OMNIDIRECTIONAL, max_speed=1.0, max_acceleration=1.0, max_turn_acceleration=3.0
)
PLANNERS = ("straight", "kinodynamic-rrt", "push-aware")
SOLIDS = Solids(0.05, 0.1, 0.2, 0.05, wheel_radius=0.05)
SIMULATORS = (PymunkSimulator, MujocoSimulator)
POSE = GoalPose([8.0, 9.0], 0.05, -2.0, math.radians(5.0))
DISC = GoalDisc([8.0, 9.0], 0.3)
WALL = np.array([[4.5, 5.9], [12.0, 5.9], [12.0, 6.1], [4.5, 6.1]])


def hall(robot=FAST, goal=POSE, walls=(WALL,), **other):
    """A hall of 12 by 12 m with a wall in the middle and a goal behind it."""
    static = StaticMap.build(polygons=walls, bounds=[0, 0, 12, 12])
    parts = {"robot_pose": [8.0, 3.0, 0.3], "movables": Movables.empty()} | other
    return World(robot=robot, static=static, goal=goal, **parts)


def plan_of(world, planner, iterations=1000):
    result = make_planner(planner).plan(world, stop=MaxIterations(iterations))
    assert result.status is PlanStatus.SOLVED
    check_plan(world, result.plan, result.status)
    return result.plan


@pytest.mark.parametrize("goal", [POSE, DISC], ids=["pose", "disc"])
@pytest.mark.parametrize("robot", [FAST, CAREFUL], ids=["fast", "careful"])
@pytest.mark.parametrize("planner", PLANNERS)
def test_plans_keep_every_limit_and_turn_on_the_way(planner, robot, goal):
    world = hall(robot, goal)
    plan = plan_of(world, planner)
    assert goal.reached_by(plan.poses[-1])
    assert {stage.direction for stage in plan.stages} == {1}
    assert plan.length < 1.25 * math.hypot(3.5, 3.0) * 2.0
    moves = np.diff(plan.poses[:, :2], axis=0)
    bearings = np.arctan2(moves[:, 1], moves[:, 0]) - plan.poses[1:, 2]
    assert (np.abs(np.sin(bearings)) > 0.5).any()  # it goes sideways
    bodies = plan.speeds[:-1, None] * np.column_stack([np.cos(bearings), np.sin(bearings)])
    steps = np.diff(plan.times)
    change = np.linalg.norm(np.diff(bodies, axis=0), axis=1) / (0.5 * (steps[1:] + steps[:-1]))
    assert change.max() <= robot.max_acceleration * (1.0 + 1e-6)


@pytest.mark.parametrize("planner", PLANNERS)
def test_a_robot_beside_its_goal_slides_there_without_turning(planner):
    world = hall(robot_pose=[8.0, 8.0, 0.0], goal=GoalPose([8.0, 9.0], 0.02, 0.0, 0.05))
    plan = plan_of(world, planner)
    assert plan.length == pytest.approx(1.0, abs=0.03)
    assert np.abs(plan.poses[:, 2]).max() < 0.05


@pytest.mark.parametrize("planner", ["kinodynamic-rrt", "push-aware"])
def test_it_gets_out_of_a_slot_sideways(planner):
    """A slot with as little room ahead and behind that no other drive gets out."""
    slot = [
        [[7.60, 2.5], [7.70, 2.5], [7.70, 3.3], [7.60, 3.3]],
        [[8.30, 2.5], [8.40, 2.5], [8.40, 3.3], [8.30, 3.3]],
        [[7.60, 2.5], [8.40, 2.5], [8.40, 2.6], [7.60, 2.6]],
    ]
    world = hall(walls=[np.array(part) for part in slot], robot_pose=[8.0, 2.9, 0.0])
    plan_of(world, planner, 3000)
    other = hall(jackal(), walls=[np.array(part) for part in slot], robot_pose=[8.0, 2.9, 0.0])
    result = make_planner(planner).plan(other, stop=MaxIterations(3000))
    assert not result.status.has_plan


def test_what_it_slides_into_is_predicted_to_move():
    box = Movables.from_outlines(
        [[[0.2, 0.2], [-0.2, 0.2], [-0.2, -0.2], [0.2, -0.2]]], [[8, 7, 0]]
    )
    walls = [np.array([[x, 5.0], [x + 0.1, 5.0], [x + 0.1, 12.0], [x, 12.0]]) for x in (7.3, 8.6)]
    world = hall(
        walls=walls, movables=box, robot_pose=[8.0, 5.5, 0.0], goal=GoalDisc([8, 8.5], 0.3)
    )
    plan = plan_of(world, "kinodynamic-rrt", 2000)
    assert plan.interaction_cost > 0.0
    assert not np.allclose(plan.object_poses[-1], plan.object_poses[0])


@pytest.mark.parametrize("policy", ["straight", "kinodynamic-rrt"])
@pytest.mark.parametrize("robot", [FAST, CAREFUL], ids=["fast", "careful"])
@pytest.mark.parametrize("simulator", SIMULATORS, ids=lambda s: s.name)
def test_closed_loops_arrive_within_every_limit(simulator, robot, policy):
    world = hall(robot)
    engine = simulator()
    engine.build(world, Materials(solids=SOLIDS))
    driver = make_policy(policy)
    if policy != "straight":
        driver.stop = MaxIterations(1000)
    driver.reset(engine.world(), np.random.default_rng(0))
    last = Twist(0.0, 0.0)
    aside = 0.0
    while not engine.world().goal_reached and engine.world().time < 60.0:
        twist = driver.act(engine.world(), None)
        assert math.hypot(twist.linear, twist.lateral) <= robot.max_speed + 1e-9
        jump = math.hypot(twist.linear - last.linear, twist.lateral - last.lateral)
        assert jump <= 0.1 * robot.max_acceleration + 1e-9
        aside = max(aside, abs(twist.lateral))
        engine.step(twist, 0.1)
        assert not engine.held
        last = twist
    assert engine.world().goal_reached
    assert aside > 0.5
    assert len(driver.plan_log) <= 3


@pytest.mark.parametrize("simulator", SIMULATORS, ids=lambda s: s.name)
def test_a_sideways_velocity_pushes_a_box_sideways(simulator):
    box = Movables.from_outlines(
        [[[0.2, 0.2], [-0.2, 0.2], [-0.2, -0.2], [0.2, -0.2]]], [[8.0, 3.6, 0.0]], masses=[0.5]
    )
    engine = simulator()
    world = hall(movables=box, robot_pose=[8.0, 3.0, 0.0])
    engine.build(world, Materials(solids=SOLIDS))
    for _ in range(20):
        engine.step(Twist(0.0, 0.0, 0.3), 0.1)
    after = engine.world()
    assert after.robot_pose == pytest.approx([8.0, 3.6, 0.0], abs=0.03)
    assert after.movables.poses[0, 1] == pytest.approx(3.6 + 0.6 - 0.185, abs=0.05)
    assert after.movables.poses[0, 0] == pytest.approx(8.0, abs=0.03)


def test_turning_while_it_slides_follows_an_arc_exactly():
    engine = PymunkSimulator()
    engine.build(hall(robot_pose=[6.0, 3.0, 0.0]), Materials())
    for _ in range(10):
        engine.step(Twist(0.3, 0.5, 0.4), 0.1)
    steps = np.linspace(0.0, 1.0, 20001)
    middle = 0.5 * (steps[1:] + steps[:-1])
    velocity = (0.3 + 0.4j) * np.exp(0.5j * middle)
    place = 6.0 + 3.0j + velocity.mean()
    assert engine.robot_pose == pytest.approx([place.real, place.imag, 0.5], abs=1e-6)


def test_commands_keep_their_direction_and_the_acceleration():
    twist = clamp_twist(FAST, 3.0, 9.0, 4.0)
    assert (twist.linear, twist.lateral) == pytest.approx((1.2, 1.6))
    assert twist.angular == FAST.max_turn_rate
    assert clamp_twist(jackal(), 1.0, 0.0, 1.0).lateral == 0.0
    step = ramp_twist(CAREFUL, Twist(0.0, 0.0, 0.3), 0.0, 0.0, 0.1, -1.0)
    assert step.lateral == pytest.approx(0.2)
    path = stopping_path(CAREFUL, np.zeros(3), Twist(0.0, 0.0, 0.5), 0.1, 0.05)
    assert path[-1, 1] == pytest.approx(0.5 * 0.1 + 0.5 * 0.5**2, abs=0.02)
    assert np.abs(path[:, 0]).max() < 1e-9


def test_an_environment_takes_three_numbers():
    env = make_env(task="maze", action="omnidirectional")
    env.reset(seed=0)
    before = env.unwrapped.world
    assert before.robot.drive is Drive.OMNIDIRECTIONAL
    env.step(np.array([0.0, 1.0, 0.0], np.float32))
    moved = env.unwrapped.world.robot_pose - before.robot_pose
    theta = before.robot_pose[2]
    left = moved[:2] @ [-math.sin(theta), math.cos(theta)]
    assert left == pytest.approx(np.hypot(*moved[:2]), rel=1e-6) and left > 0.0


def test_world_files_keep_the_drive(tmp_path):
    save_world(hall(), tmp_path / "world.yaml")
    assert load_world(tmp_path / "world.yaml").robot == FAST
