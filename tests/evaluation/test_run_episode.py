from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest
from evaluation_doubles import Ahead, LineEnv, LineScenario, Nan, Raises, WrongShape

from pushplan.evaluation import InvalidActionError, Job, JobSettings, PolicyError, run_episode
from pushplan.evaluation.run.execute import execute
from pushplan.evaluation.run.policy_specs import PolicySpec
from pushplan.world import Episode, World


def test_an_episode_holds_every_pose_action_and_timing(tmp_path) -> None:
    scenario = LineScenario(4)
    episode = run_episode(LineEnv(scenario), Ahead(), scenario)
    assert episode.success and episode.reason == "goal"
    steps = len(episode.actions)
    assert episode.robot_poses.shape == (steps + 1, 3)
    assert episode.object_poses.shape == (steps + 1, 1, 3)
    assert len(episode.rewards) == len(episode.act_times_s) == steps
    assert (episode.act_times_s > 0.0).all()
    assert episode.about["scenario"] == scenario.to_dict()
    episode.save(tmp_path / "episode.npz")
    assert Episode.load(tmp_path / "episode.npz") == episode


def test_the_same_seed_gives_the_same_episode_and_another_seed_another() -> None:
    first, again, other = (
        run_episode(LineEnv(LineScenario(seed)), Ahead(), LineScenario(seed)) for seed in (1, 1, 2)
    )
    assert first == again
    assert not np.array_equal(first.robot_poses, other.robot_poses)


def test_an_observer_sees_the_start_and_every_step() -> None:
    seen: list[int] = []
    scenario = LineScenario(0)
    episode = run_episode(
        LineEnv(scenario), Ahead(), scenario, observer=lambda step, world, policy: seen.append(step)
    )
    assert seen == list(range(len(episode.actions) + 1))


def test_what_a_policy_does_wrong_has_a_name() -> None:
    scenario = LineScenario(0)
    with pytest.raises(PolicyError, match="ValueError: no idea") as raised:
        run_episode(LineEnv(scenario), Raises(), scenario)
    assert isinstance(raised.value.__cause__, ValueError)
    with pytest.raises(InvalidActionError, match="finite"):
        run_episode(LineEnv(scenario), Nan(), scenario)
    with pytest.raises(InvalidActionError, match=r"shape \(1,\)"):
        run_episode(LineEnv(scenario), WrongShape(), scenario)


class Dozes(Ahead):
    """Does nothing for a while before each decision."""

    def act(self, world: World, observation: Any) -> Any:
        time.sleep(0.02)
        return super().act(world, observation)


def test_the_clock_of_the_processor_stands_while_a_policy_waits() -> None:
    times = {}
    for clock in ("wall", "cpu"):
        settings = JobSettings(make_env="evaluation_doubles:make_env", clock=clock, dry_run=False)
        row = execute(Job(PolicySpec("dozes", Dozes), LineScenario(0)), settings).row
        times[clock] = row.decision_time_median_s
    assert 0.0 < times["cpu"] < 0.02 <= times["wall"]
