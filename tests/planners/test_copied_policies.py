"""A copy of a policy in the middle of an episode goes on as the original, or is refused."""

import copy
import pickle

import numpy as np
import pytest

from pushplan.control import MpcTracker
from pushplan.core import pushing, search
from pushplan.envs import PushEnv
from pushplan.learned import learned_names, load_policy
from pushplan.planners import PlanFollower, make_planner, make_policy, policy_names
from pushplan.runtime import Disturbances, DisturbedPolicy, Runner, ThreadExecutor
from pushplan.world import MaxIterations, OwnBudget, PushplanError

CLONES = {"deepcopy": copy.deepcopy, "pickle": lambda one: pickle.loads(pickle.dumps(one))}
SCENES = {
    "ship": {"task": "ship_ice", "variations": {"concentration": 0.3}},
    "gtsp": {"task": "box_delivery", "variations": {"boxes": 4}},
    "greedy": {"task": "area_clearing", "variations": {"boxes": 4}},
    "namo": {"task": "namo"},
    "places": {"task": "rearrange", "variations": {"objects": 2}},
    "maze": {"task": "maze", "variations": {"boxes": 4}},
    "box": {"task": "box_delivery", "variations": {"boxes": 4}},
    "area": {"task": "area_clearing", "variations": {"boxes": 4}},
}
COPIED_AT = (0, 6, 20, 45)
AHEAD = 8
REFUSED = {"gtsp-mpc", "gtsp-mpc in places", "gtsp-mpc counted", "tracker", "disturbed"}
"""A push or a path is driven by a solver in the core, or a `Runner` is held."""


def made(name):
    if name in learned_names():
        return load_policy(name)
    if name == "tracker":
        return PlanFollower(make_planner("straight"), MpcTracker())
    if name == "disturbed":
        disturbances = Disturbances(position_noise=0.01)
        return DisturbedPolicy(make_policy("push-aware"), disturbances, period=0.1)
    if name == "gtsp-mpc counted":
        return make_policy("gtsp-mpc", stop=MaxIterations(4))
    return make_policy(name.split()[0])


def scene(name, policy):
    options = SCENES.get(name.split()[-1], SCENES.get(name.split("-")[0], SCENES["maze"]))
    if hasattr(policy, "specification"):
        options = {**options, "observation": policy.observation}
        options["preset"] = next(iter(policy.specification.presets), None)
    return PushEnv(**options, action=getattr(policy, "actions", None))


def go_on(policy, env, observation, steps):
    """Actions of a policy, with the world and the observation after each."""
    shown = []
    for _ in range(steps):
        action = env.encode(policy.act(env.world, observation))
        observation, *_, terminated, truncated, _ = env.step(action)
        shown.append((action.tobytes(), env.world, observation))
        if terminated or truncated:
            break
    return shown


def bytes_of(shown):
    return [(action, world) for action, world, _ in shown]


NAMES = [*policy_names(), *learned_names(), *sorted(REFUSED - {"gtsp-mpc"})]


@pytest.mark.parametrize("name", NAMES)
def test_copies_in_the_middle_of_an_episode_go_on_alike(name):
    policy = made(name)
    env = scene(name, policy)
    observation = env.reset(seed=1)[0]
    policy.reset(env.world, np.random.default_rng(3))
    shown, twins, refused = [], {}, 0
    for step in range(max(COPIED_AT) + AHEAD + 1):
        shown += go_on(policy, env, observation, 1)
        observation = shown[-1][2]
        if env._over:
            break
        if step not in COPIED_AT:
            continue
        try:
            for how, clone in CLONES.items():
                twins[step, how] = *clone((policy, env)), observation
                go_on(*clone((policy, env)), observation, AHEAD)  # disturbs nobody
        except PushplanError as error:
            assert "cannot be copied" in str(error) and "\n" not in str(error)
            refused += 1
    assert twins or name in ("tracker", "disturbed")
    assert not refused or name in REFUSED
    for (step, _), (twin, there, seen) in twins.items():
        own = go_on(twin, there, seen, AHEAD)
        assert bytes_of(own) == bytes_of(shown[step + 1 : step + 1 + AHEAD])


@pytest.mark.parametrize("clone", CLONES.values(), ids=CLONES)
def test_what_has_threads_or_lives_in_the_core_is_refused_in_a_line(clone):
    env = scene("gtsp", None)
    env.reset(seed=1)
    threaded = make_policy("gtsp-mpc")
    threaded.reset(env.world, np.random.default_rng(0))
    executor = ThreadExecutor(OwnBudget(), lambda: 0.0)
    threaded.plan_with(executor)
    with Runner("push-aware", period=0.1) as runner:
        for one, text in (
            (runner, "a Runner"),
            (threaded, "a ThreadExecutor"),
            (search.GridDijkstra(np.ones((2, 2)), 1.0, np.zeros(1, np.int64)), "a GridDijkstra"),
        ):
            with pytest.raises(PushplanError, match=f"{text} cannot be copied or pickled"):
                clone(one)
    assert executor.close(1.0)


@pytest.mark.parametrize("clone", CLONES.values(), ids=CLONES)
def test_plain_values_of_the_core_are_copied(clone):
    contact = pushing.BoxContact(0.1, 0.2, 0.3, 0.4, -0.5, 0.6, 0.7, 0.8)
    assert clone(contact) is not contact
    assert (clone(contact).front, clone(contact).friction) == (0.1, 0.8)
    assert clone(search.SearchStatus.EXHAUSTED) is search.SearchStatus.EXHAUSTED
