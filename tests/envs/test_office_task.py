"""The office as an environment."""

from __future__ import annotations

import numpy as np
import pytest

from pushplan.envs import PushEnv
from pushplan.evaluation import bench
from pushplan.geometry import VisibilityGraph
from pushplan.scenarios import Scenario


def office(**variations: object) -> PushEnv:
    return PushEnv(task="office", variations={"polygons": 200, **variations}, observation="state")


def test_a_policy_gets_there() -> None:
    scenario = Scenario("office", variations={"polygons": 100, "max_speed": 2.0}, seed=1)
    results = bench([scenario], ["straight"], workers=0)
    assert [row.reason for row in results.rows] == ["goal"]


@pytest.mark.parametrize("seed", range(4))
def test_the_goal_distance_of_the_grid_is_about_the_exact_one(seed: int) -> None:
    env = office()
    env.reset(seed=seed)
    world = env.world
    graph = VisibilityGraph(world.static, clearance=0.1)
    exact = graph.to_goal(world.robot_pose[:2], world.goal).length
    assert env.task._robot_distance(world) == pytest.approx(exact, rel=0.1, abs=0.3)


def test_progress_is_rewarded_in_any_place() -> None:
    env = office(boxes=0.0)
    env.reset(seed=2)
    world = env.world
    goal = world.goal.center
    whole = env.task.score(
        world, world.moved(robot_pose=[*goal, 0.0]), work=0.0, touched_static=False
    )
    assert whole.reward == pytest.approx(150.0 + 200.0)
    rng = np.random.default_rng(0)
    low, high = world.static.bounds[:2], world.static.bounds[2:]
    for place in rng.uniform(low, high, (50, 2)):
        after = world.moved(robot_pose=[*place, 0.0])
        assert np.isfinite(env.task.score(world, after, work=1.0, touched_static=False).reward)
