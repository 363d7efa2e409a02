"""On maps of thousands of obstacles the stop rule is looked at within every phase of a call."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import SQUARE, quickest
from plan_checks import check_plan
from random_worlds import posts

from pushplan.geometry import VisibilityGraph
from pushplan.motion.coarse_path import reachable
from pushplan.motion.keep_out import keep_out
from pushplan.motion.keyholes import KeyholeConfig, suits_keyholes
from pushplan.planners import make_planner
from pushplan.world import (
    GoalDisc,
    MaxIterations,
    Movables,
    PlanStatus,
    StaticMap,
    Stop,
    World,
    box_delivery_robot,
    checks,
)
from pushplan.world.outline import grown_outline

PLANNERS = ("straight", "skeleton", "kinodynamic-rrt", "push-aware")


class Looks(Stop):
    """Counts the looks at it, and fires at one of them."""

    def __init__(self, last: float = np.inf) -> None:
        self.count, self.last = 0, last

    def start(self):
        def check(iterations: int, cost: float) -> bool:
            self.count += 1
            return self.count >= self.last or cost < np.inf

        return check


def looks_at_a_path(static: StaticMap, clearance: float) -> int:
    """How often the stop rule is asked while a short path is found."""
    looks = Looks()
    check = looks.start()
    start = static.bounds[:2]
    VisibilityGraph(static, clearance).to_goal(
        start, GoalDisc(start, 0.1), lambda: check(0, np.inf)
    )
    return looks.count


def test_what_is_made_of_a_large_map_is_made_in_pieces():
    looks, world = Looks(), posts(3000, seed=12)
    assert make_planner("skeleton").plan(world, stop=looks).status is PlanStatus.PATH_ONLY
    assert looks.count >= 12
    first = looks_at_a_path(world.static, 0.123)
    assert first >= looks_at_a_path(world.static, 0.123) + 9


@pytest.mark.parametrize("name", PLANNERS)
def test_a_call_ends_at_the_look_that_fires(name):
    for last in (1, 4, 9):
        looks = Looks(last)
        result = make_planner(name).plan(posts(3000, seed=100 + last), stop=looks)
        assert result.status is PlanStatus.TIMED_OUT
        assert looks.count <= last + 8  # the ends of loops look at it once more each


@pytest.mark.parametrize(("last", "count"), [(np.inf, 5), (2, 2)])
def test_the_look_for_a_way_around_walls_is_one_in_pieces(last, count):
    looks = Looks(last)
    check = looks.start()
    world = replace(posts(300, seed=1), robot=box_delivery_robot())  # as wide as some cells
    assert reachable(world, lambda: check(0, np.inf))  # as far as it knows
    assert count <= looks.count <= last


def test_what_was_made_before_a_stop_is_kept_for_the_next_call():
    world, planner = posts(3000, seed=7), make_planner("straight")
    clearance = world.robot.circumscribed_radius
    for _ in range(10):
        planner.plan(world, stop=Looks(last=4))
    later = looks_at_a_path(world.static, clearance)
    assert looks_at_a_path(world.static, 1.001 * clearance) >= later + 9


def test_namo_looks_while_it_makes_its_grid():
    world = posts(150, seed=3, planner="namo")
    assert suits_keyholes(world, KeyholeConfig())
    for last in (1, 2, 5, 20, 60):
        looks = Looks(last)
        result = make_planner("namo").plan(world, stop=looks)
        assert result.status is PlanStatus.TIMED_OUT
        assert looks.count <= last + 8


@pytest.mark.slow
def test_thousands_of_obstacles_grow_together_as_each_would_alone():
    world = replace(posts(3000, seed=5), margin=0.03)
    others = [replace(world, margin=0.01 * k) for k in (4, 5, 6)]  # none of them is kept
    assert quickest(lambda: keep_out(others.pop())) < 0.25  # alone they take 0.5 s and more
    for grown, polygon in zip(keep_out(world).polygons, world.static.polygons, strict=True):
        np.testing.assert_array_equal(grown, grown_outline(polygon, 0.03))


def test_a_map_that_is_made_again_is_known_without_reading_it_again(monkeypatch):
    first = posts(200, seed=6).static
    again = remade(first)
    assert len({first, again}) == 1
    monkeypatch.setattr(checks, "_hashable", None)  # raises where it is called
    assert len({first, again}) == 1


def remade(static: StaticMap) -> StaticMap:
    return StaticMap(static.polygons, static.segments, static.radii, static.bounds)


@pytest.mark.parametrize("overlapping", [True, False])
def test_there_is_a_plan_through_a_crowd_that_nothing_holds(overlapping):
    """The usual rounds of the contact solver leave overlaps, which are no jam."""
    static = StaticMap.build(segments=[[0, 0, 9, 0], [0, 5, 9, 5]], radii=0.05, bounds=[0, 0, 9, 5])
    goal = GoalDisc([6.0, 2.5], 0.2)
    for seed in range(6):
        rng = np.random.default_rng(seed)
        places = []
        while len(places) < 24:
            pose = rng.uniform([1.8, 1.2, -3.0], [5.5, 3.8, 3.0])
            if overlapping or all(np.hypot(*(pose - other)[:2]) > 0.43 for other in places):
                places.append(pose)
        boxes = Movables.from_outlines([0.3 * SQUARE] * 24, places, density=10.0)
        world = World(box_delivery_robot(), [0.6, 2.5, 0.0], static, boxes, goal)
        result = make_planner("push-aware").plan(world, stop=MaxIterations(1000))
        assert result.status is PlanStatus.SOLVED
        check_plan(world, result.plan, result.status)
