"""The geometric pushing controller against the prediction of a push that it is part of."""

import math
from dataclasses import replace

import numpy as np
from conftest import make_boxes

from pushplan.planners.pushing import PushPath
from pushplan.planners.rearrangement import PushScene, RearrangementConfig
from pushplan.planners.rearrangement.push_controllers import GeometricPusher
from pushplan.planners.rearrangement.push_simulator import PushAttempt, simulate
from pushplan.planners.rearrangement.push_starts import initial_heading
from pushplan.world import (
    Controller,
    Movables,
    Receptacle,
    StaticMap,
    World,
    box_delivery_robot,
)

CORNER = Receptacle([(3.0, 3.0), (5.0, 3.0), (5.0, 5.0), (3.0, 5.0)])
PERIOD = 0.02


def driven(scene, push, controller, plan):
    """The robot's poses until the box is done, in the model of the prediction; the last world."""
    world, robots = scene.world.moved(robot_pose=push.start), [push.start]
    poses, out = np.array(world.movables.poses), np.empty((2, 1, 3))
    while not scene.are_done(poses).all():
        assert len(robots) < 4000
        twist = controller.command(world.moved(time=len(robots) * PERIOD), plan)
        assert controller.command(world.moved(time=len(robots) * PERIOD), plan) == twist
        pose, turn = np.array(world.robot_pose), twist.angular * PERIOD
        middle = pose[2] + 0.5 * turn
        move = twist.linear * PERIOD * np.array([math.cos(middle), math.sin(middle)])
        robots.append(np.array([*(pose[:2] + move), pose[2] + turn]))
        path = np.array(robots[-2:])
        assert scene.contacts().sweep(path, poses, out) < 0
        poses = out[-1].copy()
        world = world.moved(robot_pose=robots[-1], movable_poses=poses)
    return np.array(robots), world


def test_the_geometric_pusher_does_what_was_predicted():
    world = World(
        robot=box_delivery_robot(),
        robot_pose=(-3.0, -3.0, 0.0),
        static=StaticMap.build(bounds=(-5, -5, 5, 5)),
        movables=make_boxes([(-1.0, 0.5, 0.0)]),
        goal=CORNER,
    )
    scene = PushScene(world, RearrangementConfig())
    path = np.array([(-1.0, 0.5), (1.0, 0.5), (4.0, 4.0)])
    start = scene.starts.behind(0, initial_heading(path, 0.5 * scene.size), 0.0)
    [push] = simulate(scene, PushAttempt(start, 0, scene.longest, path))
    controller = GeometricPusher(scene.controller.with_gain(push.gain), push.shift)
    assert isinstance(controller, Controller)
    plan = PushPath.through(path).plan(world.robot, push.target)
    robots, last = driven(scene, push, controller, plan)
    for pose in robots:
        assert np.hypot(*(push.poses[:, :2] - pose[:2]).T).min() < 0.05 * scene.size
    assert np.abs(robots[-1] - push.end).max() < 0.1 * scene.size
    # once the box has gone it drives straight on
    twist = controller.command(replace(last, movables=Movables.empty(), time=999.0), plan)
    assert twist.linear > 0.0 and twist.angular == 0.0
    # for the next episode it begins afresh
    controller.reset(world)
    again, _ = driven(scene, push, controller, plan)
    assert np.array_equal(again, robots)
