import gc
import resource
import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from pushplan.envs import EpisodeOverError, PushEnv, make
from pushplan.envs.registry import GYM_IDS, TASKS
from pushplan.scenarios import Scenario
from pushplan.world import (
    InvalidInputError,
    MissingDependencyError,
    ScenarioError,
    Twist,
    UnknownNameError,
    WheelSpeeds,
    stream,
)

MAZE = "pushplan/Maze-v0"


def rollout(env, seed, steps=15):
    """Everything that an episode shows, as bytes and numbers."""
    observation, info = env.reset(seed=seed)
    shown = [observation.tobytes(), sorted(info.items()), env.unwrapped.world]
    rng = np.random.default_rng(seed)
    for _ in range(steps):
        action = rng.uniform(-1, 1, env.action_space.shape).astype(np.float32)
        observation, reward, terminated, truncated, info = env.step(action)
        shown += [observation.tobytes(), reward, terminated, truncated, sorted(info.items())]
        shown += [env.unwrapped.world, env.unwrapped.trace]
        if terminated or truncated:
            break
    return shown


@pytest.mark.parametrize(
    ("observation", "action", "preset", "shape"),
    [
        ("image", "turn_rate", "benchmark", "u"),
        ("image", "wheels", "testbed", "z"),
        ("image", "velocity", "benchmark", "z"),
        ("state", "turn_rate", "testbed", "z"),
        ("state", "wheels", "benchmark", "u"),
        ("state", "velocity", "testbed", "u"),
    ],
)
@pytest.mark.slow
def test_check_env_passes_without_a_warning(observation, action, preset, shape):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make(
            MAZE, preset=preset, observation=observation, action=action, shape=shape
        )
        check_env(env.unwrapped)
    env.close()


def test_every_task_has_an_id():
    assert set(GYM_IDS.values()) == set(TASKS)
    assert all(gym_id in gymnasium.registry for gym_id in GYM_IDS)


def run_python(code):
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_registration_is_cheap():
    code = (
        "import sys, pushplan.envs, gymnasium\n"
        "print('pushplan/Maze-v0' in gymnasium.registry)\n"
        "print([m for m in ('pymunk', 'scipy', 'PIL', 'shapely') if m in sys.modules])"
    )
    assert run_python(code).split("\n") == ["True", "[]"]


@pytest.mark.parametrize("observation", ["image", "state"])
def test_same_seed_same_bytes_whatever_came_before(observation):
    kwargs = {"observation": observation, "boxes": 8, "wheeled": 0.5}
    one, other = gymnasium.make(MAZE, **kwargs), gymnasium.make(MAZE, **kwargs)
    first = rollout(one, 5)
    rollout(one, 6, steps=3)
    assert rollout(one, 5) == first
    other.reset(seed=9)
    assert rollout(other, 5) == first
    assert rollout(one, 6) != first


@pytest.mark.slow
def test_same_bytes_in_another_process():
    code = (
        "import hashlib, gymnasium, pushplan.envs, numpy as np\n"
        "env = gymnasium.make('pushplan/Maze-v0', boxes=8)\n"
        "digest = hashlib.sha256(env.reset(seed=3)[0].tobytes())\n"
        "for i in range(20):\n"
        "    digest.update(env.step(np.array([np.sin(i)], np.float32))[0].tobytes())\n"
        "digest.update(env.unwrapped.world.movables.poses.tobytes())\n"
        "print(digest.hexdigest())"
    )
    assert run_python(code) == run_python(code) != ""


def test_unseeded_resets_continue_the_sequence():
    one, other = gymnasium.make(MAZE), gymnasium.make(MAZE)
    worlds = []
    for env in (one, other):
        env.reset(seed=1)
        worlds.append([])
        for _ in range(3):
            env.reset()
            worlds[-1].append(env.unwrapped.world)
    assert worlds[0] == worlds[1]
    assert len(set(worlds[0])) == 3


