"""A `Runner` whose robot is carried aside, or held: it hits no wall, and says that it is stuck."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from test_new_obstacles import BODY, PERIOD, ROBOT, Ahead, DrivenRobot, PushingRobot

from pushplan.control.limits import driven_twist
from pushplan.control.stopping import stopping_path
from pushplan.runtime import CommandStatus
from pushplan.world import Drive, GoalDisc, Movables, StaticMap, Twist, World
from pushplan.world.outline import transform

BOUNDS = [-0.2, -0.2, 12.2, 8.2]


def bar(x0: float, y0: float, x1: float, y1: float) -> np.ndarray:
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def hall(seed: int) -> World:
    """Three rooms in a row with doors of 1.3 m, pillars, and light boxes."""
    rng = np.random.default_rng(seed)
    bars = [bar(-0.2, -0.2, 12.2, 0.0), bar(-0.2, 8.0, 12.2, 8.2)]
    bars += [bar(-0.2, 0.0, 0.0, 8.0), bar(12.0, 0.0, 12.2, 8.0)]
    bars += [bar(3.6, 0.0, 3.75, 3.0), bar(3.6, 4.3, 3.75, 8.0)]
    bars += [bar(7.2, 0.0, 7.35, 4.6), bar(7.2, 5.9, 7.35, 8.0)]
    bars += [bar(x, y, x + 0.4, y + 0.4) for x, y in rng.uniform([8, 1], [10, 6], (4, 2))]
    solid = shapely.union_all([shapely.Polygon(one) for one in bars])
    goal = (11.2, float(rng.uniform(1.5, 6.5)))
    places = rng.uniform([4.2, 0.8], [6.8, 7.2], (6, 2))
    places = [one for one in places if solid.distance(shapely.Point(one)) > 0.3]
    square = 0.15 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    poses = [[*one, rng.uniform(0.0, 3.0)] for one in places]
    return World(
        robot=ROBOT,
        robot_pose=[1.2, rng.uniform(2.5, 5.0), rng.uniform(-0.4, 0.4)],
        static=StaticMap.build(polygons=bars, bounds=BOUNDS),
        movables=Movables.from_outlines([square] * len(poses), poses, masses=[0.5] * len(poses)),
        goal=GoalDisc(goal, 0.3),
    )


def is_clear(world: World, poses: np.ndarray) -> bool:
    robot = shapely.union_all([shapely.Polygon(transform(pose, BODY)) for pose in poses])
    objects = map(world.movables.outline_world, range(len(world.movables)))
    others = [*world.static.convex_parts, *objects]
    return all(robot.intersection(shapely.Polygon(one)).area == 0.0 for one in others)


def lift(driven: DrivenRobot, aside: tuple[float, float]) -> bool:
    """Put the robot elsewhere, if it can brake there; False where it cannot."""
    world = driven.world
    pose = world.robot_pose + np.array([*aside, 0.0])
    x0, y0, x1, y1 = BOUNDS
    braking = stopping_path(world.robot, pose, driven_twist(world), 2.0 * PERIOD, PERIOD)
    if not (x0 < pose[0] < x1 and y0 < pose[1] < y1 and is_clear(world, braking)):
        return False
    driven.world = world.moved(robot_pose=pose)
    driven.poses = [pose]
    return True


def hits(driven: DrivenRobot) -> float:
    """Greatest area of the robot in what is static or fixed since it was put elsewhere."""
    world = driven.world
    solid = [shapely.Polygon(part) for part in world.with_fixed_as_static().static.convex_parts]
    bodies = np.array([shapely.Polygon(transform(pose, BODY)) for pose in driven.poses])
    body, wall = shapely.STRtree(solid).query(bodies, "intersects")
    return float(shapely.area(bodies[body] & np.array(solid)[wall]).max(initial=0.0))


@pytest.mark.parametrize(
    "name", ["kinodynamic-rrt", pytest.param("push-aware", marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("seed", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_a_robot_that_is_carried_aside_hits_no_wall_of_its_map(name: str, seed: int) -> None:
    lifted = 0
    for k in range(0, 16, 3):
        driven = PushingRobot(name, hall(seed))
        driven.drive(70)
        far = 1.0 if k % 2 else 1.5
        if lift(driven, (far * math.cos(0.4 * k), far * math.sin(0.4 * k))):
            lifted += 1
            driven.drive(240)
            assert hits(driven) == 0.0, k
    assert lifted >= 2


class Turns(Ahead):
    """A policy that drives as a test tells it to."""

    def __init__(self, *twists: Twist) -> None:
        self.twists = list(twists)
        self.calls = 0

    def act(self, world: World, observation: object = None) -> Twist:
        self.calls += 1
        return self.twists[self.calls // 20 % len(self.twists)]


@settings(max_examples=8, deadline=None)
@given(
    st.integers(0, 10**6), st.sampled_from([Drive.DIFFERENTIAL, Drive.OMNIDIRECTIONAL, Drive.CAR])
)
def test_no_command_leads_a_robot_that_can_stop_into_what_is_static_or_fixed(seed, drive) -> None:
    rng = np.random.default_rng(seed)
    world = hall(seed % 5)
    sizes = {"min_turning_radius": 0.4} if drive is Drive.CAR else {}
    robot = replace(ROBOT, drive=drive, **sizes)
    fixed = np.ones(len(world.movables), dtype=np.bool_)
    world = replace(world, robot=robot).believing(fixed)
    lateral = 0.5 if drive is Drive.OMNIDIRECTIONAL else 0.0
    wanted = [Twist(*rng.uniform([-0.4, -1.5, -lateral], [0.8, 1.5, lateral])) for _ in range(8)]
    driven = DrivenRobot(Turns(*wanted), world)
    driven.drive(120)
    assert hits(driven) == 0.0


def test_a_robot_that_touches_a_wall_may_only_get_away() -> None:
    policy = Ahead()
    world = hall(0)
    world = world.moved(robot_pose=[3.32, 1.5, 0.0])  # 2 cm deep in the wall ahead
    driven = DrivenRobot(policy, world)
    before = hits(driven)
    assert before > 0.0
    assert driven.drive(20).status is CommandStatus.BLOCKED
    assert hits(driven) <= before + 1e-9
    policy.speed = -0.4
    assert driven.drive(20).status is CommandStatus.DRIVING
    assert driven.world.robot_pose[0] < 3.2


class HeldRobot(DrivenRobot):
    """One whose wheels slip while it is held."""

    held = True

    def step(self, twist: Twist) -> None:
        super().step(Twist(0.0, 0.0) if self.held else twist)


@pytest.mark.parametrize(
    "name", ["kinodynamic-rrt", pytest.param("push-aware", marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("noise", [0.0, 0.02])
@pytest.mark.parametrize("seconds_before", [0.0, 3.0])
def test_a_robot_that_is_held_says_that_it_is_stuck(
    name: str, noise: float, seconds_before: float
) -> None:
    driven = HeldRobot(name, hall(1), noise=noise)
    driven.held = False
    driven.drive(round(seconds_before / PERIOD))
    driven.held = True
    begin = len(driven.commands)
    driven.drive(round(60.0 / PERIOD))
    late = driven.commands[begin + round(5.0 / PERIOD) :]
    assert CommandStatus.DRIVING not in {command.status for command in late}
    assert CommandStatus.STUCK not in {command.status for command in driven.commands[: begin + 20]}
    stuck = [command for command in late if command.status is CommandStatus.STUCK]
    assert len(stuck) > 600 and "has not moved for" in stuck[-1].reason
    driven.held = False
    driven.drive(60)
    assert driven.commands[-1].status is not CommandStatus.STUCK


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_a_robot_that_stands_as_told_or_creeps_as_told_is_not_stuck(noise: float) -> None:
    for speed in (0.0, 0.01, 0.1):
        policy = Ahead()
        policy.speed = speed
        driven = DrivenRobot(policy, hall(0), noise=noise)
        driven.drive(240)
        assert CommandStatus.STUCK not in {command.status for command in driven.commands}
