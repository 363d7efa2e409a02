"""What every environment of the registry has to keep, whatever its task and simulator."""

import functools
import gc
import itertools
import resource
import subprocess
import sys
import warnings

import numpy as np
import pytest
from gymnasium.spaces import Box
from gymnasium.utils.env_checker import check_env

from pushplan.envs import PushEnv
from pushplan.envs import make as make_scenario
from pushplan.envs.registry import ACTIONS, SIMULATORS, TASKS
from pushplan.envs.tasks.base import drive_of
from pushplan.imports.on_demand import look_up
from pushplan.scenarios import suite, suite_names
from pushplan.world import Drive, GoalDisc

LAYOUTS = {
    "maze": [
        {"shape": "z", "wheeled": 0.4},
        {"boxes": 0},
        {"bumper_friction": 0.3, "touching": True},
    ],
    "namo": [{"layout": "fixed", "movability": "wrong"}, {"layout": "squeeze", "box_size": 0.15}],
    "ship_ice": [{"concentration": 0.0}, {"concentration": 0.5, "time_limit": 8.0}],
    "box_delivery": [
        {"layout": name} for name in ("small_columns", "large_columns", "large_divider")
    ],
    "area_clearing": [
        {"layout": name, "touching": True, "idle_limit": 30.0}
        for name in ("clear_small", "walled", "walled_with_columns")
    ],
    "room": [{"spread": 0.2}, {"max_speed": 0.1, "control_step": 0.05}],
    "rearrange": [
        {"objects": 2, "arrangement": "swapped"},
        {"objects": 1, "shape": "t", "obstacles": 1, "room": 2.0},
    ],
    "office": [{"polygons": 200, "boxes": 0.0}, {"polygons": 300, "bumper": "pusher"}],
}


def worlds():
    """(task, simulator, preset) of everything that exists."""
    for task in TASKS:
        kind = look_up("task", TASKS, task)
        for simulator in SIMULATORS:
            engine = look_up("simulator", SIMULATORS, simulator)
            for preset in kind.solid_presets if engine.needs_solids else kind.presets:
                yield task, simulator, preset


def combinations():
    for task, simulator, preset in worlds():
        kind = look_up("task", TASKS, task)
        for action in kind.actions:
            for observation in kind.observations:
                yield task, simulator, preset, action, observation


def pairwise(rows):
    """Few of the rows that hold each pair of values that any of them holds, greedily."""

    def pairs(row):
        return set(itertools.combinations(enumerate(row), 2))

    missing, chosen = set().union(*map(pairs, rows)), []
    while missing:
        chosen.append(max(rows, key=lambda row: len(pairs(row) & missing)))
        missing -= pairs(chosen[-1])
    return chosen


ALL = list(combinations())
SOME = pairwise(ALL)
WORLDS = ["-".join(names) for names in worlds()]
# an office of a thousand polygons takes most of a second; the suites have those
SMALL = {"office": {"polygons": 100}}
FEW = suite_names()[3::4]
PAIRS = list(dict.fromkeys(tuple(name.split("-")[:2]) for name in WORLDS))


def make(name, **options):
    task, simulator, preset = name.split("-")
    options.setdefault("observation", "state")
    options.setdefault("variations", SMALL.get(task))
    return PushEnv(task=task, simulator=simulator, preset=preset, **options)


def drive(env, seed, steps=4):
    """Everything that an episode shows."""
    observation, info = env.reset(seed=seed)
    shown = [observation.tobytes(), comparable(info), env.world]
    rng = np.random.default_rng(seed)
    for _ in range(steps):
        action = rng.uniform(-1, 1, env.action_space.shape).astype(np.float32)
        observation, reward, terminated, truncated, info = env.step(action)
        assert observation in env.observation_space
        shown += [observation.tobytes(), reward, terminated, truncated, comparable(info)]
        shown += [env.world, env.trace]
        if terminated or truncated:
            break
    return shown


def comparable(info):
    return {key: getattr(value, "tolist", lambda v=value: v)() for key, value in info.items()}


