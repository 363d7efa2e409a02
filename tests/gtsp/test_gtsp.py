"""The sequencing solver against brute force, at its doors."""

from __future__ import annotations

import itertools
import math
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.accuracy.gtsp_instances import FAMILIES, instance
from pushplan.gtsp import (
    GtspConfig,
    Tour,
    TourStatus,
    solve_gtsp,
)
from pushplan.gtsp.problem import Problem
from pushplan.gtsp.search import AnytimeSearch
from pushplan.world import Cancellation, Deadline, InvalidInputError, MaxIterations

SEARCH = GtspConfig(method="search")
PROOF = GtspConfig(method="search", lower_bound=True)
CONFIGS = {"exact": GtspConfig(method="exact"), "search": SEARCH, "proof": PROOF}


@pytest.mark.parametrize("method", ["auto", "search"])
def test_costs_may_have_any_layout_and_be_read_only(method: str) -> None:
    costs = np.random.default_rng(0).random((6, 6))
    clusters = [[0], [1, 2], [3, 4, 5]]
    config = GtspConfig(method=method)
    tour = solve_gtsp(costs, clusters, config=config)
    read_only = costs.copy()
    read_only.flags.writeable = False
    sparse = np.full((12, 12), np.nan)
    sparse[::2, ::2] = costs
    for other in (read_only, np.asfortranarray(costs), sparse[::2, ::2]):
        before = other.copy()
        again = solve_gtsp(other, clusters, config=config)
        assert (again.nodes, again.cost) == (tour.nodes, tour.cost)
        np.testing.assert_array_equal(other, before)


def brute_force(costs: np.ndarray, clusters: list[list[int]]) -> float:
    """The cost of the cheapest tour by trying all of them."""
    if len(clusters) == 1:
        return 0.0
    best = math.inf
    for rest in itertools.permutations(clusters[1:]):
        for nodes in itertools.product(clusters[0], *rest):
            total = math.fsum(costs[u, v] for u, v in itertools.pairwise((*nodes, nodes[0])))
            best = min(best, total)
    return best


def check_tour(tour: Tour, costs: np.ndarray, clusters: list[list[int]]) -> None:
    """A tour visits every cluster once, begins in the first, and costs what it says."""
    if not tour.status.has_tour:
        assert tour.cost == math.inf
        return
    owner = {node: index for index, nodes in enumerate(clusters) for node in nodes}
    assert sorted(owner[node] for node in tour.nodes) == list(range(len(clusters)))
    assert owner[tour.nodes[0]] == 0
    if len(tour.nodes) > 1:
        arcs = [costs[u, v] for u, v in itertools.pairwise((*tour.nodes, tour.nodes[0]))]
        assert tour.cost == math.fsum(arcs)
    assert tour.lower_bound <= tour.cost


def random_instance(
    rng: np.random.Generator, most: int = 5, width: int = 4
) -> tuple[np.ndarray, list[list[int]]]:
    """Asymmetric, with a kind of costs and of forbidden arcs drawn at random, nodes shuffled."""
    sizes = rng.integers(1, width + 1, rng.integers(1, most + 1))
    count = int(sizes.sum())
    kind = rng.integers(5)
    if kind == 0:
        costs = rng.random((count, count))
    elif kind == 1:
        costs = rng.integers(0, 4, (count, count)).astype(float)  # ties and zeros
    elif kind == 2:
        costs = 10.0 ** rng.uniform(-9.0, 9.0, (count, count))
    elif kind == 3:
        costs = rng.normal(0.0, 10.0 ** rng.integers(-9, 10), (count, count))
    else:
        costs = 1e9 + rng.random((count, count))
    costs[rng.random((count, count)) < rng.choice([0.0, 0.2, 0.5, 0.8])] = np.inf
    nodes = iter(rng.permutation(count).tolist())
    return costs, [[next(nodes) for _ in range(size)] for size in sizes]


