"""The predictive ship planners at their doors."""

import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ice_scenes import channel, straight_path

from pushplan.envs.tasks.ship_ice import ShipIceTask
from pushplan.interaction.ice_interaction import IceInteraction
from pushplan.planners import make_planner, make_policy
from pushplan.planners.ship_predictive import (
    PredictiveConfig,
    PredictiveShip,
    PredictiveShipNetwork,
)
from pushplan.world import (
    Cancellation,
    GoalDisc,
    GoalLine,
    InvalidInputError,
    MaxIterations,
    Movables,
    Planner,
    PlanStatus,
    StaticMap,
    Stop,
    World,
    stream,
)

NAMES = ("ship-predictive", "ship-predictive-network")
SQUARE = 0.5 * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])


class BusyTime(Stop):
    """A deadline on the CPU time of this thread, which others' work on the machine is not in."""

    def __init__(self, budget_s):
        self.budget_s = budget_s

    def start(self):
        end = time.thread_time() + self.budget_s
        return lambda iterations, cost: time.thread_time() >= end


def ice(concentration: float, seed: int = 1000) -> World:
    task = ShipIceTask(variations={"concentration": concentration})
    return task.start(stream(seed, "layout"))


def curvatures(poses):
    steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    turns = np.abs(np.diff(poses[:, 2]))
    return turns / steps


def along_y(world, step=0.1):
    path = straight_path(world.robot_pose[1], world.goal.point[1], step)
    path[:, 0] = world.robot_pose[0]
    return path


@pytest.mark.parametrize("name", NAMES)
class TestEveryPredictivePlanner:
    def test_it_is_a_planner(self, name):
        assert isinstance(make_planner(name), Planner)

    @pytest.mark.parametrize("concentration", [0.1, 0.4])
    def test_a_plan_can_be_driven_and_ends_at_the_line(self, name, concentration):
        world = ice(concentration)
        result = make_planner(name).plan(world)
        plan = result.plan
        assert result.status is PlanStatus.SOLVED
        assert plan.poses[0] == pytest.approx(world.robot_pose)
        assert world.goal.distance(*plan.poses[-1, :2]) <= 1e-9
        assert (curvatures(plan.poses) <= 1.0 / world.robot.turning_radius + 1e-6).all()
        assert (np.abs(plan.turn_rates) <= world.robot.max_turn_rate).all()
        x_low, _, x_high, _ = world.static.bounds
        assert (plan.poses[:, 0] >= x_low).all() and (plan.poses[:, 0] <= x_high).all()
        assert plan.length == pytest.approx(plan.travel_cost / world.robot.mass, rel=1e-3)
        assert plan.duration == pytest.approx(plan.length / world.robot.max_speed, rel=1e-3)

    def test_the_prediction_is_that_of_the_model(self, name):
        world = ice(0.3)
        plan = make_planner(name).plan(world).plan
        swept = IceInteraction().sweep(world, plan.poses)
        assert plan.object_poses.shape == swept.object_poses.shape
        assert plan.interaction_cost == pytest.approx(swept.work, rel=0.02, abs=1e-6)

    def test_it_moves_less_ice_than_going_straight(self, name):
        ratios = []
        for seed in (1001, 1002):
            world = ice(0.3, seed)
            straight = IceInteraction().sweep(world, along_y(world)).work
            ratios.append(make_planner(name).plan(world).plan.interaction_cost / straight)
        assert np.mean(ratios) < 0.5

    def test_open_water_is_crossed_straight(self, name):
        plan = make_planner(name).plan(channel([])).plan
        assert plan.length == pytest.approx(9.0, abs=0.11)
        assert plan.interaction_cost == 0.0

    def test_same_call_same_bytes(self, name):
        world = ice(0.2)
        first, second = (make_planner(name).plan(world).plan for _ in range(2))
        assert first == second

    def test_a_full_channel_is_broken_through(self, name):
        floes = [(0.98 * SQUARE, [x, y, 0.0]) for x in np.arange(-5.5, 6) for y in (3.0, 4.0, 5.0)]
        result = make_planner(name).plan(channel(floes))
        assert result.status is PlanStatus.SOLVED
        assert result.plan.interaction_cost > 0.5

    def test_past_the_line_there_is_nothing_to_do(self, name):
        result = make_planner(name).plan(channel([], pose=[0, 9.5, np.pi / 2]))
        assert result.status is PlanStatus.SOLVED
        assert len(result.plan.poses) == 1

    def test_outside_the_channel_is_blocked(self, name):
        result = make_planner(name).plan(channel([], pose=[8.0, 1.0, np.pi / 2]))
        assert result.status is PlanStatus.START_BLOCKED

    def test_a_line_beyond_the_channel_is_out_of_reach(self, name):
        result = make_planner(name).plan(channel([], goal=60.0))
        assert result.status is PlanStatus.GOAL_UNREACHABLE

    def test_other_goals_and_walls_are_refused(self, name):
        world = channel([])
        disc = World(
            world.robot, world.robot_pose, world.static, world.movables, GoalDisc([0, 5], 1.0)
        )
        walls = StaticMap.build(polygons=[SQUARE + np.array([0, 4])], bounds=[-5, -1, 5, 20])
        for bad in (disc, channel([], static=walls)):
            with pytest.raises(InvalidInputError):
                make_planner(name).plan(bad)

    def test_it_stops_when_told(self, name):
        world = ice(0.5)
        token = Cancellation()
        token.cancel()
        assert make_planner(name).plan(world, stop=token).status is PlanStatus.CANCELLED
        assert make_planner(name).plan(world, stop=MaxIterations(0)).plan is None
        busy = time.thread_time()
        result = make_planner(name).plan(world, stop=BusyTime(0.2))
        assert result.plan is not None
        assert time.thread_time() - busy < 0.23

    def test_more_iterations_are_never_worse(self, name):
        world = ice(0.3, 1005)
        costs = [
            make_planner(name).plan(world, stop=MaxIterations(limit)).stats.detail["cost"]
            for limit in (20, 60, 200)
        ]
        assert costs[0] >= costs[1] >= costs[2]


