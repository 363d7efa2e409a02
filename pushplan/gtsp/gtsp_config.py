"""Parameters of the sequencing solver."""

from __future__ import annotations

from dataclasses import dataclass

from pushplan.world.checks import choice, integer, number
from pushplan.world.errors import InvalidInputError

METHODS = ("auto", "exact", "search")


@dataclass(frozen=True)
class GtspConfig:
    """Parameters of `solve_gtsp`. Temperatures are in units of a mean reduced arc of the tour.

    Args:
        method: ``"exact"`` (dynamic programming), ``"search"``, or ``"auto"``: exact where the
            table is small enough and the time long enough.
        iterations: rounds of the search where the stop rule sets no limit.
        exact_clusters: clusters that ``"auto"`` takes to dynamic programming at most.
        memory_mb: of a table of dynamic programming at most [MB].
        lower_bound: whether to spend time on a lower bound and a proof.
        proof_fraction: of a time budget that the proof may take.
        proof_states: paths that the proof keeps at once at most.
        neighbours: clusters on the list of each cluster; a third more where costs differ both ways.
        swap_neighbours: of these, how many a segment swap tries.
        max_removed: clusters that a round takes out at most.
        removed_fraction: the same, as a fraction of all clusters (but at least 4).
        blink: fraction of places that an insertion overlooks (Christiaens and Vanden Berghe 2020).
        hot: temperature at the beginning of a run.
        cold: temperature at its end.
        frozen: a run ends early at this fraction of the temperature at which its tour was cheapest.
        restarts: runs from a random order that a budget is planned for at most; where they end
            early there are more.
        run_rounds: rounds that a run should have for each pair of clusters; fewer runs where they
            would not.
        search_nodes: nodes that a search works with at most; of larger instances it keeps the
            most promising ones of each cluster.
        chunk_s: time between two looks at the stop rule [s], where it can be foreseen.
    """

    method: str = "auto"
    iterations: int = 60_000
    exact_clusters: int = 16
    memory_mb: float = 1024.0
    lower_bound: bool = False
    proof_fraction: float = 0.7
    proof_states: int = 2_000_000
    neighbours: int = 12
    swap_neighbours: int = 8
    max_removed: int = 20
    removed_fraction: float = 0.3
    blink: float = 0.01
    hot: float = 2.0
    cold: float = 0.03
    frozen: float = 0.4
    restarts: int = 12
    run_rounds: float = 8.0
    search_nodes: int = 3000
    chunk_s: float = 0.002

    def __post_init__(self) -> None:
        choice("method", self.method, METHODS)
        if not isinstance(self.lower_bound, bool):
            raise InvalidInputError(f"lower_bound must be True or False, got {self.lower_bound!r}")
        for name in ("iterations", "neighbours", "swap_neighbours", "max_removed", "restarts"):
            integer(name, getattr(self, name), low=1)
        integer("exact_clusters", self.exact_clusters, low=1, high=30)
        integer("search_nodes", self.search_nodes, low=1)
        integer("proof_states", self.proof_states, low=1)
        for name in ("memory_mb", "hot", "cold", "run_rounds", "chunk_s"):
            number(name, getattr(self, name), low=0.0, open_low=True)
        for name in ("proof_fraction", "removed_fraction", "frozen"):
            number(name, getattr(self, name), low=0.0, high=1.0)
        number("blink", self.blink, low=0.0, high=0.5)