def close(a: float, b: float, costs: np.ndarray) -> bool:
    """Equal up to what rounding does to a sum of these costs."""
    finite = np.abs(costs[np.isfinite(costs)])
    return a == b or abs(a - b) <= 1e-12 * len(costs) * (finite.max() if finite.size else 1.0)


def test_exact_is_brute_force_on_hundreds_of_instances() -> None:
    rng = np.random.default_rng(1)
    found = {status: 0 for status in TourStatus}
    for _ in range(300):
        costs, clusters = random_instance(rng)
        if math.prod(map(len, clusters)) * math.factorial(len(clusters) - 1) > 2500:
            continue
        tour = solve_gtsp(costs, clusters)
        best = brute_force(costs, clusters)
        assert close(tour.cost, best, costs), (costs, clusters)
        assert tour.status is (TourStatus.OPTIMAL if best < math.inf else TourStatus.INFEASIBLE)
        assert tour.lower_bound == tour.cost
        check_tour(tour, costs, clusters)
        found[tour.status] += 1
    assert found[TourStatus.OPTIMAL] > 75
    assert found[TourStatus.INFEASIBLE] > 15


@pytest.mark.parametrize("seed", range(3))
def test_search_finds_most_optima_and_nothing_below(seed: int) -> None:
    rng = np.random.default_rng(seed)
    hits = 0
    for _ in range(20):
        costs, clusters = random_instance(rng, most=9, width=5)
        exact = solve_gtsp(costs, clusters)
        tour = solve_gtsp(costs, clusters, stop=MaxIterations(300), config=SEARCH)
        check_tour(tour, costs, clusters)
        assert tour.cost > exact.cost or close(tour.cost, exact.cost, costs)
        hits += close(tour.cost, exact.cost, costs)
    assert hits >= 18


def test_lower_bound_and_proof_agree_with_the_optimum() -> None:
    rng = np.random.default_rng(5)
    proven = 0
    for _ in range(40):
        costs, clusters = random_instance(rng, most=8, width=4)
        exact = solve_gtsp(costs, clusters)
        tour = solve_gtsp(costs, clusters, stop=MaxIterations(100), config=PROOF)
        check_tour(tour, costs, clusters)
        assert tour.lower_bound <= exact.cost or close(tour.lower_bound, exact.cost, costs)
        if tour.status is TourStatus.OPTIMAL:
            proven += 1
            assert close(tour.cost, exact.cost, costs)
        if exact.status.has_tour:
            assert tour.status is not TourStatus.INFEASIBLE
    assert proven >= 15


def test_proof_is_brute_force_whatever_the_costs() -> None:
    """Bounds never above the optimum; negative costs, ties, and 1e9 for a forbidden arc."""
    rng = np.random.default_rng(11)
    proven = 0
    for _ in range(60):
        sizes = rng.integers(1, 4, rng.integers(4, 7))
        count = int(sizes.sum())
        low = rng.choice([-5.0, 0.0])
        costs = rng.uniform(low, 5.0, (count, count))
        if rng.random() < 0.4:
            costs = np.round(costs)
        costs[rng.random((count, count)) < 0.3] = rng.choice([1e9, math.inf])
        nodes = iter(rng.permutation(count).tolist())
        clusters = [[next(nodes) for _ in range(size)] for size in sizes]
        if math.prod(map(len, clusters)) * math.factorial(len(clusters) - 1) > 3000:
            continue
        best = brute_force(costs, clusters)
        tour = solve_gtsp(costs, clusters, stop=MaxIterations(20), config=PROOF)
        check_tour(tour, costs, clusters)
        assert tour.lower_bound <= best + 1e-9 * max(1.0, abs(best))
        if tour.status is TourStatus.OPTIMAL:
            assert tour.cost == pytest.approx(best, rel=1e-9, abs=1e-9)
            proven += 1
        elif tour.status is TourStatus.INFEASIBLE:
            assert best == math.inf
    assert proven >= 24


