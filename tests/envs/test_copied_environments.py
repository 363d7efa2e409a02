"""A copy of a running environment is another environment in the same state, or there is none."""

import copy
import functools
import pickle

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers import FrameStackObservation, TimeLimit

from pushplan.envs import PushEnv, WorkerVectorEnv
from pushplan.envs.registry import SIMULATORS, TASKS
from pushplan.envs.simulators.mujoco_model import MujocoOptions
from pushplan.envs.simulators.mujoco_simulator import MujocoSimulator
from pushplan.envs.simulators.pymunk_simulator import PymunkOptions, PymunkSimulator
from pushplan.perception import LidarObservation
from pushplan.world import PushplanError

CLONES = {"deepcopy": copy.deepcopy, "pickle": lambda env: pickle.loads(pickle.dumps(env))}
SMALL = {"office": {"polygons": 100}}
PLAIN = [
    pytest.param(
        {"task": task, "simulator": simulator, "variations": SMALL.get(task)},
        id=f"{task}-{simulator}",
    )
    for task in TASKS
    for simulator in SIMULATORS
]
SENSED = {"sensing": "lidar", "range_noise": 0.02, "object_noise": 0.02, "view_delay": 0.3}
OTHERS = {
    "lidar": {
        "task": "maze",
        "simulator": "mujoco",
        "variations": {"boxes": 3, **SENSED},
        "observation": "state",
    },
    "detector": {
        "task": "area_clearing",
        "simulator": "pymunk",
        "variations": {"boxes": 10, **SENSED, "sensing": "objects"},
        "observation": LidarObservation(beams=24),
        "action": "velocity",
    },
    "own options": {"task": "room", "simulator": MujocoSimulator(MujocoOptions(samples=4))},
    "other options": {"task": "maze", "simulator": PymunkSimulator(PymunkOptions(samples=4))},
    "waypoints": {"task": "box_delivery", "simulator": "mujoco", "action": "waypoint"},
}


def episode(env, actions):
    """All that steps show, until the episode ends."""
    shown = []
    for action in actions:
        observation, *rest, info = env.step(action)
        inner = env.unwrapped
        worlds = [inner.world, inner.true_world, inner.trace]
        counts = {key: np.asarray(value).tolist() for key, value in info.items()}
        shown.append([np.asarray(observation).tobytes(), *rest, counts, *worlds])
        if rest[1] or rest[2]:
            break
    return shown


def check(env, clone):
    """A copy does what the original does, and neither what another copy does."""
    env.reset(seed=4)
    rng = np.random.default_rng(4)
    low, high = env.action_space.low, env.action_space.high
    before, after, others = rng.uniform(low, high, (3, 6, *low.shape)).astype(np.float32)
    pushing = np.clip(before, 0.5 * high, high)  # so that something is touched
    assert len(episode(env, pushing)) == 6
    first, second, reset = clone(env), clone(env), clone(env)
    assert first.unwrapped.world == env.unwrapped.world
    one, disturbed, own = [], [], []
    for action, other in zip(after, others, strict=True):
        own += episode(second, [action])
        disturbed += episode(reset, [other])
        one += episode(env, [action])
        if any(shown[-1][2] or shown[-1][3] for shown in (own, disturbed, one)):
            break
    assert own == one == episode(first, after[: len(one)])
    assert disturbed[0] != one[0]
    # the next start comes from the generator of the episode, which is copied too
    starts = [np.asarray(each.reset()[0]).tobytes() for each in (env, first, second)]
    assert starts[0] == starts[1] == starts[2]


@pytest.mark.parametrize("clone", CLONES.values(), ids=CLONES)
@pytest.mark.parametrize("options", PLAIN)
def test_a_copy_in_the_middle_of_an_episode_goes_on_alike(options, clone):
    check(PushEnv(**options, observation="image"), clone)


@pytest.mark.parametrize("clone", CLONES.values(), ids=CLONES)
@pytest.mark.parametrize("options", OTHERS.values(), ids=OTHERS)
def test_so_does_one_with_sensors_or_options_of_its_own(options, clone):
    check(PushEnv(**options), clone)


@pytest.mark.parametrize("clone", CLONES.values(), ids=CLONES)
@pytest.mark.parametrize("simulator", SIMULATORS)
def test_wrappers_of_gymnasium_copy_what_they_hold(simulator, clone):
    env = gymnasium.make("pushplan/Room-v0", simulator=simulator, max_episode_steps=50)
    assert isinstance(env, TimeLimit)
    check(FrameStackObservation(env, 3), clone)


@pytest.mark.parametrize("simulator", SIMULATORS)
def test_a_simulator_goes_on_after_objects_were_removed_or_nothing_was_built(simulator):
    for clone in CLONES.values():
        env = PushEnv(task="box_delivery", simulator=simulator)
        assert not hasattr(clone(env._simulator), "_world")
        env.reset(seed=2)
        engine = env._simulator
        engine.remove(env.world.movables.ids[:3].tolist())
        assert clone(engine).save() == engine.save()


def test_contacts_are_solved_in_the_same_order_after_long_pushing():
    env = PushEnv(task="ship_ice", variations={"concentration": 0.5}, observation="state")
    env.reset(seed=1)
    copies = []
    for k in range(34):
        if k % 5 == 1:
            copies += [copy.deepcopy(env), copy.deepcopy(copies[-1] if copies else env)]
        for one in (env, *copies):
            one.step([0.3 * np.sin(k / 5)])
    assert all(one.world == env.world for one in copies)


def test_workers_are_not_copied():
    envs = WorkerVectorEnv([functools.partial(PushEnv, task="room")], workers=1)
    for clone in CLONES.values():
        with pytest.raises(PushplanError, match="a WorkerVectorEnv cannot be copied or pickled"):
            clone(envs)
    envs.close()