def turn_fits(world, side):
    """Whether the tightest turn to one side gets the ship of `channel` to look along y."""
    x, y, theta = world.robot_pose
    radius = world.robot.turning_radius / 0.999
    turn = (side * (0.5 * np.pi - theta)) % (2.0 * np.pi)
    at = theta + side * np.linspace(0.0, turn, 200)
    xs = x + side * radius * (np.sin(at) - np.sin(theta))
    ys = y - side * radius * (np.cos(at) - np.cos(theta))
    arrived = np.flatnonzero(ys >= 9.0)
    end = arrived[0] + 1 if len(arrived) else None
    return bool((np.abs(xs[:end]) < 6.0).all() and (ys[:end] > -1.0).all())


@settings(max_examples=30)
@given(seed=st.integers(0, 100_000))
def test_plans_from_anywhere_can_be_driven(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(0, 40))
    floes = [
        (
            rng.uniform(0.05, 1.0) * SQUARE,
            [rng.uniform(-6, 6), rng.uniform(-1, 12), rng.uniform(0, 7)],
        )
        for _ in range(count)
    ]  # they may overlap each other and the ship
    world = channel(floes, pose=[rng.uniform(-7, 7), rng.uniform(-2, 10), rng.uniform(-7, 7)])
    result = PredictiveShip(PredictiveConfig(width=2)).plan(world)
    if result.plan is None:
        outside = np.abs(world.robot_pose[0]) > 6.0 or world.robot_pose[1] < -1.0
        if outside:
            assert result.status is PlanStatus.START_BLOCKED
        else:
            assert result.status in (PlanStatus.START_BLOCKED, PlanStatus.TIMED_OUT)
            assert not any(turn_fits(world, side) for side in (1.0, -1.0))
        return
    plan = result.plan
    assert np.isfinite(plan.object_poses).all()
    if len(plan.poses) > 1:
        assert (curvatures(plan.poses) <= 1.0 / world.robot.turning_radius + 1e-6).all()
        assert world.goal.distance(*plan.poses[-1, :2]) <= 1e-9
        assert (np.abs(plan.poses[:, 0]) <= 6.0 + 1e-9).all()


def test_the_frame_does_not_matter():
    floes = [(0.6 * SQUARE, [x, y, 0.3 * x]) for x in (-0.6, 0.3, 1.2) for y in (2.5, 4.0, 5.5)]
    world = channel(floes)
    plan = PredictiveShip().plan(world).plan
    flat = World(  # a quarter turn clockwise: the goal lies along +x
        world.robot,
        [0.0, 0.0, 0.0],
        StaticMap.build(bounds=[-1.0, -6.0, 39.0, 6.0]),
        Movables.from_outlines(
            [outline for outline, _ in floes], [[y, -x, t - np.pi / 2] for _, (x, y, t) in floes]
        ),
        GoalLine([9.0, 0.0], [1.0, 0.0]),
    )
    turned = PredictiveShip().plan(flat).plan
    assert turned.poses[:, 0] == pytest.approx(plan.poses[:, 1], abs=1e-6)
    assert turned.poses[:, 1] == pytest.approx(-plan.poses[:, 0], abs=1e-6)