def test_a_large_number_for_a_forbidden_arc_does_not_blur_the_proof() -> None:
    """Two tours that differ by a ten-thousandth, other arcs cost 1e9."""
    rng = np.random.default_rng(2)
    clusters = [[3 * c, 3 * c + 1, 3 * c + 2] for c in range(9)]
    costs = np.where(rng.random((27, 27)) < 0.5, 1e9, 1.0 + 1e-4 * rng.random((27, 27)))
    exact = solve_gtsp(costs, clusters)
    tour = solve_gtsp(costs, clusters, stop=MaxIterations(1), config=PROOF)
    assert exact.cost < 10.0
    assert tour.status is TourStatus.OPTIMAL
    assert tour.cost == pytest.approx(exact.cost, abs=1e-9)


@pytest.mark.parametrize("config", [GtspConfig(), SEARCH, PROOF])
def test_small_shapes(config: GtspConfig) -> None:
    """One cluster, one node, two clusters, free tours, and nothing allowed at all."""
    assert solve_gtsp([[7.0]], [[0]], config=config).nodes == (0,)
    single = solve_gtsp(np.ones((3, 3)), [[2, 0, 1]], config=config)
    assert (single.cost, single.status) == (0.0, TourStatus.OPTIMAL)
    two = solve_gtsp([[0, 9, 1], [2, 0, 9], [5, 9, 0]], [[0], [1, 2]], config=config)
    assert (two.nodes, two.cost, two.status) == ((0, 2), 6.0, TourStatus.OPTIMAL)
    groups = [[2 * c, 2 * c + 1] for c in range(6)]
    free = solve_gtsp(np.zeros((12, 12)), groups, stop=MaxIterations(50), config=config)
    assert free.cost == 0.0 and free.lower_bound == 0.0
    none = solve_gtsp(np.full((12, 12), np.inf), groups, stop=MaxIterations(50), config=config)
    assert (none.status, none.nodes) == (TourStatus.INFEASIBLE, ())


def test_dynamic_programming_that_is_too_slow_leaves_time_to_search() -> None:
    """What is expected to take minutes goes to the search even without a clock."""
    costs = np.random.default_rng(0).random((16 * 60, 16 * 60))
    clusters = [range(60 * c, 60 * c + 60) for c in range(16)]
    tour = solve_gtsp(costs, clusters, stop=MaxIterations(40))
    assert tour.stats.method == "search"
    check_tour(tour, costs, [list(nodes) for nodes in clusters])


@pytest.mark.usefixtures("cpu_time")
@pytest.mark.parametrize("config", [SEARCH, PROOF, GtspConfig(method="exact")])
def test_cancellation_from_another_thread(config: GtspConfig) -> None:
    costs, clusters = pushes(17, 16, 0)
    token = Cancellation()
    threading.Timer(0.1, token.cancel).start()
    began = time.perf_counter()
    tour = solve_gtsp(costs, clusters, stop=token | Deadline(30.0), config=config)
    assert time.perf_counter() - began < 10.0
    assert tour.status in (TourStatus.CANCELLED, TourStatus.FEASIBLE)


def pushes(boxes: int, options: int, seed: int) -> tuple[np.ndarray, list[list[int]]]:
    """An open-ended sequence: a robot, boxes in a square, straight pushes out of it."""
    rng = np.random.default_rng(seed)
    box = rng.uniform(1.0, 9.0, (boxes, 1, 2))
    angle = rng.uniform(0.0, 6.28, (boxes, 1)) + np.arange(options) * 2.0 * np.pi / options
    way = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    out = np.where(way > 0.0, (10.0 - box) / way, -box / way).min(axis=-1)
    begin = np.concatenate([[[5.0, 5.0]], (box - 0.6 * way).reshape(-1, 2)])
    end = np.concatenate([[[5.0, 5.0]], (box + way * out[..., None]).reshape(-1, 2)])
    costs = np.linalg.norm(end[:, None] - begin[None], axis=-1)
    costs[:, 1:] += 2.0 * out.reshape(-1)
    costs[:, 0] = 0.0
    groups = [list(range(1 + b * options, 1 + (b + 1) * options)) for b in range(boxes)]
    return costs, [[0], *groups]


