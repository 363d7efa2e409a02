"""Result of the GTSP solver."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from pushplan.errors import InvalidInputError


class TourStatus(enum.Enum):
    """Outcome of a call; ``remedy`` says what the caller can do about it."""

    OPTIMAL = ("optimal", "Follow the tour: no cheaper one exists.")
    FEASIBLE = (
        "feasible",
        "Follow the tour: it is good, but not proven to be the cheapest. For a proof allow more "
        "time and ask for a lower bound.",
    )
    INFEASIBLE = (
        "infeasible",
        "No tour visits every cluster over finite arcs: check the infinite costs, or leave out the "
        "clusters that cannot be reached or left.",
    )
    TIMED_OUT = (
        "timed_out",
        "No tour was found before the stop rule fired: allow more time or iterations, or check "
        "whether the finite arcs allow a tour at all.",
    )
    CANCELLED = ("cancelled", "The call was cancelled before there was a tour: call again.")

    def __init__(self, label: str, remedy: str) -> None:
        self.label = label
        self.remedy = remedy

    @property
    def has_tour(self) -> bool:
        """True if a result of this status carries a tour."""
        return self in (TourStatus.OPTIMAL, TourStatus.FEASIBLE)


@dataclass(frozen=True)
class TourStats:
    """Statistics of a call.

    Args:
        wall_time_s: time inside the call [s].
        best_s: time until the returned tour was found [s], NaN without one.
        iterations: rounds of ruin and recreate.
        method: ``"exact"``, ``"search"`` or ``"none"``.
        detail: further numbers, by name.
    """

    wall_time_s: float
    best_s: float = math.nan
    iterations: int = 0
    method: str = "none"
    detail: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Tour:
    """A closed tour through one node of every cluster.

    Args:
        nodes: the nodes in visiting order, beginning with that of the first cluster: numbers, or
            those of a NetworkX graph; empty without a tour.
        cost: sum of the arcs, the one back to the first node included; infinite without a tour, 0
            for a single cluster.
        lower_bound: no tour is cheaper than this; -inf where nothing is known.
        status: how the call ended.
        stats: what it did.
    """

    nodes: tuple[Any, ...]
    cost: float
    lower_bound: float
    status: TourStatus
    stats: TourStats

    def __post_init__(self) -> None:
        if bool(self.nodes) != self.status.has_tour:
            raise InvalidInputError(
                f"a result with status {self.status.label} must "
                f"{'have' if self.status.has_tour else 'not have'} nodes"
            )

    @property
    def gap(self) -> float:
        """Greatest possible gap to the optimum, as a fraction of the cost; inf if unknown."""
        if not self.nodes or self.lower_bound == -math.inf:
            return math.inf
        short = self.cost - self.lower_bound
        if short <= 0.0:
            return 0.0
        return short / abs(self.cost) if self.cost else math.inf
