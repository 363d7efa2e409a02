"""The push in hand as a plan, for pictures and logs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from conftest import make_u_maze

from pushplan.core import rearrangement as core
from pushplan.envs import make
from pushplan.planners import make_policy
from pushplan.planners.rearrangement import GtspMpc
from pushplan.planners.rearrangement.push import Push, push_plan
from pushplan.scenarios import suite
from pushplan.world import InvalidInputError, ShowsPlan, World


def test_gtsp_mpc_shows_the_push_in_hand() -> None:
    (scenario,) = suite("area-clearing-2d-10", episodes=1, first_seed=3).scenarios
    env = make(scenario, action="velocity")
    env.reset(seed=scenario.seed)
    policy = make_policy("gtsp-mpc")
    assert isinstance(policy, ShowsPlan)
    policy.reset(env.world, np.random.default_rng(0))
    assert policy.current_plan is None
    seen = []
    for _ in range(250):
        command = policy.act(env.world, None)
        plan = policy.current_plan
        if plan is not None and (not seen or plan is not seen[-1][1]):
            seen.append((env.world, plan))
        env.step(env.encode(command))
    assert len(seen) >= 2  # the way to the push, then the push as it is predicted from there
    for world, plan in seen:
        (push,) = plan.subtasks
        assert np.allclose(plan.poses[0], world.robot_pose, atol=0.2)
        assert np.allclose(plan.object_poses[0], world.movables.poses)
        moved = np.hypot(*(plan.object_poses[-1] - plan.object_poses[0])[:, :2].T) > 0.1
        assert set(push.object_ids) <= set(world.movables.ids[moved].tolist())
        assert np.allclose(plan.object_poses[push.first], world.movables.poses)
        assert plan.interaction_cost > 0.0
        for stage in plan.stages:  # it says where the robot turns on the spot and where it backs
            part = plan.poses[stage.first : stage.last + 1]
            ahead = np.diff(part[:, :2], axis=0) * np.column_stack(
                [np.cos(part[:-1, 2]), np.sin(part[:-1, 2])]
            )
            assert stage.direction == 0 or (stage.direction * ahead.sum(axis=1) > -1e-3).all()
    assert any(stage.direction == 0 for _, plan in seen for stage in plan.stages)


def test_an_object_that_leaves_ends_in_front_of_the_robot() -> None:
    world = make_u_maze([[4.0, 9.0, 0.3], [10.0, 13.0, 0.0]])
    ends = np.array(world.movables.poses)
    ends[0, 0] = core.REMOVED
    path = np.column_stack([np.linspace(3.0, 8.0, 11), np.full(11, 9.0), np.zeros(11)])
    box = int(world.movables.ids[0])
    push = Push((box,), box, "line", path, length=5.0, work=1.0, cost=5.0, object_poses=ends)
    plan = push_plan(world, None, push)
    assert plan.object_poses is not None
    x, y, _ = plan.object_poses[-1, 0]
    front, size = world.robot.vertices[:, 0].max(), world.movables.radii[0]
    assert y == 9.0 and 0.5 * size < x - (8.0 + front) < size
    assert np.allclose(plan.object_poses[-1, 1], world.movables.poses[1])


def _first_choice(*costs: object) -> GtspMpc:
    (scenario,) = suite("area-clearing-2d-10", episodes=1, first_seed=3).scenarios
    env = make(scenario, action="velocity")
    env.reset(seed=scenario.seed)
    policy = make_policy("gtsp-mpc", costs=costs)
    policy.reset(env.world, np.random.default_rng(0))
    policy.act(env.world, None)
    return policy


def test_a_term_of_a_user_changes_the_choice_of_pushes() -> None:
    plain = _first_choice()
    first = plain.plan[0].delivers
    seen = []

    def not_these(world: World, push: Push) -> float:
        seen.append(len(world.movables))
        return math.inf if set(push.serves) & set(first) else 0.0

    assert not set(_first_choice(not_these).plan[0].serves) & set(first)
    assert set(seen) == {10}
    same = _first_choice(lambda world, push: 0.0)
    assert [push.delivers for push in same.plan] == [push.delivers for push in plain.plan]


@pytest.mark.parametrize("wrong", ["cheap", lambda world, push: "1", lambda world, push: math.nan])
def test_terms_that_are_no_costs_are_one_clear_line(wrong: object) -> None:
    with pytest.raises(InvalidInputError, match="cost"):
        _first_choice(wrong)
