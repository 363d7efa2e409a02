"""Sampling-based predictive control: weights, rollouts, limits, small worlds, errors."""

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from pushplan.control import SimulatedExecutor
from pushplan.geometry.transforms import arc_step
from pushplan.interaction import InteractionModel, QuasiStatic
from pushplan.interaction.ice_interaction import IceInteraction
from pushplan.planners import make_policy
from pushplan.planners.mppi import Mppi, MppiConfig
from pushplan.planners.mppi.mppi import elite_weights, exponential_weights, updated
from pushplan.planners.mppi.rollout_model import ControlSequence, RolloutModel, draw, interpolation
from pushplan.world import (
    ClearanceArea,
    Drive,
    GoalDisc,
    GoalLine,
    InvalidInputError,
    Movables,
    RobotModel,
    StaticMap,
    UnknownNameError,
    World,
    box_delivery_robot,
)
from pushplan.world.policy_abilities import LogsPlans, PlansBesideDriving, ShowsPlan

SQUARE = 0.5 * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
SMALL = MppiConfig(samples=24)


@dataclass(frozen=True)
class OnlySweep:
    """A model without a compiled form."""

    model: InteractionModel

    def sweep(self, world, path):
        return self.model.sweep(world, path)


def room(drive=Drive.CONSTANT_SPEED, walls=True, goal=None, **limits) -> World:
    column = SQUARE + np.array([5.0, 7.0])
    return World(
        robot=RobotModel.from_outline(
            SQUARE, mass=1.0, drive=drive, max_speed=1.0, max_turn_rate=1.0, **limits
        ),
        robot_pose=np.array([2.0, 5.0, 0.0]),
        static=StaticMap.build(polygons=[column] if walls else [], bounds=[0.0, 0.0, 10.0, 10.0]),
        movables=Movables.from_outlines([SQUARE, SQUARE], [[4.0, 5.2, 0.0], [5.3, 5.0, 0.3]]),
        goal=goal or GoalDisc(np.array([8.0, 5.0]), 0.5),
    )


def drive(policy, world, steps, period=0.25, seed=0):
    """Drive in the quasi-static model itself; yields the world and the command of each step."""
    policy.reset(world, np.random.default_rng(seed))
    for _ in range(steps):
        twist = policy.act(world)
        yield world, twist
        pose = np.empty(3)
        arc_step(np.array(world.robot_pose), period * twist.linear, period * twist.angular, pose)
        swept = QuasiStatic().sweep(world, np.stack([world.robot_pose, pose]))
        c, s = math.cos(pose[2]), math.sin(pose[2])
        world = world.moved(
            robot_pose=pose,
            robot_twist=(twist.linear * c, twist.linear * s, twist.angular),
            movable_poses=swept.object_poses[-1],
            time=world.time + period,
        )


def test_exponential_weights_are_those_of_the_formula():
    costs = np.array([3.0, 1.0, 2.0, 7.0, 4.0])
    scale = 0.5 * (np.quantile(costs, 0.25) - 1.0)
    expected = np.exp(-(costs - 1.0) / scale)
    found = exponential_weights(costs, 0.5)
    np.testing.assert_allclose(found, expected / expected.sum(), rtol=1e-12)
    np.testing.assert_array_equal(exponential_weights(np.ones(4), 0.1), np.full(4, 0.25))
    np.testing.assert_allclose(exponential_weights(1e6 * costs + 5, 0.5), found, rtol=1e-9)


def test_elite_weights_keep_the_best():
    assert elite_weights(np.array([3.0, 1.0, 2.0, 7.0]), 0.5).tolist() == [0.0, 0.5, 0.5, 0.0]
    assert elite_weights(np.array([3.0, 1.0]), 0.01).tolist() == [0.0, 1.0]


def test_updates_move_the_mean_and_only_the_cross_entropy_method_the_spread():
    rng = np.random.default_rng(0)
    samples, spread = rng.normal(size=(50, 3, 2)), np.ones((3, 2))
    costs = np.abs(samples[:, 0, 1] - 1.0)
    mean, same = updated(MppiConfig(), samples, costs, spread)
    assert same is spread and abs(mean[0, 1] - 1.0) < 0.3
    mean, less = updated(MppiConfig(update="cem"), samples, costs, spread)
    assert abs(mean[0, 1] - 1.0) < 0.2 and less[0, 1] < 0.2
    best = samples[np.argsort(costs)[:5]]
    np.testing.assert_allclose(mean, best.mean(axis=0))
    np.testing.assert_allclose(less, best.std(axis=0))


