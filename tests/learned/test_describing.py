"""Specifications made from environments, and models saved with them."""

from __future__ import annotations

from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest
from gymnasium import wrappers
from policy_files import maze_specification

from pushplan.envs import PushEnv
from pushplan.learned import FeatureObservation, Specification, describe, save_sb3
from pushplan.learned.network_policy import NetworkPolicy
from pushplan.world import InvalidInputError, UnknownNameError


def maze(**options):
    return PushEnv(**{"task": "maze", "observation": "state", **options})


class OneOfMany:
    """As a vector environment of Stable-Baselines3 in this process."""

    def __init__(self, *envs):
        self.envs = envs
        self.observation_space, self.action_space = envs[0].observation_space, envs[0].action_space


class Model:
    """What `save_sb3` asks of a model."""

    num_timesteps = 10

    def __init__(self, env):
        self.env = env

    def get_env(self):
        return self.env

    def save(self, path):
        path.write_bytes(b"")


Model.__name__, Model.__module__ = "PPO", "stable_baselines3.ppo.ppo"


class TestDescribe:
    def test_says_what_one_would_write_by_hand(self):
        facts = {"algorithm": "none"}
        assert describe(maze(), training=facts) == maze_specification()
        assert describe(maze(), training=facts, repeat=4).action.repeat == 4

    @pytest.mark.parametrize(
        ("task", "action", "shape"),
        [
            ("maze", "velocity", (2,)),
            ("box_delivery", "heading", (1,)),
            ("area_clearing", "waypoint", (2,)),
            ("ship_ice", "turn_rate", (1,)),
        ],
    )
    def test_what_it_says_fits_the_environment(self, task, action, shape):
        env = PushEnv(task=task, action=action, observation=FeatureObservation())
        found = Specification.from_json(describe(env).to_json())
        NetworkPolicy(np.zeros, found).check_environment(env)
        assert found.action.shape == shape and found.robot.difference(env.task.robot) is None
        assert found.observation == FeatureObservation()

    def test_wrappers_that_change_nothing_are_looked_through(self):
        made = gymnasium.make("pushplan/Maze-v0", boxes=2, observation="state")
        env = wrappers.TransformReward(wrappers.TimeLimit(made, 50), lambda reward: 0.1 * reward)
        assert describe(env) == describe(maze())
        assert describe(OneOfMany(env, maze())) == describe(maze())

    @pytest.mark.parametrize(
        ("wrap", "message"),
        [
            (wrappers.NormalizeObservation, "NormalizeObservation changes what a policy sees"),
            (lambda env: wrappers.RescaleAction(env, 0.0, 1.0), "RescaleAction changes"),
            (lambda env: wrappers.MaxAndSkipObservation(env, 4), "MaxAndSkip.* changes"),
            (
                lambda env: SimpleNamespace(venv=env, norm_obs=True),
                "SimpleNamespace changes what a policy sees",
            ),
            (
                lambda env: SimpleNamespace(env=env, action_space=gymnasium.spaces.Discrete(3)),
                r"action space Discrete\(3\), where .* needs shape \(1,\)",
            ),
            (
                lambda env: OneOfMany(env, maze(action="velocity")),
                "environments of a vector must have task, robot",
            ),
        ],
    )
    def test_what_would_be_wrong_is_refused(self, wrap, message):
        with pytest.raises(InvalidInputError, match=message):
            describe(wrap(maze()))

    def test_what_is_none_of_ours_is_refused(self):
        with pytest.raises(InvalidInputError, match=r"only environments of pushplan.*CartPoleEnv"):
            describe(gymnasium.make("CartPole-v1"))

    def test_a_builder_of_ones_own_is_refused(self):
        class Mine:
            shape, dtype, low, high = (2,), np.dtype(np.float32), -1.0, 1.0

            def observe(self, world):
                return np.zeros(2, np.float32)

        with pytest.raises(
            InvalidInputError, match="one of image, state, features, lidar, got Mine"
        ):
            describe(maze(observation=Mine()))

    def test_an_action_that_files_do_not_know_is_refused(self, monkeypatch):
        monkeypatch.setattr(PushEnv, "action_mode", "fly")
        with pytest.raises(UnknownNameError, match=r"fly.*turn_rate"):
            describe(maze())


class TestSaving:
    def test_the_specification_lies_beside_the_model(self, tmp_path):
        path = save_sb3(Model(maze()), tmp_path / "new" / "mine")
        assert path == tmp_path / "new" / "mine.zip" and path.is_file()
        found = Specification.from_json((tmp_path / "new" / "mine.pushplan.json").read_text())
        assert found == describe(maze(), training={"algorithm": "ppo", "steps": 10})

    def test_what_cannot_be_described_is_not_saved(self, tmp_path):
        model = Model(wrappers.NormalizeObservation(maze()))
        with pytest.raises(InvalidInputError, match="NormalizeObservation"):
            save_sb3(model, tmp_path / "mine.zip")
        with pytest.raises(InvalidInputError, match="has no environment, give one"):
            save_sb3(Model(None), tmp_path / "mine.zip")
        with pytest.raises(InvalidInputError, match=r"PPO, SAC, A2C.*got types.SimpleNamespace"):
            save_sb3(SimpleNamespace(get_env=maze), tmp_path / "mine.zip")
        assert list(tmp_path.iterdir()) == []
        assert save_sb3(Model(None), tmp_path / "mine.zip", env=maze()).is_file()


@pytest.mark.learn
@pytest.mark.slow
class TestTraining:
    def test_a_trained_model_is_a_policy_at_once(self, tmp_path, capsys, monkeypatch):
        from stable_baselines3 import PPO

        from pushplan.cli import main
        from pushplan.learned.sb3_policy import TRUST_VARIABLE
        from pushplan.training import specification_callback

        monkeypatch.setenv(TRUST_VARIABLE, "0")  # so that it is put back
        path = tmp_path / "model.zip"
        model = PPO("MlpPolicy", maze(), n_steps=32, batch_size=32, device="cpu")
        model.learn(32, callback=specification_callback(path))
        model.save(path)
        call = ["bench", "maze-2d-3", "--policies", f"sb3:{path}", "--episodes", "1"]
        out = ["--out", str(tmp_path / "bench"), "--workers", "1", "--trust-pickles"]
        assert main([*call, *out]) == 0
        assert "model" in capsys.readouterr().out

    def test_what_cannot_be_described_ends_the_training_before_it_begins(self, tmp_path):
        from stable_baselines3 import PPO
        from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv, VecNormalize

        from pushplan.training import specification_callback

        def learn(envs, **options):
            model = PPO("MlpPolicy", envs, n_steps=32, batch_size=32, device="cpu")
            model.learn(32, callback=specification_callback(tmp_path / "model.zip", **options))

        with pytest.raises(InvalidInputError, match="VecNormalize changes what a policy sees"):
            learn(VecNormalize(DummyVecEnv([maze])))
        processes = SubprocVecEnv([maze], start_method="forkserver")
        try:
            with pytest.raises(InvalidInputError, match="in this process, got SubprocVecEnv"):
                learn(processes)
            assert list(tmp_path.iterdir()) == []
            learn(processes, env=maze())
        finally:
            processes.close()
        rewards = VecNormalize(DummyVecEnv([maze]), norm_obs=False)
        learn(rewards)
        assert (tmp_path / "model.pushplan.json").is_file()
