"""Bounds of scenarios, and the best solutions that stored runs hold."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping

from pushplan.envs.making import make
from pushplan.evaluation.statistics.gaps import total_work
from pushplan.evaluation.statistics.stored_run import StoredRun
from pushplan.motion.work_bound import transport_bound, work_bound
from pushplan.scenarios import Scenario
from pushplan.scenarios.known_bounds import KnownBounds
from pushplan.world import GoalDisc, GoalLine


def scenario_bound(scenario: Scenario, *, most_nodes: int = 400) -> KnownBounds:
    """The proven bound of one scenario, from its start, whatever action is chosen.

    Args:
        scenario: its environment is made and reset.
        most_nodes: of the proof, see `pushplan.motion.work_bound`.
    """
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
