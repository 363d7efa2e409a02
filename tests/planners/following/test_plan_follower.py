"""What a policy makes of the plans of any planner."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from conftest import make_u_maze

from pushplan.planners import make_planner, make_policy, policy_for
from pushplan.world import InvalidInputError, PlanResult, PlanStats


class Altered:
    """Another planner's plans, changed."""

    def __init__(self, name="straight", change=lambda plan: plan) -> None:
        self._planner, self._change = make_planner(name), change

    def plan(self, world, *, stop=None, rng=None):
        result = self._planner.plan(world, stop=stop, rng=rng)
        return PlanResult(result.status, self._change(result.plan), PlanStats(wall_time_s=0.0))


def driven(policy, world, steps=250):
    """Poses of a robot that does as it is told."""
    policy.reset(world, np.random.default_rng(0))
    poses = [world.robot_pose]
    for n in range(steps):
        twist = policy.act(world)
        x, y, theta = poses[-1]
        middle = theta + 0.05 * twist.angular
        move = 0.1 * twist.linear * np.array([np.cos(middle), np.sin(middle)])
        poses.append(np.array([x + move[0], y + move[1], theta + 0.1 * twist.angular]))
        world = replace(world, robot_pose=poses[-1], time=0.1 * (n + 1))
    return np.array(poses)


@pytest.fixture
def world():
    return make_u_maze()


def test_a_polyline_of_ones_own_is_driven_like_that_of_straight(world):
    mine, straight = driven(policy_for(Altered()), world), driven(make_policy("straight"), world)
    np.testing.assert_array_equal(mine, straight)
    assert np.ptp(straight[:, 0]) > 1.0


def test_a_smooth_plan_is_driven_as_by_its_own_policy(world):
    mine = driven(policy_for(Altered("kinodynamic-rrt")), world, steps=60)
    np.testing.assert_array_equal(mine, driven(make_policy("kinodynamic-rrt"), world, steps=60))


def test_the_time_of_a_call_is_measured(world):
    def slowly(plan):
        time.sleep(0.02)
        return plan

    policy = policy_for(Altered(change=slowly))
    policy.act(world)
    assert policy.plan_log[0].stats.wall_time_s >= 0.02


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda plan: replace(plan, poses=plan.poses + 100.0), r"plan.poses must begin within"),
        (
            lambda plan: replace(plan, object_poses=np.zeros((len(plan.poses), 2, 3))),
            r"plan.object_poses must be \(\d+, 1, 3\) for the 1 objects",
        ),
    ],
)
def test_a_plan_for_another_scene_is_refused(change, said):
    world = make_u_maze([(3.0, 3.0, 0.0)])
    with pytest.raises(InvalidInputError, match=said):
        policy_for(Altered(change=change)).act(world)