def test_controls_between_knots_are_linear_and_go_on_in_time():
    knots = np.array([[0.0, 1.0], [1.0, 0.0], [0.5, -1.0]])
    sequence = ControlSequence(10.0, 4.0, knots)
    middles = 10.0 + 4.0 * (np.arange(8) + 0.5) / 8
    np.testing.assert_allclose(interpolation(8, 3) @ knots, sequence.at(middles))
    later = sequence.later(12.0)
    np.testing.assert_allclose(later.knots, [[1.0, 0.0], [0.5, -1.0], [0.5, -1.0]])


def test_samples_hold_the_mean_and_keep_their_limits():
    low, mean = np.array([-0.5, -1.0]), np.full((4, 2), 0.9)
    samples = draw(np.random.default_rng(0), mean, np.full((4, 2), 2.0), low, SMALL)
    assert (samples[0] == mean).all()
    assert (samples >= low).all() and (samples <= 1.0).all()


@pytest.mark.parametrize(
    ("model", "walls"), [(QuasiStatic(friction=0.2), True), (IceInteraction(), False)]
)
def test_rollouts_agree_with_sweeps(model, walls):
    world = room(walls=walls)
    rolled = RolloutModel(world, SMALL, model)
    knots = draw(
        np.random.default_rng(1),
        np.tile([1.0, 0.0], (6, 1)),
        np.full((6, 2), [0.0, 0.4]),
        np.array([1.0, -1.0]),
        SMALL,
    )
    compiled = rolled.roll(knots)
    asked = RolloutModel(world, SMALL, OnlySweep(model)).roll(knots)
    assert compiled.works.max() > 0.5
    np.testing.assert_allclose(
        compiled.paths[0, : compiled.ends[0]], asked.paths[0, : asked.ends[0]]
    )
    clear = (compiled.outcomes == asked.outcomes) & (compiled.outcomes != 2)
    assert clear.sum() >= 0.5 * len(knots)
    np.testing.assert_allclose(compiled.objects[clear], asked.objects[clear], atol=0.02)
    np.testing.assert_allclose(compiled.works[clear], asked.works[clear], rtol=0.05, atol=0.02)


def test_rollouts_end_in_the_goal_and_at_walls():
    world = replace(room(), movables=Movables.empty())
    straight = np.tile([1.0, 0.0], (1, 6, 1))
    near = replace(world, goal=GoalDisc(np.array([6.0, 5.0]), 0.5))
    assert RolloutModel(near, SMALL).roll(straight).outcomes[0] == 1
    facing = replace(world, robot_pose=np.array([5.0, 4.5, math.pi / 2]))
    rollouts = RolloutModel(facing, SMALL).roll(straight)
    assert rollouts.outcomes[0] == 2
    assert 5.5 < rollouts.paths[0, rollouts.ends[0], 1] < 6.0


@pytest.mark.parametrize("name", ["mppi", pytest.param("cem", marks=pytest.mark.slow)])
def test_it_reaches_the_goal_and_the_same_seed_gives_the_same_commands(name):
    runs = []
    for _ in range(2):
        policy = make_policy(name, samples=24)
        steps = list(drive(policy, room(), 40))
        runs.append([(twist.linear, twist.angular) for _, twist in steps])
    assert runs[0] == runs[1]
    assert any(world.goal.distance(*world.robot_pose[:2]) == 0.0 for world, _ in steps)
    assert isinstance(policy, LogsPlans) and isinstance(policy, ShowsPlan)
    assert isinstance(policy, PlansBesideDriving)
    assert policy.plan_log and (policy.current_plan.poses[0, :2] > 2.0).any()


@pytest.mark.parametrize("kind", [Drive.DIFFERENTIAL, Drive.CAR])
def test_commands_keep_the_limits(kind):
    limits = {"max_acceleration": 0.4, "max_turn_acceleration": 0.8, "min_speed": -0.3}
    if kind is Drive.CAR:
        limits["min_turning_radius"] = 1.2
    last = (0.0, 0.0)
    for _, twist in drive(make_policy("mppi", samples=24), room(kind, **limits), 24):
        assert -0.3 <= twist.linear <= 1.0 and abs(twist.angular) <= 1.0
        assert abs(twist.linear - last[0]) <= 0.4 * 0.25 + 1e-9
        if kind is Drive.CAR:
            assert abs(twist.angular) <= abs(twist.linear) / 1.2 + 1e-9
        else:
            assert abs(twist.angular - last[1]) <= 0.8 * 0.25 + 1e-9
        last = (twist.linear, twist.angular)


def test_decisions_that_take_time_are_driven_from_where_they_are_due():
    policy, world = make_policy("mppi", samples=24), room()
    policy.reset(world, np.random.default_rng(0))
    ticks = itertools.count(0.0, 0.3)
    policy.plan_with(SimulatedExecutor(1.0, lambda: next(ticks)))
    commands = [policy.act(world.moved(time=0.1 * step)) for step in range(8)]
    assert all(command.linear == 1.0 for command in commands)
    assert policy.plan_log