@pytest.mark.parametrize("name", ["ship-predictive", "ship-predictive-published"])
def test_the_margin_of_a_world_is_kept_from_the_sides_of_the_channel(name):
    """The ice leaves a gap at a side, 6 m from the middle; half a beam is 0.25 m."""
    ice_row = [(2.0 * SQUARE, [x, 4.0, 0.0]) for x in (-5.0, -2.8, -0.6, 1.6, 3.6)]
    world = channel(ice_row, pose=[4.25, 1.0, np.pi / 2])
    sides = [
        float(make_planner(name).plan(replace(world, margin=margin)).plan.poses[:, 0].max())
        for margin in (0.0, 1.0)
    ]
    assert sides[0] > 6.0 - 0.25 - 1.0 >= sides[1] - 1e-9


@pytest.mark.parametrize(
    "pose",
    [
        [3.61, 2.79, -0.47],  # room for a turn to the left only if the margin is given up
        [-5.94, 8.31, 1.79],  # nearly at the side, and drifting towards it
        [5.79, -0.6, -2.37],  # needs the whole turn rate
        [-2.99, 8.47, -1.95],  # has to go back first
    ],
)
@pytest.mark.parametrize("name", NAMES)
def test_ways_out_of_tight_places(name, pose):
    world = channel([(0.5 * SQUARE, [0.0, 5.0, 0.0])], pose=pose)
    result = make_planner(name).plan(world)
    assert result.status is PlanStatus.SOLVED
    assert (curvatures(result.plan.poses) <= 1.0 / world.robot.turning_radius + 1e-6).all()
    assert (np.abs(result.plan.poses[:, 0]) <= 6.0).all()
    assert (result.plan.poses[:, 1] >= -1.0).all()


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    ("bounds", "goal", "status"),
    [
        ([-6.0, -30.0, 6.0, 3000.0], 2000.0, PlanStatus.APPROXIMATE),
        ([-3000.0, -3000.0, 3000.0, 3000.0], 2000.0, PlanStatus.APPROXIMATE),
        ([-3000.0, -3000.0, 3000.0, 3000.0], 9.0, PlanStatus.SOLVED),
        ([-1e-6, -1.0, 1e-6, 39.0], 9.0, PlanStatus.SOLVED),
    ],
)
def test_waters_of_any_size(name, bounds, goal, status):
    floes = [(0.6 * SQUARE, [x, 4.0, 0.3]) for x in (-2.0, 0.0, 2.0)]
    world = channel(floes, static=StaticMap.build(bounds=bounds), goal=goal)
    result = make_planner(name).plan(world, stop=MaxIterations(250))
    assert result.status is status
    assert result.plan.length == pytest.approx(min(goal, 80.0), rel=0.1)


def test_every_stop_leaves_a_whole_plan_or_none():
    world = ice(0.3)
    for limit in range(4, 24, 3):
        plan = PredictiveShipNetwork().plan(world, stop=MaxIterations(limit)).plan
        if plan is not None:  # the floes along it may not have been worked out in time
            assert world.goal.distance(*plan.poses[-1, :2]) <= 1e-9
            objects = plan.object_poses
            assert objects is None or objects.shape == (len(plan.poses), len(world.movables), 3)


def test_a_ship_that_heads_back_turns_round():
    world = channel([], pose=[0.0, 10.0, -np.pi / 2], goal=20.0)
    result = PredictiveShip().plan(world)
    assert result.status is PlanStatus.SOLVED
    assert abs(result.plan.poses[-1, 2] % (2 * np.pi) - np.pi / 2) < 0.6


def test_a_larger_weight_moves_less_ice():
    worlds = [ice(0.3, 1006)]
    works = [
        sum(
            PredictiveShip(PredictiveConfig(push_weight=w)).plan(world).plan.interaction_cost
            for world in worlds
        )
        for w in (0.1, 5.0)
    ]
    assert works[1] < works[0]


@pytest.mark.parametrize(
    "name", ["ship-predictive", pytest.param("ship-predictive-network", marks=pytest.mark.slow)]
)
def test_the_policy_crosses_the_ice(name):
    from pushplan.envs import make
    from pushplan.evaluation import run_episode
    from pushplan.scenarios import Scenario

    scenario = Scenario(
        task="ship_ice",
        simulator="pymunk",
        preset="benchmark",
        variations={"concentration": 0.2},
        seed=1000,
    )
    episode = run_episode(make(scenario, observation="state"), make_policy(name), scenario)
    assert episode.success


@pytest.mark.parametrize(
    "values",
    [{"width": 0}, {"push_weight": -1.0}, {"turn_fraction": 1.5}, {"arc": np.nan}, {"widest": 1}],
)
def test_bad_parameters(values):
    with pytest.raises(InvalidInputError):
        PredictiveConfig(**values)


def test_a_missing_network_is_one_clear_error(tmp_path):
    from pushplan.interaction.network import IceNetwork

    planner = PredictiveShipNetwork(network=IceNetwork(tmp_path / "none.onnx"))
    with pytest.raises(InvalidInputError, match="no network"):
        planner.plan(channel([]))
