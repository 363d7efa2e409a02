"""Bounds of scenarios, the best solutions known, and gaps of episodes to both."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pushplan.evaluation.statistics.stored_run import StoredRun
from pushplan.evaluation.statistics.summary import grouped
from pushplan.evaluation.store.rows import ResultRow
from pushplan.scenarios import Scenario
from pushplan.scenarios.known_bounds import KnownBounds
from pushplan.world import GoalDisc, GoalLine


@dataclass(frozen=True)
class Gap:
    """Gaps of a policy's successful episodes to the best known and to the bound, as fractions.

    Args:
        setting: the scenarios without their seeds.
        policy: label.
        count: successful episodes of scenarios of which a bound is known.
        to_bound: mean of work / bound - 1.
        with_best: those of which a best known solution is known.
        to_best: mean of work / best known - 1; NaN if there are none. Below 0 where the policy
            found better ones.
    """

    setting: str
    policy: str
    count: int
    to_bound: float
    with_best: int
    to_best: float


def total_work(row: ResultRow, known: KnownBounds) -> float | None:
    """m₀ l₀ + Σ mᵢ lᵢ of an episode that succeeded [kg m], else None."""
    length = row.metrics.get("path_length_m")
    work = row.metrics.get("interaction_work_kg_m")
    if row.failed or not row.success or length is None or work is None:
        return None
    return known.robot_mass * length + work


def gaps(
    rows: Sequence[ResultRow], policies: Sequence[str], bounds: Mapping[str, KnownBounds]
) -> list[Gap]:
    """The gaps of each policy in each setting; none where no bound is known."""
    found = []
    for (setting, policy), group in grouped(rows, policies).items():
        to_bound = []
        to_best = []
        for row in group:
            mine = bounds.get(row.scenario)
            if mine is None or (work := total_work(row, mine)) is None or mine.bound <= 0.0:
                continue
            to_bound.append(work / mine.bound - 1.0)
            if mine.best is not None:
                to_best.append(work / mine.best - 1.0)
        if to_bound:
            mean = float(np.mean(to_best)) if to_best else float("nan")
            to = float(np.mean(to_bound))
            found.append(Gap(setting, policy, len(to_bound), to, len(to_best), mean))
    return sorted(found, key=lambda gap: gap.setting)


def scenario_bound(scenario: Scenario, *, most_nodes: int = 400) -> KnownBounds:
    """The proven bound of one scenario, from its start, whatever action is chosen.

    Args:
        scenario: its environment is made and reset.
        most_nodes: of the proof, see `pushplan.motion.work_bound`.
    """
    # a report needs none of these
    from pushplan.envs.making import make
    from pushplan.motion.work_bound import transport_bound, work_bound

    # the freest action: what turns on the spot is not bound by the turns of what cannot
    env = make(scenario, observation="state", action=("velocity", "turn_rate"))
    try:
        env.reset(seed=scenario.seed)
        world = env.true_world
    finally:
        env.close()
    if isinstance(world.goal, GoalDisc | GoalLine):
        bound = work_bound(world, most_nodes=most_nodes).work
    else:
        bound = transport_bound(world)
    return KnownBounds(world.robot.mass, bound)


def with_solutions(
    bounds: Mapping[str, KnownBounds], runs: Iterable[StoredRun]
) -> dict[str, KnownBounds]:
    """The bounds, with the best solutions of some runs.

    Args:
        bounds: by `Scenario.key`; other scenarios of the runs are left out.
        runs: their results.
    """
    found = dict(bounds)
    for row in itertools.chain.from_iterable(run.rows for run in runs):
        known = found.get(row.scenario)
        if known is not None and (work := total_work(row, known)) is not None:
            found[row.scenario] = known.better(work, row.policy)
    return found