def test_search_and_proof_on_pushes_agree_with_dynamic_programming() -> None:
    for seed in range(3):
        costs, clusters = pushes(12, 8, seed)
        exact = solve_gtsp(costs, clusters)
        assert exact.stats.method == "exact"
        tour = solve_gtsp(costs, clusters, stop=MaxIterations(600), config=PROOF)
        assert tour.status is TourStatus.OPTIMAL
        assert tour.cost == pytest.approx(exact.cost, rel=1e-12)
        assert tour.gap == 0.0


def test_nodes_that_are_left_out_are_those_that_another_one_can_stand_for() -> None:
    rng = np.random.default_rng(3)
    gone = 0
    for _ in range(200):
        offsets = np.concatenate(([0], np.cumsum(rng.integers(1, 6, 4))))
        owner = np.repeat(np.arange(4), np.diff(offsets))
        costs = rng.choice([0.0, 1.0, np.inf], (len(owner), len(owner)), p=[0.2, 0.7, 0.1])
        needed = Problem(costs, offsets, np.arange(len(owner))).reduced().names
        gone += len(owner) - len(needed)
        for v in np.setdiff1d(np.arange(len(owner)), needed):
            rest = owner != owner[v]
            assert any(
                (costs[u, rest] <= costs[v, rest]).all()
                and (costs[rest, u] <= costs[rest, v]).all()
                for u in needed[owner[needed] == owner[v]]
            )
        for v, u in itertools.permutations(needed, 2):
            rest = owner != owner[v]
            assert owner[u] != owner[v] or not (
                (costs[u, rest] <= costs[v, rest]).all()
                and (costs[rest, u] <= costs[rest, v]).all()
            )
    assert gone > 50


@pytest.mark.parametrize("family", FAMILIES)
def test_families_of_instances_are_the_same_for_a_seed(family: str) -> None:
    made, again = instance(family, 1000), instance(family, 1000)
    np.testing.assert_array_equal(made.costs, again.costs)
    assert made.clusters == again.clusters
    assert sorted(itertools.chain(*made.clusters)) == list(range(len(made.costs)))
    assert np.isfinite(made.costs).all() and (made.costs >= 0.0).all()


def test_search_on_promising_nodes_ends_with_all_of_them() -> None:
    """On wide clusters the search goes on with few nodes, and its tour is near the optimum."""
    costs, clusters = pushes(15, 16, 3)
    exact = solve_gtsp(costs, clusters)
    config = GtspConfig(method="search", narrow_width=2)
    tour = solve_gtsp(costs, clusters, stop=MaxIterations(8000), config=config)
    check_tour(tour, costs, clusters)
    assert tour.cost == pytest.approx(exact.cost, rel=0.01)


def test_node_choice_on_unstructured_costs() -> None:
    """Insertions that see one node of each neighbour only end far above."""
    rng = np.random.default_rng(0)
    costs = rng.integers(0, 1000, (144, 144))
    clusters = [range(12 * c, 12 * c + 12) for c in range(12)]
    exact = solve_gtsp(costs, clusters)
    tour = solve_gtsp(costs, clusters, stop=MaxIterations(8000), config=SEARCH)
    assert tour.cost <= 2.2 * exact.cost


@pytest.mark.slow
def test_same_seed_same_tour_in_another_process() -> None:
    code = (
        "import numpy as np\n"
        "from pushplan.gtsp import GtspConfig, solve_gtsp\n"
        "from pushplan.world import MaxIterations\n"
        "costs = np.random.default_rng(3).random((56, 56))\n"
        "clusters = [range(4 * c, 4 * c + 4) for c in range(14)]\n"
        "tour = solve_gtsp(costs, clusters, stop=MaxIterations(700),\n"
        "                  rng=np.random.default_rng(9),\n"
        "                  config=GtspConfig(method='search', lower_bound=True))\n"
        "print(tour.nodes, tour.cost.hex(), tour.lower_bound.hex(), tour.stats.iterations)\n"
    )
    runs = [
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        for _ in range(2)
    ]
    assert runs[0].stdout == runs[1].stdout != ""


