"""Parameters of the sequencing solver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pushplan.world.checked_fields import (
    CheckedFields,
    Fraction,
    Limits,
    OneOf,
    PositiveFloat,
    PositiveInt,
)

METHODS = ("auto", "exact", "search")


@dataclass(frozen=True)
class GtspConfig(CheckedFields):
    """Parameters of `solve_gtsp`. Temperatures are in units of a mean reduced arc of the tour.

    Args:
        method: ``"exact"`` (dynamic programming), ``"search"``, or ``"auto"``: exact where the
            table is small enough and the time long enough.
        iterations: rounds of the search where the stop rule sets no limit.
        exact_clusters: clusters that ``"auto"`` takes to dynamic programming at most.
        memory_mb: of a table of dynamic programming at most [MB].
        lower_bound: spend time on a lower bound and a proof.
        proof_fraction: of a time budget that the proof may take.
        blink: fraction of places that an insertion overlooks (Christiaens and Vanden Berghe 2020).
        hot: temperature at the beginning of a run from a random order.
        frozen: a run ends early at this fraction of the temperature at which its tour was cheapest.
        whole: fraction of what a run from a random order has taken on average; where less is left
            of the budget, runs begin from the best tour.
        narrow_from: size of the cluster of a node, on average over nodes, from which on the search
            keeps promising nodes only.
        narrow_slack: a node is promising if one of the tours so far would have cost at most this
            much more by way of it, in units of the temperature.
        narrow_width: promising nodes of a cluster at most.
        restarts: runs from a random order that a budget is planned for at most; where they end
            early there are more.
        run_rounds: rounds that a run should have for each pair of clusters; fewer runs where they
            would not.
        search_nodes: nodes that a search works with at most; of larger instances it keeps the
            most promising ones of each cluster.
        chunk_s: time between two looks at the stop rule [s], where it can be foreseen.
    """

    method: Annotated[str, OneOf(METHODS)] = "auto"
    iterations: PositiveInt = 60_000
    exact_clusters: Annotated[int, Limits(1, 30)] = 16
    memory_mb: PositiveFloat = 1024.0
    lower_bound: bool = False
    proof_fraction: Fraction = 0.7
    blink: Annotated[float, Limits(0.0, 0.5)] = 0.01
    hot: PositiveFloat = 2.0
    frozen: Fraction = 0.4
    whole: Fraction = 0.8
    narrow_from: PositiveFloat = 7.0
    narrow_slack: PositiveFloat = 1.0
    narrow_width: PositiveInt = 24
    restarts: PositiveInt = 12
    run_rounds: PositiveFloat = 8.0
    search_nodes: PositiveInt = 3000
    chunk_s: PositiveFloat = 0.002
