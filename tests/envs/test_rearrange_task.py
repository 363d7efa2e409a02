"""Rearrange as an environment, and its scores."""

from __future__ import annotations

import numpy as np
import pytest

from pushplan.envs import PushEnv
from pushplan.metrics import compute
from pushplan.world import Drive, Episode, ScenarioError


def env_of(**variations):
    env = PushEnv(task="rearrange", variations=variations, observation="state")
    env.reset(seed=1)
    return env


def test_progress_and_places_are_rewarded():
    env = env_of(objects=2)
    world = env.world
    poses = np.array(world.movables.poses)
    poses[0] = world.goal.poses[0]
    first = env.task.score(world, world.moved(movable_poses=poses), work=0.0, touched_static=False)
    assert first.completed.tolist() == [True, False]
    assert not first.terminated
    assert first.reward > 10.0
    poses[1] = world.goal.poses[1]
    last = env.task.score(world, world.moved(movable_poses=poses), work=0.0, touched_static=False)
    assert (last.terminated, last.success, last.reason) == (True, True, "done")
    assert last.reward == pytest.approx(150.0 + 2 * 10.0 + 200.0)


def test_scores_go_by_the_own_places():
    world = env_of(objects=2, obstacles=1).world
    start = np.array(world.movables.poses)
    end = start.copy()
    end[0] = world.goal.poses[0]
    episode = Episode(
        world=world,
        times=[0.0, 1.0],
        robot_poses=[world.robot_pose, world.robot_pose],
        object_poses=[start, end],
        success=False,
        reason="",
        completed=[True, False, True],
    )
    scores = compute(episode, ("S_manip", "I_manip", "place_error_m", "heading_error_rad"))
    assert scores["S_manip"] == 0.5
    assert scores["I_manip"] == pytest.approx(1.0, abs=0.05)
    missed = np.hypot(*(start[1] - world.goal.poses[1])[:2])
    assert scores["place_error_m"] == pytest.approx(0.5 * missed)


@pytest.mark.parametrize(("simulator", "preset"), [("pymunk", "benchmark"), ("mujoco", "testbed")])
def test_a_car_stays_one(simulator, preset):
    options = {"task": "rearrange", "simulator": simulator, "preset": preset}
    variations = {"robot": "racecar", "objects": 1, "room": 5.0}
    env = PushEnv(**options, variations=variations, observation="state")
    env.reset(seed=1)
    robot = env.world.robot
    assert (robot.name, robot.drive) == ("racecar", Drive.CAR)
    start = env.world.robot_pose
    env.step(np.array([0.0, 1.0]))
    moved = env.world.robot_pose - start
    assert np.abs(moved).max() < 0.01  # it does not turn on the spot
    with pytest.raises(ScenarioError, match="bumper 'pusher' does not fit"):
        PushEnv(**options, variations={**variations, "bumper": "pusher"})


def test_friction_and_masses_may_be_off_without_being_told():
    calm = env_of(objects=2)
    env = env_of(objects=2, mass_scale=2.0, parameters="unknown", bumper_friction=0.8)
    assert env.true_world.movables.masses == pytest.approx(2.0 * calm.world.movables.masses)
    assert env.world.movables.masses == pytest.approx(calm.world.movables.masses)
    assert env.task.materials.robot_object == 0.8