def test_iterations_are_counted_and_other_seeds_differ() -> None:
    costs = np.random.default_rng(3).random((300, 300))
    clusters = [range(5 * c, 5 * c + 5) for c in range(60)]
    tours = [
        solve_gtsp(costs, clusters, stop=MaxIterations(130), rng=np.random.default_rng(seed))
        for seed in range(2)
    ]
    assert [tour.stats.iterations for tour in tours] == [130, 130]
    assert tours[0].nodes != tours[1].nodes


@pytest.mark.usefixtures("cpu_time")
@pytest.mark.parametrize(
    "config", [GtspConfig(), pytest.param(SEARCH, marks=pytest.mark.slow), PROOF]
)
def test_deadline_holds(config: GtspConfig) -> None:
    costs, clusters = pushes(16, 16, 0)
    over, found = [], 0
    for seconds in (0.02, 0.1, 0.25):
        began = time.perf_counter()
        tour = solve_gtsp(costs, clusters, stop=Deadline(seconds), config=config)
        over.append(time.perf_counter() - began - seconds)
        found += tour.status.has_tour
    assert found
    assert min(over) < 0.05


def test_stop_before_anything() -> None:
    costs, clusters = pushes(18, 8, 0)
    token = Cancellation()
    token.cancel()
    assert solve_gtsp(costs, clusters, stop=token).status is TourStatus.CANCELLED
    tour = solve_gtsp(costs, clusters, stop=Deadline(0.0))
    assert tour.status is TourStatus.TIMED_OUT
    assert tour.nodes == () and tour.lower_bound == -math.inf
    assert "more time" in tour.status.remedy


def test_forbidden_arcs_leave_one_tour() -> None:
    """Only one order is allowed: the search has to find its way through."""
    count = 12
    costs = np.full((2 * count, 2 * count), np.inf)
    for c in range(count):
        d = (5 * c + 5) % count
        costs[2 * ((5 * c) % count), 2 * d] = 1.0
        costs[2 * ((5 * c) % count) + 1, 2 * d] = 2.0
    clusters = [[2 * c, 2 * c + 1] for c in range(count)]
    assert solve_gtsp(costs, clusters).cost == 12.0


def test_a_cluster_that_cannot_be_left_is_infeasible_however_large() -> None:
    costs, clusters = pushes(30, 8, 0)
    costs[clusters[7]] = np.inf
    tour = solve_gtsp(costs, clusters)
    assert tour.status is TourStatus.INFEASIBLE
    assert tour.lower_bound == math.inf


def test_large_instances_keep_promising_nodes() -> None:
    costs, clusters = pushes(60, 30, 0)
    few = GtspConfig(search_nodes=400)
    tour = solve_gtsp(costs.astype(np.float32), clusters, stop=MaxIterations(150), config=few)
    full = solve_gtsp(costs, clusters, stop=MaxIterations(150))
    check_tour(tour, costs.astype(np.float32), clusters)
    assert tour.stats.detail["nodes"] <= 400
    assert tour.cost < 1.05 * full.cost


