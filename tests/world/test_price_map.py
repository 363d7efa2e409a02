"""Prices of places: what planners pay for them, and what a costmap becomes."""

import math

import numpy as np
import pytest

from pushplan.planners import make_planner
from pushplan.world import (
    GoalDisc,
    InvalidInputError,
    MaxIterations,
    Movables,
    PriceMap,
    StaticMap,
    World,
)
from pushplan.world.stored.robots import turtlebot3_burger


def world(price=None):
    """A robot at (1, 2) with its goal at (7, 2), in 8 m by 4 m."""
    return World(
        robot=turtlebot3_burger(),
        robot_pose=(1.0, 2.0, 0.0),
        static=StaticMap.build(bounds=(0.0, 0.0, 8.0, 4.0)),
        movables=Movables.empty(),
        goal=GoalDisc((7.0, 2.0), 0.2),
        price=price,
    )


def hill(height):
    """A price around (4, 2.2), falling to nothing at a metre from there."""
    y, x = np.mgrid[0.05:4.0:0.1, 0.05:8.0:0.1]
    near = np.maximum(0.0, 1.0 - np.hypot(x - 4.0, y - 2.2))
    return PriceMap(height * near, 0.1, (0.0, 0.0, 0.0))


def priced_length(poses, price):
    """Plain reference: each step at the price of its middle."""
    x, y, theta = price.origin
    turn = np.array([[math.cos(theta), -math.sin(theta)], [math.sin(theta), math.cos(theta)]])
    total = 0.0
    for a, b in zip(poses[:-1, :2], poses[1:, :2], strict=True):
        column, row = np.floor((0.5 * (a + b) - [x, y]) @ turn / price.resolution).astype(int)
        rows, columns = price.prices.shape
        inside = 0 <= row < rows and 0 <= column < columns
        total += math.dist(a, b) * (1.0 + (price.prices[row, column] if inside else 0.0))
    return total


@pytest.mark.parametrize("planner", ["push-aware", "kinodynamic-rrt"])
def test_paths_lead_around_what_is_dear(planner):
    made = make_planner(planner)
    price = hill(3.0)
    poses = [
        made.plan(world(p), stop=MaxIterations(4000), rng=np.random.default_rng(1)).plan.poses
        for p in (None, price)
    ]
    direct, around = (priced_length(path, price) for path in poses)
    assert around < 0.8 * direct
    assert np.hypot(*(poses[1][:, :2] - [4.0, 2.2]).T).min() > 0.5


def test_a_price_of_nothing_changes_no_digit():
    free = PriceMap(np.zeros((40, 80)), 0.1, (0.0, 0.0, 0.0))
    first, second = (
        make_planner("push-aware").plan(
            world(p), stop=MaxIterations(500), rng=np.random.default_rng(3)
        )
        for p in (None, free)
    )
    assert first.plan == second.plan and first.stats.detail["cost"] == second.stats.detail["cost"]


def test_the_cost_of_a_path_is_that_of_its_steps():
    rng = np.random.default_rng(5)
    for _ in range(5):
        origin = (*rng.uniform(-1.0, 3.0, 2), rng.uniform(-3.0, 3.0))
        price = PriceMap(rng.uniform(0.0, 4.0, (15, 20)), rng.uniform(0.1, 0.4), origin)
        here = world(price)
        result = make_planner("push-aware").plan(here, stop=MaxIterations(300))
        expected = here.robot.mass * priced_length(result.plan.poses, price)
        assert result.stats.detail["cost"] == pytest.approx(expected, rel=1e-9)


def test_a_costmap_is_priced_up_to_its_inscribed_cells():
    grid = np.array([[0, 1, 50], [98, 99, 100], [-1, 0, 0]], dtype=np.int8)
    price = PriceMap.from_costmap(grid, 0.05, (1.0, 2.0, 0.5), most=2.0)
    expected = np.array([[0, 1, 50], [98, 99, 0], [0, 0, 0]]) * 2.0 / 99
    np.testing.assert_allclose(price.prices, expected)
    with pytest.raises(InvalidInputError, match="negative"):
        PriceMap(-expected, 0.05, (1.0, 2.0, 0.5))
