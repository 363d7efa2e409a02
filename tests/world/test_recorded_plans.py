"""What a policy meant to do, kept beside what happened."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pushplan.envs import make
from pushplan.evaluation import run_episode
from pushplan.planners import make_policy
from pushplan.scenarios import suite
from pushplan.world import Episode, InvalidInputError, Plan, SchemaError
from pushplan.world.stored.recorded_plans import PlanRecorder, RecordedPlans


def plan(shift: float, count: int = 200) -> Plan:
    """Straight ahead for 10 m; the second of three objects is shifted."""
    along = np.linspace(0.0, 10.0, count)
    objects = np.zeros((count, 3, 3))
    objects[:, 1, 0] = shift * np.linspace(0.0, 1.0, count)
    poses = np.column_stack([along, np.zeros((count, 2))])
    return Plan(along, poses, np.ones(count), np.zeros(count), 10.0, object_poses=objects)


def test_a_recorder_keeps_ends_of_paths_and_what_moves() -> None:
    recorder = PlanRecorder(np.array([4, 9, 7]))
    first, second = plan(2.0), plan(0.0)
    for time, one in [(0.0, None), (1.0, first), (2.0, first), (3.0, second), (4.0, first)]:
        recorder.note(time, np.array([7, 9, 4]), one)
    plans = recorder.recorded()
    assert plans.times.tolist() == [1.0, 3.0, 4.0]
    assert np.array_equal(plans.path(0)[[0, -1]], first.poses[[0, -1]])
    assert 2 < len(plans.path(0)) < 100
    moved, ends = plans.expected(0)
    assert moved.tolist() == [1] and ends.tolist() == [[2.0, 0.0, 0.0]]
    assert [len(part) for part in plans.expected(1)] == [0, 0]


def test_a_prediction_of_other_objects_is_left_out() -> None:
    recorder = PlanRecorder(np.array([4, 9, 7]))
    recorder.note(0.0, np.array([4, 9]), plan(2.0))  # one was delivered meanwhile
    recorder.note(1.0, np.array([4, 1, 7]), plan(3.0))  # one that the episode does not have
    assert len(recorder.recorded().moved) == 0 and len(recorder.recorded()) == 2


def test_very_many_plans_are_thinned_evenly() -> None:
    recorder = PlanRecorder(np.array([4, 9, 7]))
    for k in range(2501):
        recorder.note(float(k), np.array([4, 9, 7]), plan(0.0, count=2))
    times = recorder.recorded().times
    assert 1000 < len(times) <= 2000 and times[0] == 0.0
    assert len(set(np.diff(times))) == 1


@pytest.mark.parametrize(
    ("changes", "rule"),
    [
        ({"times": [2.0, 1.0]}, "not decrease"),
        ({"offsets": [0, 1]}, "3 numbers that rise from 0 to 2"),
        ({"offsets": [0, 5, 2]}, "rise"),
        ({"moved": [-1]}, "negative"),
        ({"moved_poses": [[np.nan, 0.0, 0.0]]}, "finite"),
        ({"paths": np.zeros((2, 2))}, "shape"),
    ],
)
def test_wrong_plans_are_refused(changes: dict[str, object], rule: str) -> None:
    good = {
        "times": [0.0, 1.0],
        "offsets": [0, 1, 2],
        "paths": np.zeros((2, 3)),
        "moved_offsets": [0, 1, 1],
        "moved": [0],
        "moved_poses": np.zeros((1, 3)),
    }
    RecordedPlans(**good)  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match=rule):
        RecordedPlans(**{**good, **changes})  # type: ignore[arg-type]


def test_an_episode_keeps_its_plans_through_a_file(tmp_path: Path) -> None:
    (scenario,) = suite("maze-2d-5", episodes=1).scenarios
    env = make(scenario)
    episode = run_episode(env, make_policy("push-aware"), scenario)
    plans = episode.plans
    assert plans is not None and len(plans) > 0 and len(plans.moved) > 0
    assert np.allclose(plans.path(0)[0], episode.world.robot_pose)
    episode.save(tmp_path / "one.npz")
    again = Episode.load(tmp_path / "one.npz")
    assert again == episode and again.plans == plans
    replace(episode, plans=None).save(tmp_path / "bare.npz")
    assert Episode.load(tmp_path / "bare.npz").plans is None
    part = dict(np.load(tmp_path / "one.npz"))
    part.pop("plans_moved")
    np.savez(tmp_path / "part.npz", **part)
    with pytest.raises(SchemaError, match="moved"):
        Episode.load(tmp_path / "part.npz")
    with pytest.raises(InvalidInputError, match="indices of"):
        replace(episode, plans=replace(plans, moved=plans.moved + 5))
