"""Planners take any interaction model: one with only ``sweep``, one for ice, one that raises."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from pushplan.interaction import Interaction, QuasiStatic
from pushplan.interaction.ice_interaction import IceInteraction
from pushplan.planners import make_planner
from pushplan.world import (
    Drive,
    GoalDisc,
    InvalidInputError,
    MaxIterations,
    Movables,
    PlanStatus,
    RobotModel,
    StaticMap,
    World,
)

SQUARE = 0.5 * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])


@dataclass(frozen=True)
class OnlySweep:
    """What a user writes: `QuasiStatic` without its compiled form."""

    def sweep(self, world, path):
        return QuasiStatic().sweep(world, path)


class Faulty:
    def sweep(self, world, path) -> Interaction:
        raise ZeroDivisionError("of the user's model")


@pytest.fixture
def world() -> World:
    return World(
        robot=RobotModel.from_outline(
            SQUARE, mass=1.0, drive=Drive.CONSTANT_SPEED, max_speed=1.0, max_turn_rate=1.0
        ),
        robot_pose=np.array([2.0, 5.0, 0.0]),
        static=StaticMap.build(bounds=[0.0, 0.0, 10.0, 10.0]),
        movables=Movables.from_outlines(
            [SQUARE] * 3, [[4.0, 5.0, 0.0], [5.2, 5.3, 0.4], [5.0, 4.0, 1.0]]
        ),
        goal=GoalDisc(np.array([8.0, 5.0]), 0.5),
    )


@pytest.mark.parametrize("name", ["kinodynamic-rrt", "push-aware"])
@pytest.mark.parametrize("model", [OnlySweep(), IceInteraction()], ids=["sweep", "ice"])
@pytest.mark.slow
def test_a_model_that_has_only_sweep(name, model, world):
    planner = make_planner(name, interaction=model)
    result = planner.plan(world, stop=MaxIterations(1200), rng=np.random.default_rng(0))
    assert result.status is PlanStatus.SOLVED
    predicted = model.sweep(world, result.plan.poses)
    assert predicted.jammed_at == -1
    assert result.plan.interaction_cost == pytest.approx(predicted.work, rel=0.1, abs=0.05)


@pytest.mark.parametrize("name", ["kinodynamic-rrt", "push-aware"])
@pytest.mark.slow
def test_only_sweep_gives_about_the_plans_of_the_compiled_form(name, world):
    world = replace(world, movables=world.movables.select([0]))
    plans = [
        make_planner(name, interaction=model)
        .plan(world, stop=MaxIterations(1200), rng=np.random.default_rng(1))
        .plan
        for model in (QuasiStatic(), OnlySweep())
    ]
    # a step's way of an object is measured in smaller steps by the compiled form
    assert plans[0].cost == pytest.approx(plans[1].cost, rel=0.03)


def test_an_error_of_the_model_is_raised(world):
    planner = make_planner("kinodynamic-rrt", interaction=Faulty())
    with pytest.raises(ZeroDivisionError, match="of the user's model"):
        planner.plan(world, stop=MaxIterations(2000))
    walled = replace(world, static=StaticMap.build([SQUARE + 8.0], bounds=[0.0, 0.0, 10.0, 10.0]))
    with pytest.raises(InvalidInputError, match="open water"):
        make_planner("push-aware", interaction=IceInteraction()).plan(
            walled, stop=MaxIterations(300)
        )


def test_what_is_no_model_is_refused():
    with pytest.raises(InvalidInputError, match="interaction"):
        make_planner("kinodynamic-rrt", interaction=3.0)
