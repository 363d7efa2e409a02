"""Environments in worker processes: the same as in this one, for any number of workers."""

import os
import signal
import subprocess
import sys
from functools import partial

import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from pushplan.envs import VectorWorkerError, WorkerVectorEnv, make, make_vector
from pushplan.scenarios import Scenario
from pushplan.world import InvalidInputError, ScenarioError, UnknownNameError

MAZE = Scenario("maze", variations={"boxes": 3, "time_limit": 4.0})
CLEARING = Scenario("area_clearing", variations={"boxes": 2, "idle_limit": 3})


@pytest.fixture(scope="module")
def shared():
    """Three environments in two workers; each test leaves them without a request."""
    envs = make_vector(MAZE, 3, workers=2, observation="state")
    yield envs
    envs.close()


def process_of(envs, n):
    return envs._pools[n].submit(os.getpid).result()


def episodes(envs, steps=9):
    """All that some steps return, with resets on the way."""
    envs.action_space.seed(3)
    seen = [envs.reset(seed=5)]
    for _ in range(steps):
        seen.append(envs.step(envs.action_space.sample()))
    envs.close()
    return seen


@pytest.mark.parametrize(
    ("scenario", "observation", "mode"),
    [
        (MAZE, "image", AutoresetMode.SAME_STEP),
        pytest.param(CLEARING, "state", AutoresetMode.NEXT_STEP, marks=pytest.mark.slow),
    ],
)
def test_the_same_as_in_one_process(scenario, observation, mode):
    one = partial(make, scenario, observation=observation)
    here = episodes(SyncVectorEnv([one] * 3, autoreset_mode=mode))
    options = {"observation": observation, "autoreset_mode": mode}
    there = episodes(make_vector(scenario, 3, workers=2, **options))
    assert data_equivalence(here, there, exact=True)
    assert any(step[3].any() for step in here[1:])  # episodes end, and others begin


@pytest.mark.slow
def test_workers_that_do_not_wait_run_the_same_episodes_without_copies():
    envs = make_vector(MAZE, 3, workers=2, observation="state", copy=False)
    check_that_nobody_waits(envs)
    envs.close()


def test_workers_that_do_not_wait_for_each_other_run_the_same_episodes(shared):
    check_that_nobody_waits(shared)


def check_that_nobody_waits(workers):
    one, steps, count = partial(make, MAZE, observation="state"), 9, 3
    actions = np.random.default_rng(0).uniform(-1, 1, (steps, count, 1)).astype(np.float32)
    envs = SyncVectorEnv([one] * count)
    here = [[envs.reset(seed=5)[0][i]] for i in range(count)]
    for action in actions:
        observations, rewards, terminated, truncated, _ = envs.step(action)
        for i in range(count):
            here[i].append((observations[i], rewards[i], terminated[i], truncated[i]))
    envs.close()
    envs = workers
    envs.async_reset(seed=5)
    there, owed = [[] for _ in range(count)], 2
    while owed:
        observations, rewards, terminated, truncated, infos = envs.recv()
        owed -= 1
        batch = infos["env_id"]
        for n, i in enumerate(batch):
            seen = observations[n].copy()
            row = (seen, rewards[n], terminated[n], truncated[n])
            there[i].append(row if there[i] else seen)
        done = len(there[batch[0]]) - 1
        if done < steps:
            envs.send(actions[done, batch], batch)
            owed += 1
    assert data_equivalence(here, there, exact=True)


def test_requests_out_of_turn_are_refused(shared):
    envs = shared
    with pytest.raises(InvalidInputError, match=r"call async_reset\(\) or send\(\)"):
        envs.recv()
    envs.async_reset(seed=0)
    for request in (envs.reset, envs.async_reset, lambda: envs.step(envs.action_space.sample())):
        with pytest.raises(InvalidInputError, match=r"busy: call recv\(\) 2 times first"):
            request()
    *_, infos = envs.recv()
    batch = infos["env_id"]
    actions = np.zeros((len(batch), 1), dtype=np.float32)
    for wrong in ([0, 1, 2], [7], 0, batch + 0.5, []):
        with pytest.raises(InvalidInputError, match="0 to 0, 1 to 2"):
            envs.send(actions, wrong)
    with pytest.raises(InvalidInputError, match="actions must be one for each"):
        envs.send(np.zeros((5, 1), dtype=np.float32), batch)
    envs.send(actions, batch)
    with pytest.raises(InvalidInputError, match="are still busy"):
        envs.send(actions, batch)
    envs.recv()
    envs.recv()
    assert envs.step(envs.action_space.sample())[1].shape == (3,)


