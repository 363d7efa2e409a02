"""`Mppi`: one decision of sampling-based predictive control."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from pushplan.interaction import InteractionModel
from pushplan.planners.mppi.costs import RolloutCost, total_cost
from pushplan.planners.mppi.mppi_config import MppiConfig
from pushplan.planners.mppi.rollout_model import (
    ControlSequence,
    RolloutModel,
    Rollouts,
    draw,
    first_spread,
    least_controls,
    resting,
)
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


def exponential_weights(costs: FloatArray, temperature: float) -> FloatArray:
    """Weights proportional to exp(-(J - min J) / λ), as path integral control has them.

    λ is ``temperature`` times (lower quartile of J - min J): Williams et al. (ICRA 2017, eq. 17)
    take it in units of the cost, which would have to be chosen for every task anew. The quartile,
    not the median, as up to half of the samples may run into walls, and cost far more.

    Args:
        costs: (S,) J of each sample.
        temperature: positive.

    Returns:
        (S,) weights, with sum 1.
    """
    above = costs - costs.min()
    scale = temperature * float(np.quantile(above, 0.25))
    if scale <= 0.0:  # a quarter of the samples are as good as the best
        weights = (above == 0.0).astype(np.float64)
    else:
        weights = np.exp(-above / scale)
    normal: FloatArray = weights / weights.sum()
    return normal


def elite_weights(costs: FloatArray, fraction: float) -> FloatArray:
    """Equal weights of the best samples, as the cross-entropy method has them.

    Rubinstein and Kroese, "The Cross-Entropy Method", 2004, algorithm 4.2.1.

    Args:
        costs: (S,) J of each sample.
        fraction: of the samples that are kept, one at least.

    Returns:
        (S,) weights, with sum 1.
    """
    count = max(1, math.ceil(fraction * len(costs)))
    weights = np.zeros(len(costs))
    weights[np.argsort(costs, kind="stable")[:count]] = 1.0 / count
    return weights


def updated(
    config: MppiConfig, samples: FloatArray, costs: FloatArray, spread: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The next mean and standard deviation of the controls at the knots.

    Args:
        config: names the rule.
        samples: (S, M, 2) controls at the knots.
        costs: (S,) their costs.
        spread: (M, 2) the standard deviation that they were drawn with.

    Returns:
        (M, 2) mean, (M, 2) standard deviation; path integral control leaves the latter as it is.
    """
    if config.update == "mppi":
        weights = exponential_weights(costs, config.temperature)
        return np.tensordot(weights, samples, 1), spread
    weights = elite_weights(costs, config.elite)
    mean = np.tensordot(weights, samples, 1)
    return mean, np.sqrt(np.tensordot(weights, (samples - mean) ** 2, 1))