def test_instances_share_no_state():
    one, other = gymnasium.make(MAZE), gymnasium.make(MAZE)
    alone = rollout(one, 2)
    one.reset(seed=2)
    other.reset(seed=3)
    together = [one.unwrapped.world]
    rng = np.random.default_rng(2)
    for _ in range(15):
        action = rng.uniform(-1, 1, (1,)).astype(np.float32)
        one.step(action)
        together.append(one.unwrapped.world)
        other.step(-action)
    assert together[-1] == alone[-2]


def test_a_scenario_is_what_its_seed_says():
    scenario = Scenario("maze", variations={"boxes": 4, "shape": "z"}, seed=11)
    env = make(scenario, observation="state")
    env.reset()
    world = env.world
    assert world == env.task.start(stream(11, "layout"))
    env.reset()
    assert env.world != world
    env.reset(seed=11)
    assert env.world == world


def test_trace_joins_the_worlds_of_an_episode():
    env = make(Scenario("maze", seed=1), observation="state")
    env.reset()
    assert env.trace.times.tolist() == [0.0]
    np.testing.assert_array_equal(env.trace.robot_poses[0], env.world.robot_pose)
    times = [0.0]
    for i in range(30):
        before = env.world
        *_, info = env.step(np.array([np.sin(i)]))
        trace = env.trace
        times += trace.times.tolist()
        np.testing.assert_array_equal(trace.robot_poses[-1], env.world.robot_pose)
        np.testing.assert_array_equal(trace.object_poses[-1], env.world.movables.poses)
        assert trace.times[-1] == env.world.time
        lengths = trace.object_lengths(before.movables.poses)
        assert info["work"] == pytest.approx(before.movables.masses @ lengths)
    assert (np.diff(times) > 0).all()
    assert env.world.time == pytest.approx(30 * 0.8)


def drive_until_over(env, action):
    env.reset(seed=0)
    for _ in range(3000):
        *_, reward, terminated, truncated, info = env.step(action)
        if terminated or truncated:
            return reward, terminated, truncated, info
    raise AssertionError("the episode has no end")


def test_wall_ends_the_episode_and_stepping_on_is_an_error():
    env = make(Scenario("maze", variations={"boxes": 0}), observation="state")
    with pytest.raises(EpisodeOverError, match="call reset"):
        env.step(np.zeros(1))
    with pytest.raises(EpisodeOverError):
        _ = env.world
    reward, terminated, truncated, info = drive_until_over(env, np.zeros(1))
    assert terminated and not truncated and reward < -40.0
    assert info["reason"] == "wall" and info["success"] is False
    with pytest.raises(EpisodeOverError, match=r"ended \(wall\): call reset\(\)"):
        env.step(np.zeros(1))
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.zeros(1))
    env.reset()
    env.step(np.zeros(1))


def test_time_limit_is_the_environments_own():
    scenario = Scenario("maze", variations={"boxes": 0})
    env = make(scenario, observation="state", action="velocity")
    _, terminated, truncated, info = drive_until_over(env, np.zeros(2))
    assert truncated and not terminated and info["reason"] == "time_limit"
    assert env.world.time == pytest.approx(400 * 0.8)


def test_goal_can_be_reached():
    """A hand-written way through the U: up, left over the wall, down, by turning on the spot."""
    env = make(Scenario("maze", variations={"boxes": 0}), observation="state", action="velocity")
    env.reset()
    for x, y in ((11.25, 12.25), (3.75, 12.25), (3.75, 3.75)):
        while np.hypot(x - env.world.robot_pose[0], y - env.world.robot_pose[1]) > 0.2:
            px, py, theta = env.world.robot_pose
            error = np.arctan2(y - py, x - px) - theta
            error = (error + np.pi) % (2 * np.pi) - np.pi
            twist = Twist(0.15 if abs(error) < 0.1 else 0.0, np.clip(error, -0.105, 0.105))
            _, reward, terminated, _, info = env.step(env.encode(twist))
            if terminated:
                assert info["success"] is True and info["reason"] == "goal" and reward > 199
                return
    raise AssertionError("the goal was not reached")


