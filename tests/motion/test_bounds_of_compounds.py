"""Lower bounds on work stay below what a push of objects with a hollow middle costs."""

from __future__ import annotations

import numpy as np
from conftest import make_robot, make_u_maze

from pushplan.motion.work_bound import transport_bound, work_bound
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.world import ClearanceArea, GoalDisc, Movables, Receptacle, StaticMap

OPEN = StaticMap.build(bounds=[-20, -20, 20, 20])


def square(x: float, y: float, side: float = 0.2) -> list[list[float]]:
    return [[x, y], [x + side, y], [x + side, y + side], [x, y + side]]


def test_a_robot_may_drive_out_from_under_a_table():
    legs = [square(x, y) for x in (-2.0, 1.8) for y in (-2.0, 1.8)]
    table = Movables.from_outlines([legs], [[0, 0, 0]], masses=[50.0])
    world = make_u_maze(
        movables=table, static=OPEN, robot_pose=[0, 0, 0], goal=GoalDisc([5.0, 0.0], 1.05)
    )
    assert work_bound(world).work <= 3.95 + 1e-6
    assert work_bound(world).relaxed <= 3.95 + 1e-6


def test_a_gate_may_be_delivered_past_a_wall_that_its_middle_is_behind():
    posts = [square(-0.1, 1.7), square(-0.1, -1.9)]
    gate = Movables.from_outlines([posts], [[-0.7, 0, 0]], masses=[1000.0])
    wall = [[-0.5, -1.5], [-0.3, -1.5], [-0.3, 1.5], [-0.5, 1.5]]
    world = make_u_maze(
        movables=gate,
        static=StaticMap.build([wall], bounds=[-20, -20, 20, 20]),
        robot_pose=[-5, 0, 0],
        goal=Receptacle([[-0.2, -2], [3, -2], [3, 2], [-0.2, 2]]),
    )
    assert transport_bound(world) <= 1000.0 * 0.61 + world.robot.mass * 10.0


def test_planners_and_worlds_agree_on_what_has_left_an_area():
    bars = [
        [[-1, -1], [1, -1], [1, -0.8], [-1, -0.8]],
        [[-1, -0.8], [-0.8, -0.8], [-0.8, 1], [-1, 1]],
    ]
    around = Movables.from_polygons([bars])
    corner = ClearanceArea([[-0.7, -0.7], [4, -0.7], [4, 4], [-0.7, 4]], [True] * 4)
    robot = make_robot(drive="differential")
    world = make_u_maze(
        movables=around, static=OPEN, robot=robot, robot_pose=[-9, -9, 0], goal=corner
    )
    assert world.completed.tolist() == [True]
    moved = world.moved(movable_poses=world.movables.poses + np.array([0.3, 0.3, 0.0]))
    assert moved.completed.tolist() == [False]
    for there, done in ((world, True), (moved, False)):
        scene = PushScene(there, RearrangementConfig())
        assert scene.are_done(there.movables.poses).tolist() == [done]