@pytest.mark.parametrize("waits", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_a_worker_that_is_killed_is_named(waits):
    envs = make_vector(MAZE, 3, workers=2, observation="state")
    envs.reset(seed=0)
    process = process_of(envs, 1)
    if not waits:
        envs.async_reset(seed=0)
    os.kill(process, signal.SIGKILL)
    with pytest.raises(VectorWorkerError, match="environments 1 to 2 has ended"):
        if waits:
            envs.step(envs.action_space.sample())
        for _ in range(2):
            envs.recv()
    envs.close()
    for request in (envs.recv, envs.reset):
        with pytest.raises(InvalidInputError, match="closed"):
            request()


@pytest.mark.slow
def test_a_mask_resets_some_of_them():
    envs = make_vector(MAZE, 3, workers=2, observation="state", autoreset_mode="Disabled")
    first, _ = envs.reset(seed=1)
    mask = np.array([False, True, True])
    second, infos = envs.reset(seed=[7, 8, 9], options={"reset_mask": mask})
    alone = make(MAZE, observation="state")
    np.testing.assert_array_equal(second[0], first[0])
    np.testing.assert_array_equal(second[2], alone.reset(seed=9)[0])
    assert all((infos[key] == mask).all() for key in infos if key.startswith("_"))
    assert envs.get_attr("render_mode") == (None,) * 3
    envs.set_attr("note", [1, 2, 3])
    assert envs.get_attr("note") == (1, 2, 3)
    envs.close()


@pytest.mark.slow
def test_observations_stay_unless_that_is_not_wanted():
    for copy in (True, False):
        envs = make_vector(MAZE, 2, workers=1, observation="state", copy=copy)
        before, _ = envs.reset(seed=0)
        kept = before.copy()
        envs.step(envs.action_space.sample())
        assert np.array_equal(before, kept) is copy
        envs.close()


def test_errors_of_a_worker_arrive_here_and_harm_nothing(shared):
    envs = shared
    envs.reset(seed=0)
    with pytest.raises(AttributeError, match="nonsense"):
        envs.call("nonsense")
    for unreadable in (lambda: None, [1, 2, lambda: None]):
        with pytest.raises(InvalidInputError, match="set_attr: a value cannot be sent to a worker"):
            envs.set_attr("note", unreadable)
        with pytest.raises(InvalidInputError, match="call: a value cannot be sent to a worker"):
            envs.call("close", unreadable)
    envs.set_attr("note", [1, 2, 3])
    assert envs.get_attr("note") == (1, 2, 3)  # answers are those of this request
    with pytest.raises(InvalidInputError, match="reset_mask must be of dtype bool"):
        envs.reset(options={"reset_mask": np.zeros(3, dtype=bool)})
    assert envs.step(envs.action_space.sample())[1].shape == (3,)
    for seed in ([1], [1, 2, 3, 4]):
        with pytest.raises(InvalidInputError, match="seed must have one value for each"):
            envs.reset(seed=seed)


def test_a_script_without_its_guard_is_told_the_remedy(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "from pushplan.envs import make_vector\n"
        "from pushplan.scenarios import Scenario\n"
        "make_vector(Scenario('maze', variations={'boxes': 3}), 2, workers=2)\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=120)
    assert done.returncode == 1 and not done.stdout
    *_, last = lines = done.stderr.splitlines()
    assert "VectorWorkerError" in last and "under `if __name__ == '__main__':`" in last
    assert len(lines) < 20 and done.stderr.count("Traceback") == 1, done.stderr


def test_what_makes_no_sense_is_refused():
    with pytest.raises(InvalidInputError, match="num_envs"):
        make_vector(MAZE, 0)
    with pytest.raises(InvalidInputError, match="workers"):
        make_vector(MAZE, 2, workers=3)
    with pytest.raises(InvalidInputError, match="at least one environment"):
        WorkerVectorEnv([], workers=1)
    with pytest.raises(ScenarioError):
        make_vector(Scenario("maze", variations={"boxes": -1}), 2)
    with pytest.raises(UnknownNameError, match="Disabled, NextStep, SameStep"):
        make_vector(MAZE, 2, autoreset_mode="never")
