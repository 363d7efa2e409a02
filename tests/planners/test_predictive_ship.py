"""The predictive ship planners at their doors."""

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ice_scenes import channel, straight_path

from pushplan.envs.tasks.ship_ice import ShipIceTask
from pushplan.interaction.ice import IceInteraction
from pushplan.planners import make_planner, make_policy, planner_names, warm_up
from pushplan.planners.predictive import PredictiveConfig, PredictiveShip, PredictiveShipNetwork
from pushplan.world import (
    Cancellation,
    Deadline,
    GoalDisc,
    GoalLine,
    InvalidInputError,
    MaxIterations,
    Movables,
    Planner,
    PlanStatus,
    StaticMap,
    World,
    stream,
)

NAMES = planner_names(open_water=True)
SQUARE = 0.5 * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])


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
        for seed in (1001, 1002, 1003):
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
        warm_up(name)
        world = ice(0.5)
        token = Cancellation()
        token.cancel()
        assert make_planner(name).plan(world, stop=token).status is PlanStatus.CANCELLED
        assert make_planner(name).plan(world, stop=MaxIterations(0)).plan is None
        over = []
        for _ in range(3):
            began, busy = time.perf_counter(), time.process_time()
            result = make_planner(name).plan(world, stop=Deadline(0.1))
            wall = time.perf_counter() - began
            share = min(1.0, (time.process_time() - busy) / wall)  # of the machine that we had
            over.append(share * (wall - 0.1))
            assert result.plan is not None
        assert min(over) < 0.015

    def test_more_iterations_are_never_worse(self, name):
        world = ice(0.3, 1005)
        costs = [
            make_planner(name).plan(world, stop=MaxIterations(limit)).stats.detail["cost"]
            for limit in (20, 120, 500)
        ]
        assert costs[0] >= costs[1] >= costs[2]


@settings(max_examples=60, deadline=None)
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
        assert result.status in (PlanStatus.START_BLOCKED, PlanStatus.GOAL_UNREACHABLE)
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


def test_a_ship_that_heads_back_turns_round():
    world = channel([], pose=[0.0, 10.0, -np.pi / 2], goal=20.0)
    result = PredictiveShip().plan(world)
    assert result.status is PlanStatus.SOLVED
    assert abs(result.plan.poses[-1, 2] % (2 * np.pi) - np.pi / 2) < 0.6


def test_a_larger_weight_moves_less_ice():
    worlds = [ice(0.3, seed) for seed in (1006, 1007, 1008)]
    works = [
        sum(
            PredictiveShip(PredictiveConfig(push_weight=w)).plan(world).plan.interaction_cost
            for world in worlds
        )
        for w in (0.1, 5.0)
    ]
    assert works[1] < works[0]


@pytest.mark.parametrize("name", NAMES)
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
    [{"width": 0}, {"push_weight": -1.0}, {"turn_share": 1.5}, {"arc": np.nan}, {"widest": 1}],
)
def test_bad_parameters(values):
    with pytest.raises(InvalidInputError):
        PredictiveConfig(**values)


def test_a_missing_network_is_one_clear_error(tmp_path):
    from pushplan.interaction.network import IceNetwork

    planner = PredictiveShipNetwork(network=IceNetwork(tmp_path / "none.onnx"))
    with pytest.raises(InvalidInputError, match="no network"):
        planner.plan(channel([]))