def test_encode_inverts_the_action_modes():
    env = make(Scenario("maze"), observation="state")
    assert env.encode(Twist(0.15, 0.0525)) == pytest.approx([0.5])
    assert env.encode(Twist(0.15, 9.0)) == pytest.approx([1.0])
    assert env.encode(np.array([-3.0])) == pytest.approx([-1.0])
    assert env.encode(WheelSpeeds(0.1, 0.2)) == pytest.approx([0.1 / 0.105])
    assert env.encode(Twist(0.15, 0.1)) in env.action_space


def test_actions_beyond_the_bounds_are_clipped():
    env = make(Scenario("maze"), observation="state")
    env.reset()
    env.step(np.array([50.0]))
    assert env.world.robot_pose[2] == pytest.approx(np.pi / 2 + 0.8 * 0.105)


def test_bad_actions_are_refused():
    env = make(Scenario("maze"), observation="state")
    env.reset()
    for bad in (np.array([np.nan]), np.array([np.inf]), np.zeros(2), "left"):
        with pytest.raises(InvalidInputError, match="action must"):
            env.step(bad)
    env.step(np.zeros(1))  # a refused action does no harm


@pytest.mark.parametrize(
    ("kwargs", "error", "text"),
    [
        ({"simulator": "pymnk"}, UnknownNameError, "did you mean 'pymunk'"),
        ({"preset": "testbd"}, UnknownNameError, "did you mean 'testbed'"),
        ({"observation": "images"}, UnknownNameError, "did you mean 'image'"),
        ({"action": "wheel"}, UnknownNameError, "did you mean 'wheels'"),
        ({"render_mode": "rgb"}, UnknownNameError, "rgb_array"),
        ({"boxs": 3}, UnknownNameError, "did you mean 'boxes'"),
        ({"boxes": "many"}, ScenarioError, "boxes"),
    ],
)
def test_bad_arguments_name_the_nearest(kwargs, error, text):
    with pytest.raises(error, match=text):
        gymnasium.make(MAZE, **kwargs)
    with pytest.raises(UnknownNameError, match="did you mean 'maze'"):
        PushEnv(task="mase")
    with pytest.raises(ScenarioError, match="300 boxes"):
        gymnasium.make(MAZE, boxes=300).reset(seed=0)


@pytest.mark.parametrize("vector", ["sync", "async"])
def test_vector_environments(vector):
    envs = gymnasium.make_vec(MAZE, num_envs=2, vectorization_mode=vector, observation="state")
    single = gymnasium.make(MAZE, observation="state")
    observations, _ = envs.reset(seed=[3, 4])
    actions = np.array([[0.2], [-0.4]], dtype=np.float32)
    stepped = envs.step(actions)
    for i, seed in enumerate((3, 4)):
        np.testing.assert_array_equal(single.reset(seed=seed)[0], observations[i])
        observation, reward, *_, info = single.step(actions[i])
        np.testing.assert_array_equal(observation, stepped[0][i])
        assert reward == stepped[1][i]
        assert info["success"] == stepped[4]["success"][i]
    envs.close()


@pytest.mark.slow
def test_many_resets_leak_nothing():
    """Neither Python objects nor memory of the engine, which the peak size of the process shows."""
    env = make(Scenario("maze", variations={"boxes": 3}), observation="state")
    objects, peaks = [], []
    for i in range(1000):
        env.reset(seed=i)
        env.step(np.zeros(1))
        if i in (300, 999):
            gc.collect()
            objects.append(len(gc.get_objects()))
            peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    assert objects[1] - objects[0] < 200
    assert peaks[1] - peaks[0] < 4000  # kB; 700 scenes of some 20 kB each would be 14,000


def test_render_and_close():
    env = gymnasium.make(MAZE, render_mode="rgb_array")
    env.reset(seed=0)
    frame = env.render()
    assert frame.dtype == np.uint8 and frame.ndim == 3 and frame.shape[2] == 3
    env.close()
    env.close()


def test_window_without_a_display_is_a_clear_error(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    if not sys.platform.startswith("linux"):
        pytest.skip("displays are found out about on Linux only")
    with pytest.raises(MissingDependencyError, match="rgb_array"):
        make(Scenario("maze"), render_mode="human")