def test_every_task_runs_on_both_simulators():
    names = "maze namo ship_ice box_delivery area_clearing room office rearrange"
    tasks = set(names.split())
    assert {task for task, _ in PAIRS} == tasks
    assert len(PAIRS) == 2 * len(tasks)


@pytest.mark.parametrize(
    ("task", "simulator", "preset", "action", "observation"),
    [pytest.param(*row, marks=() if row in SOME else pytest.mark.slow) for row in ALL],
)
def test_gymnasium_finds_no_fault(task, simulator, preset, action, observation):
    options = {"action": action, "observation": observation}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = make(f"{task}-{simulator}-{preset}", **options)
        check_env(env, skip_render_check=True)
    assert isinstance(env.action_space, Box) and isinstance(env.observation_space, Box)
    assert env.world.robot.drive is drive_of(action)
    assert (drive_of(action) is Drive.CONSTANT_SPEED) == (action == "turn_rate")
    env.close()


@pytest.mark.parametrize("name", WORLDS)
def test_same_seed_same_episode_whatever_came_before(name):
    one, other = make(name, observation="image"), make(name, observation="image")
    first = drive(one, 5)
    drive(one, 6, steps=2)
    assert drive(one, 5) == first
    other.reset(seed=9)
    assert drive(other, 5) == first
    assert drive(one, 6) != first


@pytest.mark.slow
@pytest.mark.parametrize("name", WORLDS)
def test_two_instances_share_nothing(name):
    one, other = make(name), make(name)
    alone = drive(one, 2)
    one.reset(seed=2)
    other.reset(seed=3)
    rng = np.random.default_rng(2)
    for seen in alone[8::7]:
        if one._over:
            break
        action = rng.uniform(-1, 1, one.action_space.shape).astype(np.float32)
        one.step(action)
        assert one.world == seen
        if not other._over:
            other.step(-action)


@pytest.mark.parametrize("name", WORLDS)
def test_infos_and_traces_say_what_happened(name):
    env = make(name)
    _, info = env.reset(seed=1)
    start = env.world
    for_objects = start.goal_kind == "objects"
    assert ("completed" in info) == for_objects
    before = start.movables.poses
    for _ in range(8):
        world = env.world
        *_, terminated, truncated, info = env.step(np.full(env.action_space.shape, 0.1))
        trace = env.trace
        assert (np.diff(np.concatenate([[world.time], trace.times])) > 0.0).all()
        assert trace.object_poses.shape == (len(trace.times), *before.shape)
        np.testing.assert_array_equal(trace.robot_poses[-1], env.world.robot_pose)
        here = np.isin(start.movables.ids, env.world.movables.ids)
        np.testing.assert_array_equal(trace.object_poses[-1][here], env.world.movables.poses)
        lengths = trace.object_lengths(before)
        assert info["work"] == pytest.approx(start.movables.masses @ lengths)
        before = trace.object_poses[-1]
        assert isinstance(info["success"], bool) and isinstance(info["held"], bool)
        assert bool(info["reason"]) == (terminated or truncated)
        if for_objects:
            assert info["completed"].shape == (len(start.movables),)
            assert info["completed"][~here].all()
        if terminated or truncated:
            break


@pytest.mark.parametrize(
    ("task", "variations", "simulator"),
    [
        pytest.param(task, one, simulator, marks=pytest.mark.slow if k % 2 else ())
        for k, (task, one, simulator) in enumerate(
            (task, one, simulator)
            for task, some in LAYOUTS.items()
            for n, one in enumerate(some)
            for simulator in sorted(SIMULATORS, reverse=n % 2 == 1)
        )
    ],
)
def test_every_variation_starts_and_steps(task, variations, simulator):
    env = PushEnv(task=task, simulator=simulator, variations=variations, observation="image")
    observation, _ = env.reset(seed=0)
    assert observation in env.observation_space
    observation, reward, *_ = env.step(np.zeros(env.action_space.shape))
    assert observation in env.observation_space
    assert np.isfinite(reward)


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in FEW else pytest.mark.slow) for name in suite_names()],
)
def test_every_suite_starts(name):
    first = suite(name, episodes=1).scenarios[0]
    env = make_scenario(first, observation="state")
    env.reset()
    env.step(np.zeros(env.action_space.shape))


