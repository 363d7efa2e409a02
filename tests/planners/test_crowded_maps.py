"""On maps of thousands of obstacles the stop rule is looked at within every phase of a call."""

from __future__ import annotations

import numpy as np
import pytest

from pushplan.geometry.contours import prepare_contours
from pushplan.motion.coarse_path import coarse_path
from pushplan.planners import make_planner
from pushplan.world import (
    GoalDisc,
    Movables,
    PlanStatus,
    StaticMap,
    Stop,
    World,
    turtlebot3_burger,
)

SIDE = 40.0
PLANNERS = ("straight", "skeleton", "kinodynamic-rrt", "push-aware")


def posts(count: int, seed: int) -> World:
    """A robot in one corner of a hall of posts, its goal in the other one."""
    rng = np.random.default_rng(seed)
    spots = rng.uniform(1.0, SIDE - 1.0, (count, 2))
    for free in ([2.0, 2.0], [SIDE - 2.0, SIDE - 2.0]):
        spots = spots[np.hypot(*(spots - free).T) > 1.5]
    corners = 0.1 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    static = StaticMap.build([corners + spot for spot in spots], bounds=[0, 0, SIDE, SIDE])
    goal = GoalDisc([SIDE - 2.0, SIDE - 2.0], 0.5)
    return World(turtlebot3_burger(), [2.0, 2.0, 0.5], static, Movables.empty(), goal)


class Looks(Stop):
    """Counts the looks at it, and fires at one of them."""

    def __init__(self, last: float = np.inf) -> None:
        self.count, self.last = 0, last

    def start(self):
        def check(iterations: int, cost: float) -> bool:
            self.count += 1
            return self.count >= self.last or cost < np.inf

        return check


@pytest.mark.warm(*PLANNERS)
def test_what_is_made_of_a_large_map_is_made_in_pieces():
    looks, world = Looks(), posts(3000, seed=12)
    assert make_planner("skeleton").plan(world, stop=looks).status is PlanStatus.PATH_ONLY
    assert looks.count >= 12
    looks = Looks()
    check = looks.start()
    assert prepare_contours(world.static, 0.123, lambda: check(0, np.inf))
    assert looks.count >= 9


@pytest.mark.warm(*PLANNERS)
@pytest.mark.parametrize("name", PLANNERS)
def test_a_call_ends_at_the_look_that_fires(name):
    for last in (1, 2, 4, 7, 9):
        looks = Looks(last)
        result = make_planner(name).plan(posts(3000, seed=100 + last), stop=looks)
        assert result.status is PlanStatus.TIMED_OUT
        assert looks.count <= last + 8  # the ends of loops look at it once more each


def test_the_coarse_path_looks_while_it_goes_through_the_cells():
    looks = Looks()
    check = looks.start()
    whole = coarse_path(posts(300, seed=1), 1.0, lambda: check(0, np.inf))
    assert len(whole) and looks.count >= 5
    assert not len(coarse_path(posts(300, seed=1), 1.0, lambda: True))


@pytest.mark.warm("straight")
def test_what_was_made_before_a_stop_is_kept_for_the_next_call():
    world, planner = posts(3000, seed=7), make_planner("straight")
    clearance = world.robot.circumscribed_radius
    assert not prepare_contours(world.static, clearance, lambda: True)
    for _ in range(10):
        planner.plan(world, stop=Looks(last=4))
    assert prepare_contours(world.static, clearance, lambda: True)
