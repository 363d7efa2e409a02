"""The solver ends in time in every stage, with costs of any size."""

from __future__ import annotations

import time
import tracemalloc

import numpy as np
import pytest

from pushplan.gtsp import GtspConfig, TourStatus, solve_gtsp
from pushplan.gtsp.distances import COORDINATE_TYPES
from pushplan.gtsp.instance import GtspInstance
from pushplan.world import Deadline, MaxIterations, Stop

NODES, SETS = 12_000, 1_000


def places(nodes: int, sets: int, kind: str = "EUC_2D") -> GtspInstance:
    rng = np.random.default_rng(nodes)
    owner = rng.permutation(nodes) % sets
    clusters = [np.flatnonzero(owner == c) for c in range(sets)]
    return GtspInstance.from_coordinates("places", rng.uniform(-80, 80, (nodes, 2)), clusters, kind)


@pytest.mark.usefixtures("cpu_time")
@pytest.mark.parametrize("deadline", [0.02, 0.5])
def test_coordinates_of_many_nodes_take_neither_time_nor_memory(deadline: float) -> None:
    instance = places(NODES, SETS)
    tracemalloc.start()
    began = time.process_time()
    tour = solve_gtsp(instance, stop=Deadline(deadline))
    assert time.process_time() - began < deadline + 0.3
    assert tracemalloc.get_traced_memory()[1] < 4e8  # the costs of all would be 1.15 GB
    tracemalloc.stop()
    assert tour.status in (TourStatus.FEASIBLE, TourStatus.TIMED_OUT)
    if deadline > 0.1:
        assert len(tour.nodes) == SETS


@pytest.mark.parametrize("kind", COORDINATE_TYPES)
def test_costs_that_are_made_when_needed_are_those_of_the_matrix(kind: str) -> None:
    for config in (GtspConfig(), GtspConfig(search_nodes=40), GtspConfig(lower_bound=True)):
        for fixed in ((), (3, 5)):
            one, other = places(60, 15, kind), places(60, 15, kind)
            given = {"stop": MaxIterations(100), "config": config, "fixed_start": fixed}
            tour = solve_gtsp(one, **given)
            again = solve_gtsp(other.costs, other.clusters, **given)
            assert "costs" not in one.__dict__ and one == other
            assert tour.nodes == again.nodes and tour.cost == again.cost
            assert tour.lower_bound == again.lower_bound


class Counted(Stop):
    """Fires at a look at it, and counts looks."""

    def __init__(self, last: float = np.inf) -> None:
        self.last = last
        self.looks = 0

    def start(self):
        def check(iterations: int, cost: float) -> bool:
            self.looks += 1
            return self.looks > self.last

        return check


@pytest.mark.parametrize("forbidden", [0.0, 0.2])
def test_a_rule_may_fire_in_any_stage(forbidden: float) -> None:
    rng = np.random.default_rng(2)
    size = 1_500
    costs = rng.uniform(1.0, 2.0, (size, size))
    costs[rng.random(costs.shape) < forbidden] = np.inf
    clusters = np.split(np.arange(size), size // 5)
    config = GtspConfig(method="search", lower_bound=True)
    whole = Counted()
    solve_gtsp(costs, clusters, stop=whole | MaxIterations(1), config=config)
    assert whole.looks > 30  # before and after the single round
    for last in range(0, whole.looks, max(whole.looks // 12, 1)):
        tour = solve_gtsp(costs, clusters, stop=Counted(last) | MaxIterations(1), config=config)
        assert tour.status in (TourStatus.FEASIBLE, TourStatus.TIMED_OUT)
        if tour.nodes:
            assert np.isfinite(tour.cost) and tour.lower_bound <= tour.cost
    begin = [cluster[0] for cluster in clusters]
    if not forbidden:
        kept = solve_gtsp(costs, clusters, stop=Counted(1), config=config, initial=begin)
        assert list(kept.nodes) == begin
