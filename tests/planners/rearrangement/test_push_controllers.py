"""The pushing controllers of one push: both against the prediction that it was chosen by."""

import math

import numpy as np
import pytest
from conftest import make_boxes

from pushplan.interaction.kernels import sweep_path
from pushplan.planners.pushing import PushingConfig, PushingMpc, PushPath
from pushplan.planners.rearrangement import PushScene, RearrangementConfig
from pushplan.planners.rearrangement.geometric_pusher import GeometricPusher
from pushplan.planners.rearrangement.predicted_path import predicted_path
from pushplan.planners.rearrangement.push_poses import initial_heading, pose_behind
from pushplan.planners.rearrangement.push_simulator import PushSimulator
from pushplan.world import (
    Controller,
    InvalidInputError,
    Receptacle,
    StaticMap,
    Twist,
    World,
    box_delivery_robot,
)

CORNER = Receptacle([(3.0, 3.0), (5.0, 3.0), (5.0, 5.0), (3.0, 5.0)])
PERIOD = 0.2


@pytest.fixture(scope="module")
def curved():
    """A scene with one box, and a push of it with a corner."""
    world = World(
        robot=box_delivery_robot(),
        robot_pose=(-3.0, -3.0, 0.0),
        static=StaticMap.build(bounds=(-5, -5, 5, 5)),
        movables=make_boxes([(-1.0, 0.5, 0.0)]),
        goal=CORNER,
    )
    scene = PushScene(world, RearrangementConfig())
    path = np.array([(-1.0, 0.5), (2.0, 0.5), (3.8, 3.8), (4.2, 4.5)])
    start = pose_behind(scene, 0, initial_heading(path, 0.5 * scene.size), 0.0)
    [push] = PushSimulator(scene).simulate(start, 0, path=path)
    return scene, push


def driven(scene, push, controller, plan):
    """Where the box gets to in the model of the prediction, and where it is at each step."""
    world, boxes = scene.world.moved(robot_pose=push.start), []
    poses, out = np.array(world.movables.poses), np.empty((2, 1, 3))
    for i in range(400):
        twist = controller.command(world.moved(time=i * PERIOD), plan)
        pose = np.array(world.robot_pose)
        turn, middle = twist.angular * PERIOD, pose[2] + 0.5 * twist.angular * PERIOD
        move = twist.linear * PERIOD * np.array([math.cos(middle), math.sin(middle)])
        path = np.array([pose, [*(pose[:2] + move), pose[2] + turn]])
        assert sweep_path(path, poses, scene.bodies, scene.settings, out) < 0
        poses = out[-1].copy()
        boxes.append(poses[0])
        world = world.moved(robot_pose=path[-1], movable_poses=poses)
        if CORNER.contains(world.movables.outline_world(0)):
            break
    return np.array(boxes), world


def test_the_predicted_path_ends_where_the_push_does_and_goes_on(curved):
    scene, push = curved
    path, offsets = predicted_path(scene, push)
    assert offsets.shape == (len(path.poses),)
    assert path.poses[0, :2] == pytest.approx([-1.0, 0.5], abs=1e-9)
    assert path.poses[-3, :2] == pytest.approx(push.object_poses[0, :2], abs=1e-6)
    assert np.hypot(*(path.poses[-1] - path.poses[-3])[:2]) == pytest.approx(scene.size)
    assert np.abs(offsets).max() < scene.half
    steps = np.hypot(*np.diff(path.poses[:-2, :2], axis=0).T)
    assert steps == pytest.approx(0.2 * scene.size, rel=0.2)


def test_the_geometric_pusher_does_what_was_predicted(curved):
    scene, push = curved
    controller = GeometricPusher(scene.controller._replace(gain=push.gain), push.shift)
    assert isinstance(controller, Controller)
    plan = PushPath.through(push.object_path).plan(scene.world.robot, push.target)
    boxes, world = driven(scene, push, controller, plan)
    path, _ = predicted_path(scene, push)
    away = [path.nearest(box[:2])[1] for box in boxes]
    assert max(away) < 0.1 * scene.size and np.hypot(*(boxes[-1] - push.object_poses[0])[:2]) < 0.2
    # once the box has gone it drives straight on; for the next episode it begins afresh
    gone = world.movables.subset([]) if hasattr(world.movables, "subset") else make_boxes([])
    later = World(world.robot, world.robot_pose, world.static, gone, CORNER, time=999.0)
    twist = controller.command(later, plan)
    assert twist.linear > 0.0 and twist.angular == 0.0
    controller.reset(world)
    again, _ = driven(scene, push, controller, plan)
    assert np.array_equal(again, boxes)


def test_the_predictive_one_keeps_to_the_prediction(curved):
    scene, push = curved
    path, offsets = predicted_path(scene, push)
    plan = path.plan(scene.world.robot, push.target)
    controller = PushingMpc(PushingConfig(period=PERIOD, offset=1.0), offsets)
    boxes, world = driven(scene, push, controller, plan)
    assert max(path.nearest(box[:2])[1] for box in boxes) < 0.1 * scene.size
    assert CORNER.contains(world.movables.outline_world(0))
    with pytest.raises(InvalidInputError, match="offsets"):
        PushingMpc(offsets=offsets[:-1]).command(scene.world, plan)
    assert PushingMpc(offsets=offsets).command(scene.world, plan) != Twist(0.0, 0.0)
