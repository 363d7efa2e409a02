from __future__ import annotations

import json
import sys
import zipfile
from types import SimpleNamespace

import numpy as np
import pytest
from gymnasium.spaces import Box
from policy_files import maze_specification

from pushplan.cli import main
from pushplan.envs import PushEnv
from pushplan.evaluation import run_episode
from pushplan.evaluation.run.jobs import JobSettings
from pushplan.evaluation.run.policy_specs import as_policy
from pushplan.learned import ObjectPolicy, Sb3Policy
from pushplan.learned.sb3_policy import MEMBER, TRUST_VARIABLE, UntrustedError
from pushplan.scenarios import Scenario
from pushplan.world import InvalidInputError, MissingDependencyError

SCENARIO = Scenario("maze", "pymunk", "benchmark", {"boxes": 2}, 1000)


class Predictor:
    """As Stable-Baselines3 has them."""

    observation = "state"
    actions = ("turn_rate",)

    def __init__(self) -> None:
        self.calls: list[tuple[object, bool]] = []

    def predict(self, observation, state=None, deterministic=False):
        self.calls.append((state, deterministic))
        return np.array([0.1], np.float32), (state or 0) + 1


class TestObjects:
    def test_predict_is_a_policy(self):
        thing = Predictor()
        policy = as_policy(thing, "mine")
        assert isinstance(policy, ObjectPolicy)
        episode = run_episode(JobSettings().environment(SCENARIO, policy), policy, SCENARIO)
        assert np.allclose(episode.actions, 0.1)
        assert thing.calls[:3] == [(None, True), (1, True), (2, True)]

    def test_a_bare_predict_will_do(self):
        thing = SimpleNamespace(predict=lambda observation: [0.5])
        policy = ObjectPolicy(thing)
        policy.reset(None, np.random.default_rng(0))
        assert policy.act(None, np.zeros(3)).tolist() == [0.5]
        with pytest.raises(InvalidInputError, match="no method predict"):
            ObjectPolicy(object())

    def test_spaces_are_compared(self):
        thing = Predictor()
        thing.observation_space = Box(0, 255, (4, 96, 96), np.uint8)
        with pytest.raises(InvalidInputError, match=r"uint8 of shape \(4, 96, 96\), the env.*106"):
            JobSettings().environment(SCENARIO, as_policy(thing, "mine"))


@pytest.fixture
def model(tmp_path, monkeypatch):
    """What looks like a Stable-Baselines3 zip; loading it would be noticed."""
    monkeypatch.delenv(TRUST_VARIABLE, raising=False)
    path = tmp_path / "model.zip"
    text = maze_specification(training={"algorithm": "ppo"}).to_json()
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("data", "{}")
        archive.writestr(MEMBER, text)
    loaded = []
    fake = SimpleNamespace(
        PPO=SimpleNamespace(load=lambda path, device: loaded.append(path) or Predictor())
    )
    monkeypatch.setitem(sys.modules, "stable_baselines3", fake)
    return SimpleNamespace(path=path, loaded=loaded)


class TestSb3:
    def test_without_trust_nothing_is_loaded(self, model):
        with pytest.raises(UntrustedError, match=r"holds pickles.*--trust-pickles"):
            Sb3Policy(model.path)
        with pytest.raises(UntrustedError):
            Sb3Policy(model.path, trust=False)
        assert model.loaded == []

    def test_with_trust(self, model, monkeypatch, caplog):
        policy = Sb3Policy(model.path, trust=True)
        assert "this can run any code" in caplog.text
        assert policy.decide(np.zeros(106, np.float32)) == pytest.approx(0.1)
        monkeypatch.setenv(TRUST_VARIABLE, "1")
        Sb3Policy(model.path)
        assert len(model.loaded) == 2
        with pytest.raises(UntrustedError):
            Sb3Policy(model.path, trust=False)

    def test_the_command_line(self, model, monkeypatch, capsys):
        monkeypatch.setenv(TRUST_VARIABLE, "0")  # so that it is put back
        call = ["run", "--task", "maze", "--boxes", "2", "--policy", f"sb3:{model.path}"]
        assert main(call) == 2
        assert "--trust-pickles" in capsys.readouterr().err
        assert main([*call, "--trust-pickles"]) == 0
        assert "E_nav" in capsys.readouterr().out

    def test_without_the_library(self, model, monkeypatch):
        monkeypatch.setitem(sys.modules, "stable_baselines3", None)
        with pytest.raises(MissingDependencyError, match=r"pushplan\[train\]"):
            Sb3Policy(model.path, trust=True)

    def test_files_that_are_none(self, model, tmp_path):
        with pytest.raises(InvalidInputError, match="No such file"):
            Sb3Policy(tmp_path / "no.zip", trust=True)
        path = tmp_path / "bad.zip"
        for data in (b"", b"no zip", model.path.read_bytes()[:-30]):
            path.write_bytes(data)
            with pytest.raises(InvalidInputError, match="no readable zip"):
                Sb3Policy(path, trust=True)
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("data", "{}")
            archive.writestr(MEMBER, "{" + "x" * 1000)
            at = archive.getinfo(MEMBER).header_offset + 30 + len(MEMBER)
        damaged = bytearray(path.read_bytes())
        damaged[at] ^= 0xFF  # the first byte of the compressed stream
        path.write_bytes(bytes(damaged))
        with pytest.raises(InvalidInputError, match="no readable zip: error: Error -3"):
            Sb3Policy(path, trust=True)
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("other", "")
        with pytest.raises(InvalidInputError, match="no Stable-Baselines3 file"):
            Sb3Policy(path, trust=True)

    def test_a_specification_may_lie_beside_it(self, model, tmp_path):
        path = tmp_path / "plain.zip"
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("data", "{}")
        with pytest.raises(InvalidInputError, match=r"plain\.pushplan\.json"):
            Sb3Policy(path, trust=True)
        data = json.loads(maze_specification().to_json())
        beside = tmp_path / "plain.pushplan.json"
        beside.write_text(json.dumps(data))
        with pytest.raises(InvalidInputError, match=r"must be one of PPO.*got 'NONE'"):
            Sb3Policy(path, trust=True)
        beside.write_text(json.dumps({**data, "training": {"algorithm": "ppo"}}))
        policy = Sb3Policy(path, trust=True)
        env = PushEnv(task="maze", observation=policy.observation)
        seen, _ = env.reset(seed=0)
        assert policy.act(env.world, seen) == pytest.approx(0.1)
