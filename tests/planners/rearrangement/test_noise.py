"""`gtsp-mpc` sees poses with noise: it keeps to its push, and to what it has delivered."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pushplan.geometry.transforms import arc_step
from pushplan.planners.rearrangement import GtspMpc, RearrangementConfig
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.runtime import Disturbances, DisturbedPolicy
from pushplan.world import ClearanceArea, Movables, StaticMap, World, turtlebot3_burger

PERIOD = 0.05
NOISES = [(0.01, 1.5), (0.02, 3.0), (0.03, 5.0)]
SQUARE = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
ROOM = World(
    robot=turtlebot3_burger(),
    robot_pose=[0.35, -0.25, 2.0],
    static=StaticMap.build(bounds=(-1.5, -1.5, 1.5, 1.5)),
    movables=Movables.from_outlines([0.045 * SQUARE], np.array([[0.1, 0.1, 0.3]])),
    goal=ClearanceArea(0.5 * SQUARE, [True] * 4),
)


def approaches(position: float, degrees: float, seed: int) -> tuple[int, float]:
    """Pushes taken up until the first one begins, and the length of the way to it [m]."""
    noise = Disturbances(position_noise=position, heading_noise=math.radians(degrees))
    policy = DisturbedPolicy(GtspMpc(), noise, period=PERIOD)
    policy.reset(ROOM, np.random.default_rng(seed))
    world = ROOM
    taken_up = 0
    shown = None
    driven = 0.0
    touching = 0.045 + float(world.robot.vertices[:, 0].max())
    while math.dist(world.robot_pose[:2], world.movables.poses[0, :2]) > touching:
        assert world.time < 60.0
        twist = policy.act(world)
        plan = policy.runner.policy.current_plan
        taken_up += plan is not None and shown is None
        shown = plan
        pose = np.empty(3)
        arc_step(np.array(world.robot_pose), twist.linear * PERIOD, twist.angular * PERIOD, pose)
        world = world.moved(robot_pose=pose, time=world.time + PERIOD)
        driven += abs(twist.linear) * PERIOD
    return taken_up, driven


@pytest.mark.parametrize(
    ("position", "degrees"),
    [*NOISES[:1], *(pytest.param(*noise, marks=pytest.mark.slow) for noise in NOISES[1:])],
)
def test_a_box_that_stands_still_is_approached_once(position, degrees):
    _, exact = approaches(0.0, 0.0, 0)
    for seed in range(4):
        taken_up, driven = approaches(position, degrees, seed)
        assert taken_up == 1
        assert driven < 1.15 * exact


def at_edge(beyond, noise, delivered=()):
    """A box whose corners are all beyond the edge of the area by a distance [m]."""
    movables = ROOM.movables.moved_to(np.array([[0.545 + beyond, 0.0, 0.0]]))
    config = RearrangementConfig(position_noise=noise)
    return PushScene(replace(ROOM, movables=movables), config, delivered=np.array(delivered, int))


@settings(max_examples=30, deadline=None)
@given(st.floats(0.001, 0.02), st.floats(0.0, 0.999))
def test_a_delivered_box_stays_so_while_noise_explains_what_is_seen(noise, part):
    slack = 0.012 * ROOM.robot.circumscribed_radius + 1e-6
    assert at_edge(slack + 2.0 * noise, noise).done.all()
    between = slack + 2.0 * noise * part
    assert not at_edge(between, noise).done.any()
    assert at_edge(between, noise, delivered=[0]).done.all()
    assert not at_edge(-0.001, noise, delivered=[0]).done.any()


def test_a_delivered_box_that_is_seen_clearly_inside_is_pushed_again():
    policy = GtspMpc()
    policy.reset(ROOM, np.random.default_rng(0))
    policy.expect_noise(0.01, 0.02)
    world = at_edge(0.03, 0.01).world
    still = policy.act(world)
    assert still.linear == still.angular == 0.0
    within = at_edge(0.01, 0.01).world.moved(time=PERIOD)
    still = policy.act(within)
    assert still.linear == still.angular == 0.0
    again = policy.act(at_edge(-0.01, 0.01).world.moved(time=2.0 * PERIOD))
    assert again.linear or again.angular