@pytest.mark.parametrize(
    ("costs", "clusters", "words"),
    [
        ([[0.0, math.nan], [1.0, 0.0]], [[0], [1]], "NaN from node 0 to node 1"),
        ([[0.0, -math.inf], [1.0, 0.0]], [[0], [1]], "-inf from node 0 to node 1"),
        (np.zeros((2, 3)), [[0], [1]], r"shape \(N, N\)"),
        (np.zeros((0, 0)), [], r"shape \(N, N\)"),
        ([[0.0], [1.0, 2.0]], [[0], [1]], "costs must be"),
        ([["a", "b"], ["c", "d"]], [[0], [1]], "numbers"),
        (np.full((2, 2), 1e300), [[0], [1]], "at most"),
        (np.full((2, 2), 2**60), [[0], [1]], "2\\^53"),
        (np.zeros((3, 3)), [[0], [1]], "1 are in none: 2"),
        (np.zeros((3, 3)), [[0, 1], [1, 2]], "node 1 is in clusters 0 and 1"),
        (np.zeros((3, 3)), [[0, 0], [1, 2]], "node 0 is in cluster 0 twice"),
        (np.zeros((3, 3)), [[0, 1], [], [2]], "cluster 1 must be a list of at least one node"),
        (np.zeros((3, 3)), [[0, 1], [3]], "cluster 1 has node 3"),
        (np.zeros((3, 3)), [[0, 1], [-1]], "cluster 1 has node -1"),
        (np.zeros((3, 3)), [[0.5], [1], [2]], "whole numbers"),
        (np.zeros((3, 3)), "abc", "sequence of node lists"),
        (np.zeros((3, 3)), None, "clusters must be given"),
    ],
)
def test_hostile_input_is_one_clear_error(costs: object, clusters: object, words: str) -> None:
    with pytest.raises(InvalidInputError, match=words):
        solve_gtsp(costs, clusters)  # type: ignore[arg-type]


@pytest.mark.parametrize("changes", [{"stop": 5}, {"rng": 3}])
def test_wrong_kinds_are_named(changes: dict[str, object]) -> None:
    with pytest.raises(InvalidInputError, match=r"(stop|rng) must be a (Stop|Generator), got"):
        solve_gtsp([[0.0]], [[0]], **changes)  # type: ignore[arg-type]


def test_a_table_that_does_not_fit_is_refused() -> None:
    costs, clusters = pushes(40, 4, 0)
    with pytest.raises(InvalidInputError, match=r"MB for 41 clusters .* raise it, or use method"):
        solve_gtsp(costs, clusters, config=GtspConfig(method="exact"))


@pytest.mark.parametrize(
    "changes",
    [{"method": "magic"}, {"restarts": 0}, {"hot": 0.0}, {"blink": 2.0}, {"lower_bound": 1}],
)
def test_config_is_checked(changes: dict[str, object]) -> None:
    with pytest.raises(InvalidInputError):
        GtspConfig(**changes)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("each", "again"),
    [
        (10, [False] * 10),
        (15, [False] * 6 + [True]),
        (60, [False, True]),
        (100, [False]),
    ],
)
def test_runs_begin_at_random_as_long_as_there_is_time_for_one(monkeypatch, each, again):
    """Runs that end early leave time for others: 35ftv170 missed its best tour otherwise."""
    made = []

    def run(self, begin, end, again=False):
        made.append(again)
        self.budget.used += each

    monkeypatch.setattr(AnytimeSearch, "run", run)
    costs, clusters = instance("uniform", 1000)
    solve_gtsp(costs, clusters, stop=MaxIterations(100), config=SEARCH)
    assert made == again


def random_tour(rng: np.random.Generator, clusters: list[list[int]]) -> tuple[int, ...]:
    """Some node of each cluster, clusters in some order."""
    return tuple(int(rng.choice(clusters[c])) for c in rng.permutation(len(clusters)))


