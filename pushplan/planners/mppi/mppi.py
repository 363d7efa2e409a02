"""`Mppi`: one decision of sampling-based predictive control."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from pushplan.interaction import InteractionModel
from pushplan.planners.mppi.control_sequence import (
    ControlSequence,
    draw,
    first_spread,
    least_controls,
    resting,
)
from pushplan.planners.mppi.costs import RolloutCost, total_cost
from pushplan.planners.mppi.mppi_config import MppiConfig
from pushplan.planners.mppi.rollout_model import RolloutModel, Rollouts
from pushplan.planners.mppi.update_rules import updated
from pushplan.world import Plan, PlanResult, PlanStatus, Stop, World
from pushplan.world.checks import FloatArray, expect
from pushplan.world.planning_call import PlanningCall


@dataclass(frozen=True)
class Decision:
    """The controls of one decision, and the plan that they make.

    Args:
        controls: the new nominal controls.
        result: the plan up to the horizon, its cost as ``detail["cost"]``.
    """

    controls: ControlSequence
    result: PlanResult


@dataclass(frozen=True)
class Mppi:
    """Draws control sequences around the last ones, rolls them out and weighs them by their cost.

    Model predictive path integral control (Williams et al., ICRA 2017) and, with another update,
    the cross-entropy method (Rubinstein and Kroese 2004). Noise is drawn for a few knots in time,
    as in MuJoCo MPC (Howell et al., arXiv 2212.00541), part of the samples are plain arcs, and
    where the weighted mean costs more than the best sample, that one is taken.

    Args:
        config: settings.
        interaction: predicts the objects; see `RolloutModel`.
        costs: terms that are added to those of the task.
    """

    config: MppiConfig = field(default_factory=MppiConfig)
    interaction: InteractionModel | None = None
    costs: Sequence[RolloutCost] = ()

    def __post_init__(self) -> None:
        expect("config", self.config, MppiConfig)
        if self.interaction is not None:
            expect("interaction", self.interaction, InteractionModel)  # type: ignore[type-abstract]
        for cost in self.costs:
            expect("costs", cost, RolloutCost)  # type: ignore[type-abstract]

    def decide(
        self,
        world: World,
        costs: Sequence[RolloutCost],
        nominal: ControlSequence | None = None,
        *,
        stop: Stop | None = None,
        rng: np.random.Generator | None = None,
    ) -> Decision:
        """Improve control sequences from a snapshot.

        Args:
            world: the snapshot.
            costs: terms of the task; `Mppi.costs` come on top.
            nominal: controls to begin with, such as the last ones; at rest if None.
            stop: looked at after each iteration; `MppiConfig.iterations` of them if None.
            rng: the only source of randomness.
        """
        call = PlanningCall(world, stop, rng)
        config = self.config
        model = RolloutModel(world, config, self.interaction)
        terms = (*costs, *self.costs)
        if nominal is None:
            nominal = resting(world.robot, config, world.time, model.horizon)
        mean = nominal.later(world.time).knots
        spread = first_spread(world.robot, config)
        low = least_controls(world.robot)
        best = mean
        least = np.inf
        done = 0
        for done in range(1, config.iterations + 1):
            samples = draw(call.rng, mean, spread, low, config)
            totals = total_cost(terms, model.world, model.roll(samples))
            k = int(np.argmin(totals))
            if totals[k] < least:
                best = samples[k]
                least = float(totals[k])
            mean, spread = updated(config, samples, totals, spread)
            if call.check(done, least):
                break
        rollouts = model.roll(np.stack([mean, best]))
        totals = total_cost(terms, model.world, rollouts)
        chosen = int(np.argmin(totals))
        controls = ControlSequence(world.time, model.horizon, (mean, best)[chosen])
        result = call.result(
            PlanStatus.APPROXIMATE,
            _plan(world, model, rollouts, chosen),
            iterations=done,
            cost=float(totals[chosen]),
        )
        return Decision(controls, result)


def _plan(world: World, model: RolloutModel, rollouts: Rollouts, s: int) -> Plan:
    """The plan of one rollout."""
    end = int(rollouts.ends[s])
    parts = model.substeps
    poses: FloatArray = rollouts.paths[s, : end + 1]
    twists = np.repeat(rollouts.twists[s], parts, axis=0)
    twists = np.concatenate([twists, twists[-1:]])[: end + 1]
    length = float(np.hypot(*np.diff(poses[:, :2], axis=0).T).sum())
    return Plan(
        times=model.period / parts * np.arange(end + 1, dtype=np.float64),
        poses=poses,
        speeds=twists[:, 0],
        turn_rates=twists[:, 1],
        travel_cost=world.robot.mass * length,
        interaction_cost=float(rollouts.works[s]),
    )
