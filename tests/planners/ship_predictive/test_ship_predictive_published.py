"""The published predictive planner: what it minimises, and at its doors."""

import numpy as np
import pytest
from ice_scenes import channel

from pushplan.interaction.network import IceNetwork
from pushplan.planners import make_planner
from pushplan.planners.ship_predictive import PredictivePublished
from pushplan.world import (
    GoalDisc,
    GoalLine,
    InvalidInputError,
    MaxIterations,
    Movables,
    PlanStatus,
    RobotModel,
    StaticMap,
    World,
)

SQUARE = 0.5 * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
BLOCK = [(0.7 * SQUARE, [x, 4.5, 0.0]) for x in (-0.8, 0.0, 0.8)]


class CountingNetwork(IceNetwork):
    """Says that nothing moves, and counts calls and patches."""

    def __init__(self):
        super().__init__()
        self.sizes = []

    def predict_patches(self, patches):
        self.sizes.append(len(patches))
        return patches[:, 0].copy(), np.zeros(len(patches))


def test_it_goes_round_what_it_would_change():
    world = channel(BLOCK)
    assert world.goal.distance(0.0, 0.0) == 9.0
    short = PredictivePublished(change_weight=0.0).plan(world).plan
    round_ = PredictivePublished().plan(world).plan
    assert short.length == pytest.approx(9.0, abs=0.05)
    assert round_.length > short.length
    crossing = round_.poses[np.abs(round_.poses[:, 1] - 4.5) < 0.3]
    assert (np.abs(crossing[:, 0]) > 1.2).all()


def test_all_edges_of_a_node_are_predicted_in_one_call():
    network = CountingNetwork()
    result = PredictivePublished(network=network).plan(channel(BLOCK))
    assert result.plan.length == pytest.approx(9.0, abs=0.05)  # no change, no detour
    assert len(network.sizes) <= result.stats.iterations
    assert max(network.sizes) >= 3


@pytest.mark.parametrize("heading", [0.5, 1.3, 2.4])
def test_plans_can_be_driven(heading):
    world = channel(BLOCK, pose=[0.5, 0.0, heading])
    plan = make_planner("ship-predictive-published").plan(world).plan
    assert plan.poses[0] == pytest.approx(world.robot_pose)
    assert world.goal.distance(*plan.poses[-1, :2]) <= 1e-9
    assert (np.abs(plan.turn_rates) <= world.robot.max_turn_rate).all()
    assert (np.abs(plan.poses[:, 0]) <= 6.0).all()
    steps = np.hypot(*np.diff(plan.poses[:, :2], axis=0).T)
    bends = np.abs(np.diff(plan.poses[:, 2])) / steps
    assert (bends <= 1.0 / world.robot.turning_radius + 1e-6).all()


def test_statuses():
    planner = PredictivePublished()
    found = {
        "outside": planner.plan(channel([], pose=[8.0, 1.0, 1.5])),
        "beyond": planner.plan(channel([], goal=60.0)),
        "no time": planner.plan(channel(BLOCK), stop=MaxIterations(2)),
        "past": planner.plan(channel([], pose=[0.0, 9.5, 1.5])),
    }
    assert found["outside"].status is PlanStatus.START_BLOCKED
    assert found["beyond"].status is PlanStatus.GOAL_UNREACHABLE
    assert found["no time"].status is PlanStatus.TIMED_OUT
    assert found["past"].status is PlanStatus.SOLVED and len(found["past"].plan.poses) == 1


def test_other_goals_are_refused():
    world = channel([])
    disc = World(world.robot, world.robot_pose, world.static, world.movables, GoalDisc([0, 5], 1.0))
    with pytest.raises(InvalidInputError):
        PredictivePublished().plan(disc)
    with pytest.raises(InvalidInputError):
        PredictivePublished(change_weight=-1.0)


def test_a_basin_smaller_than_the_ship_is_no_crash():
    hull = 1.7 * np.array([[1.0, 0.3], [-1.0, 0.3], [-1.0, -0.3], [1.0, -0.3]])
    ship = RobotModel.from_outline(
        hull, mass=1.0, drive="constant_speed", max_speed=0.3, max_turn_rate=0.5
    )
    world = World(
        ship,
        [0.01, 0.04, 0.5],
        StaticMap.build(bounds=[0.0, 0.0, 0.0174, 0.0878]),
        Movables.empty(),
        GoalLine([0.0087, 0.08], [0.0, 1.0]),
    )
    result = make_planner("ship-predictive-published").plan(world, stop=MaxIterations(50))
    assert result.status is PlanStatus.START_BLOCKED
