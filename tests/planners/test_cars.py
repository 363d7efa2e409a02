"""Cars with and without reverse: plans to poses, checked by Shapely, and driven in simulators."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from plan_checks import check_plan

from pushplan.envs.action_modes import VelocityAction
from pushplan.envs.simulators.base import Materials, Solids
from pushplan.envs.simulators.mujoco_simulator import MujocoSimulator
from pushplan.envs.simulators.pymunk_simulator import PymunkSimulator
from pushplan.planners import make_planner, make_policy
from pushplan.world import (
    GoalPose,
    MaxIterations,
    Movables,
    PlanStatus,
    StaticMap,
    World,
    racecar,
)

CARS = {"forward": racecar(min_speed=0.0), "reversing": racecar()}
PLANNERS = ("straight", "kinodynamic-rrt", "push-aware")
SOLIDS = Solids(0.05, 0.1, 0.2, 0.05, wheel_radius=0.05)
BEHIND = math.pi, -2.0, 0.4  # headings of goals
SIMULATORS = (PymunkSimulator, MujocoSimulator)


def hall(robot, heading, movables=None, **other):
    """A hall of 12 by 12 m with a wall in the middle and a pose behind it."""
    wall = np.array([[4.5, 5.9], [12.0, 5.9], [12.0, 6.1], [4.5, 6.1]])
    goal = GoalPose([8.0, 9.0], 0.05, heading, math.radians(5.0))
    static = StaticMap.build(polygons=[wall], bounds=[0, 0, 12, 12])
    return World(robot, [8.0, 3.0, 0.3], static, movables or Movables.empty(), goal)


@pytest.mark.slow
@pytest.mark.parametrize("heading", BEHIND)
@pytest.mark.parametrize("kind", CARS)
@pytest.mark.parametrize("planner", PLANNERS)
def test_plans_end_at_the_pose_and_keep_every_limit(planner, kind, heading):
    world = hall(CARS[kind], heading)
    result = make_planner(planner).plan(world, stop=MaxIterations(3000))
    assert result.status is PlanStatus.SOLVED
    plan = result.plan
    check_plan(world, plan, result.status)
    assert world.goal.reached_by(plan.poses[-1])
    assert np.abs(plan.turn_rates / plan.speeds).max() <= 1.0 / 1.009 + 1e-9
    if kind == "forward":
        assert plan.speeds.min() > 0.0


@pytest.mark.parametrize("planner", PLANNERS)
def test_a_car_beside_its_goal_reverses_where_it_may_and_comes_round_where_not(planner):
    lengths = {}
    for kind, car in CARS.items():
        world = hall(car, math.pi / 2.0)
        world = replace(world, robot_pose=np.array([8.4, 9.0, math.pi / 2.0]))
        result = make_planner(planner).plan(world, stop=MaxIterations(3000))
        assert result.status is PlanStatus.SOLVED
        check_plan(world, result.plan, result.status)
        lengths[kind] = result.plan.length
        assert bool(result.plan.speeds.min() < 0.0) is (kind == "reversing")
    assert lengths["reversing"] < 0.5 * lengths["forward"]


def test_straight_leads_a_car_through_objects_and_predicts_nothing():
    box = Movables.from_outlines(
        [[[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]]], [[3.0, 6.0, 0.0]]
    )
    plan = make_planner("straight").plan(hall(CARS["forward"], 0.4, box)).plan
    assert plan.object_poses is None
    assert np.array_equal(
        plan.poses, make_planner("straight").plan(hall(CARS["forward"], 0.4)).plan.poses
    )


@pytest.mark.parametrize("kind", CARS)
@pytest.mark.parametrize(
    ("simulator", "policy"),
    [
        pytest.param(
            simulator,
            policy,
            # each simulator and each policy once; the others take as long
            marks=()
            if (simulator.name == "mujoco") == (policy == "straight")
            else pytest.mark.slow,
        )
        for simulator in SIMULATORS
        for policy in ("straight", "kinodynamic-rrt")
    ],
)
def test_closed_loops_arrive_within_the_turning_radius(simulator, policy, kind):
    world = hall(CARS[kind], -2.0)
    engine = simulator()
    engine.build(world, Materials(solids=SOLIDS))
    driver = (
        make_policy(policy, stop=MaxIterations(1000))
        if policy != "straight"
        else make_policy(policy)
    )
    driver.reset(engine.world(), np.random.default_rng(0))
    arrived = False
    while not arrived and engine.world().time < 90.0:
        before = engine.world()
        twist = driver.act(before, None)
        assert abs(twist.angular) * 1.009 <= abs(twist.linear) + 1e-9
        assert twist.linear >= world.robot.min_speed
        engine.step(twist, 0.1)
        assert not engine.held
        after = engine.world()
        arrived = world.goal.reached_by(after.robot_pose)
        turned = abs(math.remainder(after.robot_pose[2] - before.robot_pose[2], math.tau))
        moved = math.dist(after.robot_pose[:2], before.robot_pose[:2])
        slip = 1e-9 if simulator is PymunkSimulator else 0.04  # its wheels lag where it stops
        assert 1.009 * turned <= 1.001 * moved + slip
    assert arrived


def test_commands_of_an_environment_keep_a_car_on_its_curve():
    class Task:
        robot = racecar()

    mode = VelocityAction(Task())
    twist, _ = mode.start(np.array([0.5, 1.0]), None)(np.zeros(3), 0.0, False)
    assert (twist.linear, twist.angular) == (0.18, pytest.approx(0.18 / 1.009))
    assert mode.start(np.array([0.0, 1.0]), None)(np.zeros(3), 0.0, False)[0].angular == 0.0
    back, _ = mode.start(np.array([-1.0, 1.0]), None)(np.zeros(3), 0.0, False)
    assert (back.linear, back.angular) == (-0.36, pytest.approx(0.36 / 1.009, abs=1e-3))
