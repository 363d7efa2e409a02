"""Environments in which a robot knows what it has seen, in both simulators."""

from __future__ import annotations

import numpy as np
import pytest

from pushplan.envs import PushEnv
from pushplan.envs.sensing import SimulatedSensing
from pushplan.perception import LidarObservation
from pushplan.training.policies.config import TrainingConfig
from pushplan.training.policies.environment import TrainingEnv
from pushplan.world import ScenarioError

SCENES = [
    ("maze", "pymunk", {"boxes": 10, "sensing": "lidar"}),
    ("maze", "mujoco", {"boxes": 6, "sensing": "lidar"}),
    ("area_clearing", "pymunk", {"boxes": 10, "sensing": "objects", "view_range": 3.0}),
]
NOISE = {"range_noise": 0.02, "object_noise": 0.02, "turn_noise": 0.05, "drop_out": 0.2}


def episode(task: str, simulator: str, variations: dict, steps: int = 6) -> list[bytes]:
    """Bytes of all that is known in an episode of straight driving."""
    env = PushEnv(task=task, simulator=simulator, variations=variations, observation="state")
    env.reset(seed=5)
    known = []
    for _ in range(steps):
        env.step(np.full(env.action_space.shape, 0.3))
        world = env.world
        corners, _ = world.static.packed
        known += [corners.tobytes(), world.movables.poses.tobytes(), world.unseen.cells.tobytes()]
    return known


@pytest.mark.parametrize(("task", "simulator", "variations"), SCENES)
def test_less_is_known_than_there_is(task, simulator, variations):
    env = PushEnv(task=task, simulator=simulator, variations=variations, observation="state")
    env.reset(seed=3)
    known, true = env.world, env.true_world
    assert len(known.movables) < len(true.movables) or simulator == "mujoco"
    rows = np.isin(true.movables.ids, known.movables.ids)
    np.testing.assert_allclose(known.movables.poses, true.movables.poses[rows], atol=1e-9)
    assert known.unseen is not None and 0.05 < known.unseen.cells.mean() < 0.95
    assert (known.static == true.static) == (variations["sensing"] == "objects")
    np.testing.assert_array_equal(known.robot_pose, true.robot_pose)


@pytest.mark.parametrize(("task", "simulator", "variations"), SCENES)
def test_the_same_seed_sees_the_same(task, simulator, variations):
    noisy = {**variations, **NOISE}
    first = episode(task, simulator, noisy)
    assert first == episode(task, simulator, noisy)
    assert first != episode(task, simulator, {**noisy, "range_noise": 0.03, "object_noise": 0.03})


def test_noise_without_sensors_is_refused():
    for name in ("object_noise", "range_noise", "turn_noise", "drop_out", "view_rate"):
        with pytest.raises(ScenarioError, match=f"{name} 0.1 belongs to a robot with sensors"):
            PushEnv(task="maze", variations={name: 0.1})


def test_a_long_action_looks_in_each_control_step(monkeypatch):
    looked = []
    look = SimulatedSensing.look
    monkeypatch.setattr(
        SimulatedSensing, "look", lambda self, *given: (looked.append(1), look(self, *given))
    )
    env = PushEnv(task="box_delivery", action="heading", variations={"sensing": "objects"})
    env.reset(seed=1)
    before = env.world.time
    env.step(np.array([0.9]))
    steps = (env.world.time - before) / env.task.control_step
    assert steps > 3 and len(looked) == pytest.approx(1 + steps, abs=1.01)


def test_rate_and_delay_hold_readings_back():
    options = {"boxes": 10, "sensing": "lidar"}
    for change, steps in (({"view_rate": 0.4}, 3), ({"view_delay": 1.7}, 2)):
        env = PushEnv(task="maze", variations={**options, **change}, observation="state")
        env.reset(seed=3)
        first = env.world.unseen
        for _ in range(steps):  # of 0.8 s
            env.step(np.array([0.0]))
            assert env.world.unseen == first
        for _ in range(2):
            env.step(np.array([0.0]))
        assert env.world.unseen != first


def test_a_lidar_observation_is_the_scan_of_the_scene():
    env = PushEnv(task="maze", observation="lidar", variations={"view_range": 8.0})
    observation, _ = env.reset(seed=3)
    assert env.observation_space.contains(observation) and observation.shape == (184,)
    nearest = observation[:180].min() * 8.0
    world = env.true_world
    corners = np.concatenate([*world.movables.every_part_world, world.static.packed[0]])
    assert 0.0 < nearest <= np.hypot(*(corners - world.robot_pose[:2]).T).min() + 0.02


@pytest.mark.parametrize(("simulator", "beams"), [("pymunk", 72), ("mujoco", 72), ("pymunk", 1000)])
def test_scans_with_and_without_an_estimate_are_alike(simulator, beams):
    seen = []
    for sensing in ("full", "lidar"):
        env = PushEnv(
            task="maze",
            simulator=simulator,
            observation=LidarObservation(beams=beams, range=1.5),
            variations={"sensing": sensing},
        )
        seen += [env.reset(seed=3)[0], env.step(np.full(env.action_space.shape, 0.3))[0]]
    np.testing.assert_allclose(seen[:2], seen[2:], atol=1e-6)
    assert 0.0 < seen[0][:beams].min() < 1.0


def test_a_training_sees_the_noise_of_the_lidar():
    scenario = {"sensing": "lidar", "drop_out": 1.0}
    config = TrainingConfig.from_dict(
        {
            "algorithm": "ppo",
            "task": "maze",
            "scenarios": [scenario],
            "observation": {"kind": "lidar", "beams": 72},
            "action": {"mode": "turn_rate"},
        }
    )
    env = TrainingEnv(config)
    for seen in (env.reset(seed=0)[0], env.step(np.zeros(1))[0]):
        np.testing.assert_array_equal(seen[:72], 1.0)
    env.close()
