"""The policies `gtsp` and `gtsp-mpc`: whole small episodes, and how they end."""

import hashlib
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from conftest import make_boxes, make_robot, make_u_maze

from pushplan.envs import PushEnv
from pushplan.planners import make_policy, policy_names
from pushplan.planners.rearrangement import GtspMpc, RearrangementConfig
from pushplan.planners.rearrangement.push_choice import choose_push
from pushplan.world import (
    Deadline,
    InvalidInputError,
    OwnBudget,
    Receptacle,
    StaticMap,
    Twist,
    UnknownNameError,
    World,
    box_delivery_robot,
)

CORNER = Receptacle([(3.0, 3.0), (5.0, 3.0), (5.0, 5.0), (3.0, 5.0)])


def room(boxes, extra=()):
    return World(
        robot=box_delivery_robot(),
        robot_pose=(-3.0, -3.0, 0.0),
        static=StaticMap.build(polygons=list(extra), bounds=(-5, -5, 5, 5)),
        movables=make_boxes(boxes),
        goal=CORNER,
    )


def run(policy, *, task, preset, seed, limit=1500, disturb=None, **options):
    env = PushEnv(task=task, preset=preset, action="velocity", observation="state", **options)
    env.reset(seed=seed)
    policy.reset(env.world, np.random.default_rng(0))
    rng = np.random.default_rng(5)
    info = {}
    for _ in range(limit):
        world = env.world
        if disturb is not None:
            noise = rng.normal(0.0, disturb, world.movables.poses.shape)
            world = world.moved(movable_poses=world.movables.poses + noise)
        *_, terminated, truncated, info = env.step(env.encode(policy.act(world)))
        if terminated or truncated:
            break
    return info


EPISODES = [
    ("area_clearing", "benchmark", "pymunk", {"layout": "clear_small", "boxes": 3}),
    pytest.param(
        *("area_clearing", "testbed", "mujoco", {"layout": "clear_small", "boxes": 2}),
        marks=pytest.mark.slow,
    ),
    pytest.param(
        *("box_delivery", "benchmark", "pymunk", {"layout": "small_empty", "boxes": 2}),
        marks=pytest.mark.slow,
    ),
    ("box_delivery", "testbed", "mujoco", {"layout": "small_empty", "boxes": 2}),
]


@pytest.mark.parametrize(("task", "preset", "simulator", "variations"), EPISODES)
def test_every_box_gets_where_it_belongs(task, preset, simulator, variations):
    policy = make_policy("gtsp-mpc")
    options = {"simulator": simulator, "variations": variations}
    info = run(policy, task=task, preset=preset, seed=1000, **options)
    assert info["success"]
    assert policy.given_up == {}


@pytest.mark.slow
def test_a_box_between_columns_is_hooked_out():
    """One lies where the bumper does not fit behind it, from either side."""
    info = run(
        make_policy("gtsp-mpc"),
        task="box_delivery",
        preset="benchmark",
        seed=10,
        limit=8000,
        simulator="pymunk",
        variations={"layout": "small_columns", "boxes": 10},
    )
    assert info["success"]


def test_noisy_poses_do_not_keep_it_from_clearing():
    info = run(
        GtspMpc(),
        task="area_clearing",
        preset="benchmark",
        seed=1003,
        disturb=0.01,
        variations={"layout": "clear_small", "boxes": 2},
    )
    assert info["success"]


def test_the_published_policy_plans_once_and_ends():
    policy = make_policy("gtsp")
    world = room([(0.0, 0.0, 0.0), (-1.0, 2.0, 0.0)])
    first = policy.act(world)
    assert isinstance(first, Twist) and (first.linear or first.angular)
    # nothing ever moves: it skips leg after leg, and stands at the end
    for step in range(1, 60):
        last = policy.act(world.moved(time=0.2 * step))
    assert last == Twist(0.0, 0.0)


def test_a_box_that_nobody_can_reach_is_given_up_with_a_reason():
    ring = [
        [(-1, -1), (1, -1), (1, -0.7), (-1, -0.7)],
        [(-1, 0.7), (1, 0.7), (1, 1), (-1, 1)],
        [(-1, -1), (-0.7, -1), (-0.7, 1), (-1, 1)],
        [(0.7, -1), (1, -1), (1, 1), (0.7, 1)],
    ]
    policy, world = GtspMpc(), room([(0.0, 0.0, 0.0)], ring)
    for step in range(12):
        command = policy.act(world.moved(time=400.0 * step))
    assert command == Twist(0.0, 0.0)
    assert list(policy.given_up) == [0] and "push" in policy.given_up[0]
    assert policy.plan == ()


@pytest.mark.slow
def test_nothing_is_given_up_while_boxes_get_nearer():
    impatient = GtspMpc(max_relocations=1, max_failures=1, max_rounds=0)
    options = {"variations": {"layout": "small_columns", "boxes": 1}, "limit": 900}
    info = run(impatient, task="box_delivery", preset="benchmark", seed=1019, **options)
    assert info["success"]


