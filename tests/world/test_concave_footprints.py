"""Robots whose footprint is not convex: a fork that holds a box between its tines."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from pushplan.envs.simulators.base import Materials, Solids
from pushplan.envs.simulators.mujoco_simulator import MujocoSimulator
from pushplan.envs.simulators.pymunk_simulator import PymunkSimulator
from pushplan.planners import make_planner
from pushplan.world import (
    FirstSolution,
    GoalDisc,
    InvalidInputError,
    MaxIterations,
    Movables,
    PlanStatus,
    RobotModel,
    StaticMap,
    Twist,
    World,
    load_world,
    save_world,
)
from pushplan.world.outline import transform

FORK = [
    [-0.3, -0.3], [0.6, -0.3], [0.6, -0.2], [0.1, -0.2],
    [0.1, 0.2], [0.6, 0.2], [0.6, 0.3], [-0.3, 0.3],
]  # fmt: skip
LIMITS = {"mass": 5.0, "drive": "differential", "max_speed": 0.5, "max_turn_rate": 1.5}
ROBOT = RobotModel.from_outline(FORK, wheel_separation=0.4, **LIMITS)
BOX = [[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]]


def between_tines(**other):
    parts = {
        "robot_pose": [2.0, 3.0, 0.0],
        "static": StaticMap.build(bounds=[0, 0, 8, 6]),
        "movables": Movables.from_outlines([BOX], [[2.35, 3.0, 0.0]], masses=[0.5]),
        "goal": GoalDisc([6.0, 3.0], 0.2),
    }
    return World(robot=ROBOT, **parts | other)


def test_a_concave_outline_becomes_a_union_of_convex_parts():
    union = shapely.union_all([shapely.Polygon(part) for part in ROBOT.parts])
    given = shapely.Polygon(FORK)
    assert len(ROBOT.parts) > 1
    assert union.symmetric_difference(given).area < 1e-9 * given.area
    again = RobotModel(ROBOT.parts, wheel_separation=0.4, **LIMITS)
    assert again == ROBOT


def test_wheels_count_by_their_pieces():
    body = [[-0.2, -0.2], [0.2, -0.2], [0.2, 0.2], [-0.2, 0.2]]
    robot = RobotModel((body, FORK), wheel_parts=1, **LIMITS)
    assert robot.wheel_parts == len(robot.parts) - 1
    assert np.array_equal(robot.wall_parts[0], robot.parts[0])


def test_an_outline_without_area_is_an_error():
    with pytest.raises(InvalidInputError, match=r"robot.parts\[0\]"):
        RobotModel.from_outline([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]], **LIMITS)


def test_files_keep_the_parts(tmp_path):
    save_world(between_tines(), tmp_path / "fork.yaml")
    assert load_world(tmp_path / "fork.yaml").robot == ROBOT


@pytest.mark.parametrize("simulator", [PymunkSimulator, MujocoSimulator], ids=lambda s: s.name)
def test_a_box_between_the_tines_is_not_moved_until_the_fork_reaches_it(simulator):
    engine = simulator()
    solids = Solids(0.1, 0.2, 0.3, 0.15, wheel_radius=0.05)
    engine.build(between_tines(), Materials(solids=solids))
    engine.step(Twist(0.1, 0.0), 1.0)
    assert engine.world().movables.poses[0] == pytest.approx([2.35, 3.0, 0.0], abs=2e-3)
    for _ in range(4):
        engine.step(Twist(0.2, 0.0), 1.0)
    after = engine.world()
    gap = after.movables.poses[0, 0] - after.robot_pose[0]
    assert gap == pytest.approx(0.2, abs=0.03)


def test_plans_drive_a_peg_between_the_tines_and_touch_nothing():
    peg = np.array([[5.75, 2.9], [5.95, 2.9], [5.95, 3.1], [5.75, 3.1]])
    static = StaticMap.build(polygons=[peg], bounds=[0, 0, 8, 6])
    goal = GoalDisc([5.45, 3.0], 0.04)
    world = between_tines(static=static, goal=goal, movables=Movables.empty())
    rule = FirstSolution() | MaxIterations(60_000)
    result = make_planner("kinodynamic-rrt").plan(world, stop=rule)
    assert result.status is PlanStatus.SOLVED
    wall = shapely.Polygon(peg)
    poses = result.plan.poses
    hulls = [shapely.Polygon(transform(pose, np.array(FORK))) for pose in poses]
    assert not shapely.intersects(wall, hulls).any()
    assert shapely.intersects(wall, shapely.convex_hull(hulls[-1]))