@given(
    seed=st.integers(0, 2**32 - 1),
    method=st.sampled_from(["auto", "search", "large", "proof"]),
    fixed=st.integers(0, 3),
    spent=st.booleans(),
)
@settings(max_examples=200, deadline=None)
def test_a_tour_is_never_worse_than_the_one_it_began_with(
    seed: int, method: str, fixed: int, spent: bool
) -> None:
    rng = np.random.default_rng(seed)
    costs, clusters = random_instance(rng, most=7)
    given_tour = random_tour(rng, clusters)
    arcs = list(itertools.pairwise((*given_tour, given_tour[0])))
    for arc in arcs:
        costs[arc] = rng.random() if np.isinf(costs[arc]) else costs[arc]
    config = GtspConfig(
        method="auto" if method == "auto" else "search",
        search_nodes=len(clusters) if method == "large" else 3000,
        lower_bound=method == "proof",
    )
    start = given_tour[: min(fixed, len(given_tour))]
    tour = solve_gtsp(
        costs,
        clusters,
        stop=MaxIterations(0 if spent else 30),
        config=config,
        initial=given_tour,
        fixed_start=start,
    )
    cost = math.fsum(costs[arc] for arc in arcs) if len(clusters) > 1 else 0.0
    assert tour.cost <= cost
    assert tour.nodes[: len(start)] == start
    if spent and len(clusters) > max(1, len(start)):
        at = tour.nodes.index(given_tour[0])
        assert tour.nodes[at:] + tour.nodes[:at] == given_tour
        assert tour.cost == cost
    if not start:
        check_tour(tour, costs, clusters)


@given(seed=st.integers(0, 2**32 - 1), method=st.sampled_from(["exact", "search", "proof"]))
@settings(max_examples=100, deadline=None)
def test_a_fixed_start_gives_the_cheapest_tour_that_begins_so(seed: int, method: str) -> None:
    rng = np.random.default_rng(seed)
    costs, clusters = random_instance(rng)
    start = random_tour(rng, clusters)[: int(rng.integers(1, 4))]
    rest = [nodes for nodes in clusters if not set(nodes) & set(start)]
    best = math.inf
    for order in itertools.permutations(rest):
        for nodes in itertools.product(*order):
            tour = [*start, *nodes]
            if len(tour) > 1:
                arcs = itertools.pairwise((*tour, tour[0]))
                best = min(best, math.fsum(costs[arc] for arc in arcs))
            else:
                best = 0.0
    found = solve_gtsp(costs, clusters, config=CONFIGS[method], fixed_start=start)
    assert found.cost >= best or close(found.cost, best, costs)
    assert found.lower_bound <= best or close(found.lower_bound, best, costs)
    if method == "exact":
        assert close(found.cost, best, costs)
    assert not found.nodes or found.nodes[: len(start)] == start


def test_a_warm_start_keeps_what_a_longer_search_has_found() -> None:
    costs, clusters = instance("uniform", 1003)
    before = solve_gtsp(costs, clusters, stop=MaxIterations(4000))
    cold = solve_gtsp(costs, clusters, stop=MaxIterations(50))
    warm = solve_gtsp(costs, clusters, stop=MaxIterations(50), initial=before)
    assert warm.cost <= before.cost < cold.cost
    assert warm.stats.iterations <= 50


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"initial": 3}, "initial must be a sequence of nodes, got 3"),
        ({"initial": "abc"}, "initial must be a sequence of nodes"),
        ({"initial": [0, 1]}, "initial does not visit cluster 2"),
        ({"initial": [0, 1, 2, 3]}, "initial visits cluster 1 more than once"),
        ({"initial": [0, 1, 1]}, "initial has node 1 twice"),
        ({"initial": [0, 1, 9]}, "initial has node 9, but nodes are 0 to 3"),
        ({"initial": [0, 1.5, 3]}, "initial has node 1.5"),
        ({"initial": [3, 0, 2]}, "initial uses the forbidden arc 0 to 2"),
        ({"initial": [0, 1, 3], "fixed_start": [2]}, "initial must visit the nodes of fixed_start"),
        ({"fixed_start": [1, 2]}, "fixed_start visits cluster 1 more than once"),
        ({"fixed_start": 1.5}, "fixed_start must be a sequence of nodes, got 1.5"),
        ({"fixed_start": 4}, "fixed_start has node 4, but nodes are 0 to 3"),
    ],
)
def test_a_bad_tour_is_one_clear_error(changes: dict[str, object], words: str) -> None:
    costs = np.ones((4, 4))
    costs[0, 2] = np.inf
    with pytest.raises(InvalidInputError, match=words):
        solve_gtsp(costs, [[0], [1, 2], [3]], **changes)  # type: ignore[arg-type]
