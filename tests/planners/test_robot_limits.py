"""Plans keep every limit of every kind of robot: speeds, turn rate, radius and accelerations."""

from __future__ import annotations

import numpy as np
import pytest
from plan_checks import check_plan

from pushplan.planners import make_planner, planner_names
from pushplan.planners.registry import OPEN_WATER
from pushplan.world import (
    Drive,
    FirstSolution,
    GoalDisc,
    GoalLine,
    MaxIterations,
    Movables,
    RobotModel,
    StaticMap,
    World,
)

SIDE = 8.0
HULLS = {
    "square": 0.3 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1.0]]),
    "plank": np.array([[0.5, 0.12], [-0.5, 0.12], [-0.5, -0.12], [0.5, -0.12]]),
    "cart": np.array([[0.6, 0.25], [-0.1, 0.25], [-0.1, -0.25], [0.6, -0.25]]),
}
COUNTS = [3, pytest.param(60, marks=pytest.mark.slow)]
ITERATIONS = {"ship-predictive-published": 60}


def random_robot(rng: np.random.Generator) -> RobotModel:
    """Any drive, with and without reverse, each limit from tight to none."""
    drive = Drive(str(rng.choice([kind.value for kind in Drive])))
    fast = 10 ** rng.uniform(-1.0, 0.5)
    limits = {"max_acceleration": np.inf, "max_turn_acceleration": np.inf}
    for name in limits:
        if rng.random() < 0.5:
            limits[name] = 10 ** rng.uniform(-1.0, 1.5)
    if drive is Drive.CAR:
        limits["min_turning_radius"] = rng.uniform(0.2, 1.5)
    if drive is not Drive.CONSTANT_SPEED and rng.random() < 0.6:
        limits["min_speed"] = -fast * rng.choice([0.05, 0.5, 1.0, 2.0])
    return RobotModel.from_outline(
        HULLS[rng.choice(list(HULLS))],
        mass=1.0,
        drive=drive,
        max_speed=fast,
        max_turn_rate=fast / rng.uniform(0.2, 2.0) * rng.choice([0.1, 1.0, 1.0]),
        **limits,
    )


def random_start(seed: int, name: str) -> World:
    """A small room with a post and two boxes, or open water with two floes; any heading."""
    rng = np.random.default_rng(seed)
    robot, angle = random_robot(rng), rng.uniform(-3.0, 3.0)
    post = 0.2 * HULLS["square"] / 0.3 + rng.uniform(3.0, 5.0, 2)
    polygons, goal = [post], GoalDisc(rng.uniform(5.5, 7.0, 2), 0.6)
    if name in OPEN_WATER or rng.random() < 0.2:
        polygons, goal = [], GoalLine([4.0, 6.5], [0.0, 1.0])
        angle = rng.uniform(0.0, np.pi)
    boxes = [0.2 * HULLS["square"] / 0.3] * 2
    places = np.column_stack([rng.uniform(3.0, 6.0, (2, 2)), rng.uniform(-3, 3, 2)])
    return World(
        robot,
        [*rng.uniform(1.5, 2.5, 2), angle],
        StaticMap.build(polygons=polygons, bounds=[0, 0, SIDE, SIDE]),
        Movables.from_outlines(boxes, places),
        goal,
    )


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("name", planner_names())
def test_every_plan_keeps_every_limit_of_the_robot(name: str, count: int) -> None:
    found, wrong = 0, []
    for seed in range(count):
        world = random_start(seed, name)
        stop = FirstSolution() | MaxIterations(ITERATIONS.get(name, 1500))
        result = make_planner(name).plan(world, stop=stop, rng=np.random.default_rng(seed))
        if result.plan is None:
            continue
        found += 1
        try:
            check_plan(world, result.plan, result.status)
        except AssertionError as error:
            wrong.append(f"world {seed}, {world.robot.drive.value}: {error}")
    assert not wrong, "\n".join(wrong)
    assert found >= 0.3 * count