DIGEST = """
import hashlib, sys, numpy as np
from pushplan.envs import PushEnv
from pushplan.envs import make as make_scenario
for name in sys.argv[1:]:
    task, simulator, preset = name.split("-")
    env = PushEnv(
        task=task,
        simulator=simulator,
        preset=preset,
        observation="image",
        variations={"polygons": 100} if task == "office" else None,
    )
    digest = hashlib.sha256(env.reset(seed=3)[0].tobytes())
    for i in range(4):
        if not env._over:
            action = np.full(env.action_space.shape, 0.5 * np.sin(i), np.float32)
            digest.update(env.step(action)[0].tobytes())
    digest.update(env.world.movables.poses.tobytes())
    digest.update(env.trace.robot_poses.tobytes())
    print(name, digest.hexdigest())
"""


@functools.cache
def digests(order):
    names = sorted(WORLDS, reverse=order == "backwards")
    done = subprocess.run(
        [sys.executable, "-c", DIGEST, *names], capture_output=True, text=True, check=True
    )
    return dict(line.split() for line in done.stdout.splitlines())


@pytest.mark.slow
def test_same_bytes_in_another_process_and_another_order():
    assert digests("forwards") == digests("backwards")
    # rooms and offices differ by materials that no step met, rearrangements in 2D by none
    same = {f"{task}-pymunk-testbed" for task in ("room", "office", "rearrange")}
    own = {at for name, at in digests("forwards").items() if name not in same}
    assert len(own) == len(WORLDS) - len(same)


def resident_kb():
    gc.collect()
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * resource.getpagesize() / 1024


def least_growth(marks):
    """A leak shows in every block of work; compiling, caches and the allocator only in some."""
    return min(np.diff(marks[1:]))


@pytest.mark.parametrize("name", WORLDS)
@pytest.mark.slow
def test_resets_leak_nothing(name):
    """Neither Python objects nor the engine's memory."""
    env = make(name)
    objects, memory = [], []
    for _ in range(4):
        for seed in range(30):
            env.reset(seed=seed)
            if seed % 10 == 0:
                env.step(np.zeros(env.action_space.shape))
        memory.append(resident_kb())
        objects.append(len(gc.get_objects()))
    assert least_growth(objects) < 20
    assert least_growth(memory) < 1500


@pytest.mark.slow
@pytest.mark.parametrize(("task", "simulator"), PAIRS)
def test_hundreds_of_resets_leak_nothing(task, simulator):
    env = PushEnv(task=task, simulator=simulator, observation="state", variations=SMALL.get(task))
    memory = []
    for seed in range(400):
        env.reset(seed=seed)
        if seed % 80 == 79:
            memory.append(resident_kb())
    assert least_growth(memory) < 2000


@pytest.mark.parametrize("name", WORLDS)
def test_the_drawing_shows_the_scene(name):
    env = make(name, render_mode="rgb_array")
    env.reset(seed=0)
    frame = env.render()
    assert frame.ndim == 3 and frame.shape[2] == 3 and frame.dtype == np.uint8
    colours = frame.astype(int) @ [1, 256, 65536]  # a number each, as those are quicker to sort
    assert len(np.unique(colours)) > 10
    env.close()


def test_there_is_an_action_mode_for_every_name_that_a_task_gives():
    for task in TASKS:
        assert set(look_up("task", TASKS, task).actions) <= set(ACTIONS)


@pytest.mark.slow
@pytest.mark.parametrize(("task", "simulator", "preset"), list(worlds()))
def test_a_seed_is_the_same_start_for_every_action(task, simulator, preset):
    kind = look_up("task", TASKS, task)
    for seed in (14028,):
        starts = []
        for action in kind.actions:
            env = make(f"{task}-{simulator}-{preset}", action=action)
            env.reset(seed=seed)
            starts.append(np.concatenate([env.world.robot_pose[None], env.world.movables.poses]))
            env.close()
        for start in starts[1:]:
            np.testing.assert_array_equal(start, starts[0])
        if isinstance(env.world.goal, GoalDisc):
            assert env.world.goal.distance(*starts[0][0, :2]) > 0.0