@pytest.mark.slow
def test_a_box_is_pushed_out_of_an_area():
    area = ClearanceArea(6.0 * SQUARE + 5.0, np.ones(4, np.bool_))
    world = replace(room(Drive.DIFFERENTIAL, walls=False, goal=area), robot=box_delivery_robot())
    world = replace(world, movables=world.movables.select([1]), robot_pose=np.array([3.0, 5.0, 0]))
    policy = make_policy("mppi", samples=48)
    assert any(now.completed.all() for now, _ in drive(policy, world, 400))


def test_wrong_settings_and_worlds_are_one_clear_line():
    with pytest.raises(InvalidInputError, match=r"mppi\.samples must be at least 2, got 1"):
        make_policy("mppi", samples=1)
    with pytest.raises(InvalidInputError, match=r"mppi\.update.*'annealing'"):
        MppiConfig(update="annealing")
    with pytest.raises(UnknownNameError, match="'sample'; did you mean 'samples'"):
        make_policy("cem", sample=3)
    with pytest.raises(InvalidInputError, match="interaction must be a"):
        Mppi(interaction="mujoco")
    area = ClearanceArea(SQUARE + 5.0, np.ones(4, np.bool_))
    with pytest.raises(InvalidInputError, match="needs a robot with a differential drive"):
        make_policy("mppi").act(room(goal=area))


def test_a_robot_in_a_wall_or_cut_off_from_its_goal_still_gets_commands():
    inside = replace(room(Drive.DIFFERENTIAL, min_speed=-1.0), robot_pose=np.array([4.2, 7.0, 0.0]))
    back = [twist.linear for _, twist in drive(make_policy("mppi"), inside, 4)]
    assert min(back) < 0.0
    wall = np.array([[7.0, 0.0], [7.2, 0.0], [7.2, 10.0], [7.0, 10.0]])
    walled = replace(room(), static=StaticMap.build(polygons=[wall], bounds=[0, 0, 10, 10]))
    assert make_policy("mppi", samples=8).act(walled).linear == 1.0
    line = room(walls=False, goal=GoalLine(np.array([8.0, 0.0]), np.array([1.0, 0.0])))
    assert make_policy("mppi", samples=8).act(replace(line, movables=Movables.empty())).linear == 1


def test_a_crowd_of_objects_with_a_goal_is_kept_whole():
    area = ClearanceArea(4.0 * SQUARE + 5.0, np.ones(4, np.bool_))
    world = room(Drive.DIFFERENTIAL, walls=False, goal=area)
    places = [(0.2 + 0.2 * (k % 48), 0.3 + 0.3 * (k // 48), 0.0) for k in range(60)]
    crowd = Movables.from_outlines([0.1 * SQUARE] * 60, places)
    assert len(RolloutModel(replace(world, movables=crowd), SMALL).world.movables) == 60
    line = room(walls=False, goal=GoalLine(np.array([8.0, 0.0]), np.array([1.0, 0.0])))
    far = replace(line, movables=crowd, robot_pose=np.array([9.5, 9.5, 0.0]))
    assert len(RolloutModel(far, replace(SMALL, steps=2)).world.movables) == 0


def test_a_term_of_a_user_is_added_to_the_cost():
    """With a price on the right half of the room the robot keeps to the left one."""
    world = room()
    asked = []

    def right_half(world, rollouts):
        asked.append((world, rollouts))
        return 50.0 * np.maximum(5.0 - rollouts.paths[:, :, 1], 0.0).max(axis=1)

    def plan(*costs):
        policy = make_policy("mppi", samples=64, costs=costs)
        policy.reset(world, np.random.default_rng(0))
        policy.act(world)
        return policy.current_plan.poses

    assert plan()[:, 1].min() < 4.5
    assert plan(right_half)[:, 1].min() > 4.9
    seen, rollouts = asked[0]
    assert seen.movables == world.movables
    assert rollouts.objects.shape == (64, 2, 3)
    ends = rollouts.paths[np.arange(64), rollouts.ends]
    assert (ends == rollouts.paths[:, -1]).all()
    nothing = plan(lambda world, rollouts: np.zeros(len(rollouts.paths)))
    assert nothing.tobytes() == plan().tobytes()


@pytest.mark.parametrize(
    "wrong", [lambda w, r: np.zeros(3), lambda w, r: np.full(len(r.paths), math.nan), "left"]
)
def test_terms_that_are_no_costs_are_one_clear_line(wrong):
    with pytest.raises(InvalidInputError, match="cost"):
        policy = make_policy("mppi", samples=8, costs=[wrong])
        policy.reset(room(), np.random.default_rng(0))
        policy.act(room())