@pytest.mark.parametrize("apart", [pytest.param(1e3, marks=pytest.mark.slow), 1e6])
def test_a_decision_is_bounded_however_far_the_boxes_are(apart):
    here = room([(0.5, 0.1, 0.0), (apart, apart, 0.3)])
    here = replace(here, static=StaticMap.build(bounds=(-5, -5, apart + 5, apart + 5)))
    GtspMpc().act(room([(0.5, 0.1, 0.0)]))
    before = time.process_time()
    assert GtspMpc().act(here) != Twist(0.0, 0.0)
    assert time.process_time() - before < 10.0


def test_the_rollouts_of_a_choice_are_bounded():
    boxes = [(x, y, 0.1 * x * y) for x in (-2.0, 0.0, 2.0) for y in (-2.0, 0.0, 2.0)]
    few, many, ruled = GtspMpc(max_rollouts=20), GtspMpc(), GtspMpc(max_rollouts=20)
    ruled.stop = OwnBudget() | Deadline(1e4)
    commands = [policy.act(room(boxes)) for policy in (few, many, ruled)]
    assert 0 < len(few.graph.pushes) < len(many.graph.pushes)
    assert commands[0] == commands[2] != Twist(0.0, 0.0)  # an own budget is the same one


@pytest.mark.slow
def test_a_choice_that_ran_out_of_budget_leaves_less_to_the_next(monkeypatch):
    """Searches that it came to the end of are kept, so that the robot does not search for ever."""
    budgets = []

    def noted(scene, *args, **options):
        budgets.append(scene.budget)
        return choose_push(scene, *args, **options)

    monkeypatch.setattr("pushplan.planners.rearrangement.gtsp_mpc.choose_push", noted)
    policy = GtspMpc(max_rollouts=6)
    corners = room([(-4.49, -4.49, 0.0), (4.49, 4.49, 0.0), (-4.49, 4.49, 0.0)])
    for step in range(20):
        policy.act(corners.moved(time=400.0 * step))
    assert budgets[0].interrupted and budgets[-1].used == 0


def test_a_box_delivered_by_accident_is_dropped():
    policy = GtspMpc()
    world = room([(0.0, 0.0, 0.0), (-2.0, 2.0, 0.0)])
    policy.act(world)
    first = policy.plan[0].target
    assert {i for push in policy.plan for i in push.delivers} == {0, 1}
    left = replace(world, movables=world.movables.select(world.movables.ids != first), time=0.2)
    policy.act(left)
    assert first not in {push.target for push in policy.plan}
    assert policy.act(replace(left, movables=make_boxes([]), time=0.4)) == Twist(0.0, 0.0)
    assert policy.plan == () and policy.given_up == {}


def commands():
    """A digest of what the policy drives on a small scene."""
    policy = GtspMpc()
    env = PushEnv(
        task="box_delivery",
        preset="benchmark",
        action="velocity",
        observation="state",
        variations={"layout": "small_columns", "boxes": 3},
    )
    env.reset(seed=1002)
    policy.reset(env.world, np.random.default_rng(0))
    digest = hashlib.sha256()
    for _ in range(60):
        twist = policy.act(env.world)
        digest.update(np.array([twist.linear, twist.angular]).tobytes())
        env.step(env.encode(twist))
    return digest.hexdigest()


@pytest.mark.slow
def test_two_processes_drive_the_same():
    code = "import test_gtsp_policy as t; print(t.commands())"
    path = f"import sys; sys.path[:0] = {[p for p in sys.path if 'tests' in p]!r}; "
    done = subprocess.run(
        [sys.executable, "-c", path + code], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == commands()


@pytest.mark.parametrize("name", ["gtsp", "gtsp-mpc"])
def test_other_tasks_and_robots_are_refused(name):
    assert name in policy_names()
    policy = make_policy(name)
    with pytest.raises(InvalidInputError, match="goal"):
        policy.act(replace(make_u_maze(), robot=box_delivery_robot()))
    with pytest.raises(InvalidInputError, match="differential"):
        policy.act(replace(room([]), robot=make_robot()))


def test_settings_of_the_policies_are_checked():
    with pytest.raises(InvalidInputError):
        GtspMpc(RearrangementConfig(), work_weight=3.0)
    with pytest.raises(InvalidInputError):
        make_policy("gtsp-mpc", config="fast")
    with pytest.raises(InvalidInputError):
        make_policy("gtsp-mpc", work_weight=-1.0)
    with pytest.raises(UnknownNameError):
        make_policy("gtsp-mpc", prize=1.0)
    policy = make_policy("gtsp-mpc", mpc=False, friction=0.4)
    assert policy.config == RearrangementConfig(mpc=False, friction=0.4)
