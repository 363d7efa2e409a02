"""Predictive control over rollouts of the simulators themselves."""

import numpy as np
import pytest

from pushplan.envs import RolloutInteraction, make
from pushplan.interaction import SweepsMany
from pushplan.planners import make_policy
from pushplan.scenarios import suite


@pytest.mark.slow
@pytest.mark.parametrize(
    ("simulator", "scenes"), [("pymunk", "maze-2d-5"), ("mujoco", "maze-3d-3")]
)
def test_it_drives_over_rollouts_of_the_simulator(simulator, scenes):
    scenario = suite(scenes, episodes=1).scenarios[0]
    env = make(scenario, observation="state")
    env.reset()
    model = RolloutInteraction(simulator, env.task.materials)
    assert isinstance(model, SweepsMany)
    policy = make_policy("mppi", interaction=model, samples=6, steps=5, knots=2)
    policy.reset(env.world, np.random.default_rng(0))
    before = env.world
    for _ in range(8):
        env.step(env.encode(policy.act(env.world)))
    goal = before.goal
    assert len(policy.plan_log) > 2
    assert goal.distance(*env.world.robot_pose[:2]) != goal.distance(*before.robot_pose[:2])
    plan = policy.plan_log[0].plan
    paths = [plan.poses, plan.poses[:3]]
    for one, path in zip(model.sweep_many(before, paths), paths, strict=True):
        np.testing.assert_allclose(one.object_poses, model.sweep(before, path).object_poses)
