"""What a robot drives that has nothing to drive yet."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from shapely import Point, affinity
from shapely.geometry import Polygon, box
from shapely.ops import unary_union

from pushplan.control import waiting_twist
from pushplan.world import Drive, GoalDisc, Movables, RobotModel, StaticMap, Twist, World

SQUARE = 0.5 * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
ROBOT = RobotModel.from_outline(
    SQUARE, mass=1.0, drive=Drive.CONSTANT_SPEED, max_speed=0.5, max_turn_rate=0.5
)


def room(pose: tuple[float, float, float], *posts: tuple[float, float]) -> World:
    return World(
        robot=ROBOT,
        robot_pose=np.array(pose),
        static=StaticMap.build(
            polygons=[0.4 * SQUARE + np.array(post) for post in posts],
            bounds=[0.0, 0.0, 10.0, 10.0],
        ),
        movables=Movables.empty(),
        goal=GoalDisc(np.array([9.0, 9.0]), 0.5),
    )


def driven(world: World, twist: Twist, seconds: float) -> World:
    x, y, theta = (float(value) for value in world.robot_pose)
    turn, length = twist.angular * seconds, twist.linear * seconds
    pose = [x + length * math.cos(theta + turn / 2), y + length * math.sin(theta + turn / 2)]
    return world.moved(robot_pose=np.array([*pose, theta + turn]))


def test_a_robot_that_can_stop_stands() -> None:
    world = room((1.0, 5.0, math.pi))
    robot = replace(ROBOT, drive=Drive.DIFFERENTIAL, min_speed=-0.5)
    assert waiting_twist(replace(world, robot=robot)) == Twist(0.0, 0.0)


def test_it_goes_straight_where_there_is_room() -> None:
    assert waiting_twist(room((5.0, 5.0, 0.3))) == Twist(0.5, 0.0)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_without_room_for_a_circle_it_takes_the_open_side(side: float) -> None:
    """A post is close ahead, a little to one side; more posts leave no room for a circle."""
    posts = [(6.8, 5.0 - side * 0.2), (4.2, 5.0 + side * 1.9), (4.2, 5.0 - side * 1.9)]
    twist = waiting_twist(room((5.0, 5.0, 0.0), *posts))
    assert twist.angular * side > 0.0


def test_a_robot_waits_for_any_time_among_posts() -> None:
    """Wherever a circle fits at the start, the robot touches nothing in a minute of waiting."""
    rng = np.random.default_rng(11)
    waited = 0
    for _ in range(16):
        posts = [tuple(post) for post in rng.uniform(0.5, 9.5, (6, 2))]
        world = room((*rng.uniform(2.0, 8.0, 2), rng.uniform(-3.0, 3.0)), *posts)
        walls = unary_union([Polygon(part) for part in world.static.convex_parts])
        x, y, theta = (float(value) for value in world.robot_pose)
        centre = Point(x - math.sin(theta), y + math.cos(theta))  # of the circle to the left
        reach = centre.buffer(1.0 + ROBOT.circumscribed_radius + 0.05)
        if reach.intersects(walls) or not box(0, 0, 10, 10).contains(reach):
            continue
        waited += 1
        for _ in range(300):
            world = driven(world, waiting_twist(world), 0.2)
            x, y, theta = (float(value) for value in world.robot_pose)
            body = affinity.translate(affinity.rotate(Polygon(SQUARE), theta, (0, 0), True), x, y)
            assert body.intersection(walls).area < 1e-6
    assert waited >= 3
