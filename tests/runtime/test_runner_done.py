"""`Runner` says `done` when it is sure of it, and takes it back no more."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from conftest import make_boxes
from test_runner import PERIOD, ROBOT, STILL, maze

from pushplan.control import ImmediateExecutor
from pushplan.runtime import CommandStatus, Runner
from pushplan.runtime.noise_allowance import NoiseAllowance
from pushplan.world import (
    ClearanceArea,
    GoalDisc,
    GoalLine,
    Receptacle,
    StaticMap,
    Twist,
    World,
)

PLACE, HEADING = 0.03, math.radians(5.0)
SIDES = np.array([[4.0, 4.0], [11.0, 4.0], [11.0, 11.0], [4.0, 11.0]])
AREA = ClearanceArea(SIDES, np.array([True, True, False, True]))
EMPTY = StaticMap.build(bounds=[0, 0, 15, 15])


class Stands:
    """A policy that leaves the robot where it is."""

    def reset(self, world: World, rng: np.random.Generator) -> None:
        pass

    def act(self, world: World, observation: object = None) -> Twist:
        return STILL


def runner(**options: float) -> Runner:
    return Runner(Stands(), period=PERIOD, executor=ImmediateExecutor(), max_age=1e9, **options)


def noisy() -> Runner:
    return runner(position_noise=PLACE, heading_noise=HEADING)


def seen(world: World, rng: np.random.Generator) -> World:
    """A world as it is perceived."""
    scale = np.array([PLACE, PLACE, HEADING])
    return world.moved(
        robot_pose=world.robot_pose + scale * rng.normal(size=3),
        movable_poses=world.movables.poses + scale * rng.normal(size=(len(world.movables), 3)),
    )


def after(one: Runner, world: World, updates: int, noise: bool, seed: int = 0):
    """How many of some snapshots it takes until the runner is done; None if it is not."""
    rng = np.random.default_rng(seed)
    one.start(seen(world, rng) if noise else world)
    for n in range(1, updates):
        world = world.moved(time=world.time + PERIOD)
        one.update(seen(world, rng) if noise else world)
        if one.command(world.time).status is CommandStatus.DONE:
            return n
    return None


def scene(kind: str, within: float) -> World:
    """A world whose goal is missed, or reached, by a distance [m]."""
    world = replace(maze([[13.0, 7.0, 0.0]]), static=EMPTY, goal=GoalDisc([7.0, 7.0], 1.0))
    if kind == "disc":
        return world.moved(robot_pose=[8.0 - within, 7.0, 0.3])
    if kind == "line":
        goal = GoalLine([7.0, 7.0], [0.0, 2.0])
        return replace(world, goal=goal).moved(robot_pose=[3.0, 7.0 + within, 0.3])
    if kind == "area":
        box = make_boxes([[11.5 + within, 7.0, 0.0]])
        return replace(world, movables=box, goal=AREA)
    corner = Receptacle(SIDES + 4.0)  # it is at two walls: two sides are those of the map
    box = make_boxes([[8.5 + within, 14.4, 0.0]])
    return replace(world, movables=box, goal=corner)


@pytest.mark.parametrize("kind", ["disc", "line", "area", "receptacle"])
def test_noise_does_not_reach_a_goal_that_is_just_missed(kind):
    assert after(noisy(), scene(kind, -1e-3), 400, True, 0) is None


@pytest.mark.parametrize("kind", ["disc", "line", "area", "receptacle"])
def test_a_goal_that_is_reached_by_far_is_done_in_spite_of_noise(kind):
    n = after(noisy(), scene(kind, 0.25), 100, True)
    assert n is not None and n >= 4


@pytest.mark.parametrize("kind", ["disc", "line"])
def test_without_noise_one_snapshot_is_enough_for_a_robot(kind):
    world = scene(kind, 0.2)
    assert runner().start(world).status is CommandStatus.DONE
    assert after(runner(), scene(kind, -0.01), 50, False) is None


@pytest.mark.parametrize("kind", ["area", "receptacle"])
def test_an_object_that_is_seen_elsewhere_once_is_not_done(kind):
    there, away = scene(kind, 0.1), scene(kind, -0.5)
    with runner() as one:
        one.start(away)
        for n in range(1, 100):
            one.update((there if n % 4 == 0 else away).moved(time=n * PERIOD))
            assert one.command(n * PERIOD).status is not CommandStatus.DONE
    assert after(runner(), there, 50, False) == 4


@pytest.mark.parametrize("noise", [True, False])
@pytest.mark.parametrize("kind", ["disc", "line", "area", "receptacle"])
def test_done_is_final_until_the_next_start(kind, noise):
    one = noisy() if noise else runner()
    world, away = scene(kind, 0.3), scene(kind, -1.0)
    n = after(one, world, 100, noise) or 1
    for k in range(n + 1, n + 50):
        one.update(away.moved(time=k * PERIOD))
        command = one.command(k * PERIOD)
        assert command.status is CommandStatus.DONE and command.twist == STILL
    assert one.command((n + 50) * PERIOD - 100.0).status is CommandStatus.DONE
    assert one.start(away).status is not CommandStatus.DONE


def test_a_robot_that_drives_brakes_when_it_is_done():
    speed = 0.4
    world = scene("disc", 0.5)
    world = world.moved(robot_twist=[speed * math.cos(0.3), speed * math.sin(0.3), 0.0])
    with runner() as one:
        speeds = [one.start(world).twist.linear]
        speeds += [one.command(n * PERIOD).twist.linear for n in range(1, 30)]
    assert speeds[-1] == 0.0
    assert np.abs(np.diff([speed, *speeds])).max() <= ROBOT.max_acceleration * PERIOD + 1e-9


class TestSurerGoals:
    ALLOWANCE = NoiseAllowance(PLACE, HEADING, PERIOD, 0.0)

    def goal(self, goal, static=EMPTY):
        world = replace(maze([[13.0, 7.0, 0.0]]), static=static, goal=goal)
        inset = 3.0 * math.hypot(PLACE, HEADING * math.sqrt(0.5))
        return self.ALLOWANCE.planning_world(world).goal, inset

    def test_an_area_is_larger_on_every_side(self):
        corners = np.array([[4.0, 4.0], [8.0, 3.0], [11.0, 4.0], [11.0, 7.5], [11.0, 11.0]])
        goal, inset = self.goal(ClearanceArea(corners, np.ones(5, dtype=bool)))
        want = shapely.Polygon(corners).buffer(inset, join_style="mitre", mitre_limit=50.0)
        got = shapely.Polygon(goal.polygon)
        assert got.symmetric_difference(want).area < 1e-6
        assert goal.open_edges.tolist() == [True] * 5

    def test_a_receptacle_is_smaller_where_no_wall_is_behind_its_sides(self):
        wall = StaticMap.build(
            bounds=[0, 0, 15, 15], polygons=[[[4, 11.01], [11, 11.01], [11, 11.3], [4, 11.3]]]
        )
        goal, inset = self.goal(Receptacle(SIDES), wall)
        low, high = goal.polygon.min(axis=0), goal.polygon.max(axis=0)
        assert low == pytest.approx(4.0 + inset) and high == pytest.approx([11.0 - inset, 11.0])

    def test_a_small_receptacle_keeps_half_its_width(self):
        goal, _ = self.goal(Receptacle(0.02 * SIDES + 5.0))
        assert np.ptp(goal.polygon, axis=0) == pytest.approx(0.5 * 0.02 * 7.0)

    def test_without_noise_goals_for_objects_are_as_they_are(self):
        exact = NoiseAllowance(0.0, 0.0, PERIOD, None)
        for goal in (AREA, Receptacle(SIDES), GoalLine([7.0, 7.0], [0.0, 1.0])):
            world = replace(maze(), static=EMPTY, goal=goal)
            assert exact.planning_world(world).goal is goal
