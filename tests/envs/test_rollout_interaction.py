import numpy as np
import pytest

from pushplan.envs import RolloutInteraction, make
from pushplan.interaction.interaction_model import InteractionModel
from pushplan.scenarios import Scenario
from pushplan.world import InvalidInputError


def test_rollout_predicts_what_the_environment_does():
    """Driven along the poses that the environment recorded, boxes end where they ended."""
    env = make(Scenario("maze", variations={"boxes": 10}, seed=4), observation="state")
    env.reset()
    start, path = env.world, [env.world.robot_pose]
    for i in range(60):
        *_, terminated, _, _ = env.step(np.array([0.3 * np.sin(i / 7)]))
        path += list(env.trace.robot_poses)
        if terminated:
            break
    model = RolloutInteraction(materials=env.task.materials)
    assert isinstance(model, InteractionModel)
    before = start.movables.poses.copy()
    found = model.sweep(start, np.array(path))
    np.testing.assert_array_equal(start.movables.poses, before)
    assert found.object_poses.shape == (len(path), 10, 3)
    moved = np.abs(env.world.movables.poses - before)[:, :2].max(axis=1)
    assert moved.max() > 0.3
    np.testing.assert_allclose(
        found.object_poses[-1][:, :2], env.world.movables.poses[:, :2], atol=0.02
    )


def test_the_same_sweep_twice_is_the_same():
    world_env = make(Scenario("maze", variations={"boxes": 10}, seed=4), observation="state")
    world_env.reset()
    world = world_env.world
    y = np.arange(0.0, 5.0, 0.1)
    path = np.stack([np.full_like(y, 11.25), 3.75 + y, np.full_like(y, np.pi / 2)], axis=1)
    model = RolloutInteraction()
    assert (
        model.sweep(world, path)
        == model.sweep(world, path)
        == RolloutInteraction().sweep(world, path)
    )


def test_bad_paths_are_refused():
    env = make(Scenario("maze"), observation="state")
    env.reset()
    for bad in (np.zeros((0, 3)), np.zeros((3, 2)), [[0.0, 0.0, np.nan]]):
        with pytest.raises(InvalidInputError, match="path"):
            RolloutInteraction().sweep(env.world, bad)
