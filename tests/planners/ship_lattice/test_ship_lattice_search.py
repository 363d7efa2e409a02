"""The search of the ship lattice against exhaustive search, and what guides it."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra
from test_ship_lattice import ship_world

from pushplan.core import search
from pushplan.interaction.ice_interaction import IceInteraction
from pushplan.interaction.path_sweepers import path_sweeper
from pushplan.motion.speed_profile import turning_radius
from pushplan.motion.state_lattice.built_lattice import BuiltLattice
from pushplan.motion.state_lattice.lattice_builder import LatticeBuilder
from pushplan.motion.state_lattice.lattice_map import HullWindow, place_costs
from pushplan.motion.state_lattice.lattice_search import open_search
from pushplan.planners.ship_lattice import ShipLattice, ShipLatticeConfig
from pushplan.planners.ship_lattice.ship_lattice import floe_costs
from pushplan.world import GoalLine, World

EXACT = {"heuristic": "bound", "inflation": 1.0}


def builder_of(world: World, config: ShipLatticeConfig) -> LatticeBuilder:
    radius = turning_radius(world.robot, config.turn_fraction)
    return LatticeBuilder(
        world, config, radius=radius, side=0.2, floe_costs=partial(floe_costs, config)
    )


def costs_to_go(built: BuiltLattice) -> np.ndarray:
    """(N,) least cost from every node to the goal, by Dijkstra on the explicit graph."""
    lattice = built.graph
    nodes, costs, edges = np.empty(64, np.int64), np.empty(64), np.empty(64, np.int64)
    tails, heads, weights = [], [], []
    goals = []
    for node in range(built.size):
        if lattice.is_goal(node):
            goals.append(node)
            continue
        count = lattice.successors(node, nodes, costs, edges)
        tails += [node] * count
        heads += nodes[:count].tolist()
        weights += costs[:count].tolist()
    # several edges may join the same two nodes: the cheapest counts
    order = np.lexsort((weights, heads, tails))
    pairs = np.column_stack([tails, heads])[order]
    first = np.concatenate([[True], (np.diff(pairs, axis=0) != 0).any(axis=1)])
    chosen = order[first]
    graph = csr_matrix(
        (np.array(weights)[chosen], (np.array(heads)[chosen], np.array(tails)[chosen])),
        shape=(built.size, built.size),
    )
    return dijkstra(graph, indices=goals, min_only=True)


def small_world(seed: int, floes: int = 60) -> World:
    world = ship_world(seed, floes=floes, goal=GoalLine([6.0, 4.5], [0.0, 1.0]))
    turn = np.random.default_rng(seed).normal(0.0, 0.3)
    return world.moved(robot_pose=world.robot_pose + np.array([0.0, 0.0, turn]))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("price", ["displacement", "kinetic-energy"])
def test_the_bound_is_never_above_the_least_cost(seed: int, price: str) -> None:
    config = ShipLatticeConfig(headings=8, floe_cost=price, collision_weight=3.0, **EXACT)
    built = builder_of(small_world(seed), config).build()
    exact = costs_to_go(built)
    bounds = np.array([built.graph.estimate(node) for node in range(built.size)])
    finite = np.isfinite(exact)
    assert finite.sum() > 500
    assert (bounds[finite] <= exact[finite] + 1e-9).all()
    assert (bounds[finite] > 0.5 * exact[finite]).mean() > 0.3  # and worth having


@pytest.mark.parametrize("seed", range(5))
def test_a_star_finds_the_cost_of_exhaustive_dijkstra(seed: int) -> None:
    builder = builder_of(small_world(seed), ShipLatticeConfig(headings=8, **EXACT))
    rng = np.random.default_rng(seed)
    built = builder.build()
    # any prices, not only those of floes; nothing but the length bounds them
    grid = rng.exponential(0.02, built.lattice.cost_sums.shape)
    sums = np.cumsum(grid.reshape(-1, built.lattice.stride), axis=1).ravel()
    lattice = built.lattice._replace(
        cost_sums=sums, place_costs=np.zeros_like(built.lattice.place_costs)
    )
    built = BuiltLattice(lattice, built.frame, built.motions, built.start, built.arrives)
    star, curves = open_search(built, builder)
    starts = star.tree.open_nodes
    exact = costs_to_go(built)
    least = min(star.tree.cost(node) + exact[node] for node in starts)
    assert curves and star.run(10**7) == search.SearchStatus.FOUND
    assert star.cost == pytest.approx(least, rel=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_the_bound_saves_nodes_and_no_cost(seed: int) -> None:
    builder = builder_of(ship_world(seed), ShipLatticeConfig(**EXACT))
    built = builder.build()
    star, _ = open_search(built, builder)
    blind = BuiltLattice(
        built.lattice._replace(inflation=0.0),
        built.frame,
        built.motions,
        built.start,
        built.arrives,
    )
    exhaustive, _ = open_search(blind, builder)
    assert (
        star.run(10**7) == search.SearchStatus.FOUND
        and exhaustive.run(10**7) == search.SearchStatus.FOUND
    )
    assert star.cost == pytest.approx(exhaustive.cost, rel=1e-12)
    assert star.tree.expanded < 0.5 * exhaustive.tree.expanded


@pytest.mark.parametrize("inflation", [1.0, 1.5, 3.0])
def test_an_inflated_bound_limits_the_cost(inflation: float) -> None:
    for seed in range(6):
        world = ship_world(seed, floes=150)
        best, found = (
            ShipLattice(
                ShipLatticeConfig(
                    heuristic="bound", inflation=factor, shortcuts=0, sweep_horizon=0.0
                )
            )
            .plan(world)
            .stats.detail["lattice_cost"]
            for factor in (1.0, inflation)
        )
        assert best - 1e-9 <= found <= inflation * best + 1e-9


def test_the_estimate_saves_most_nodes_and_costs_little_more() -> None:
    results = {}
    for guide, inflation in (("bound", 1.0), ("estimate", 1.2)):
        config = ShipLatticeConfig(
            heuristic=guide, inflation=inflation, shortcuts=0, sweep_horizon=0.0
        )
        stats = [ShipLattice(config).plan(ship_world(seed, floes=150)).stats for seed in range(8)]
        results[guide] = (
            sum(one.nodes for one in stats),
            sum(one.detail["lattice_cost"] for one in stats),
        )
    assert results["estimate"][0] < 0.3 * results["bound"][0]
    assert results["estimate"][1] < 1.05 * results["bound"][1]


@settings(max_examples=60)
@given(seed=st.integers(0, 10**6), half=st.integers(0, 3), reach=st.integers(0, 4))
@pytest.mark.slow
def test_the_bound_holds_for_random_walks_over_random_prices(
    seed: int, half: int, reach: int
) -> None:
    rng = np.random.default_rng(seed)
    rows, columns, cell = 30, 20, 0.5
    grid = rng.exponential(1.0, (rows, columns)) * (rng.random((rows, columns)) < 0.4)
    sums = np.zeros((columns, rows + 1))
    sums[:, 1:] = np.cumsum(grid.T, axis=1)
    window = HullWindow(half, reach, 0, 1, 1.0, cell, 0.3)
    places, across = np.array([2, 6, 10]), np.arange(4, 16)
    bounds = place_costs(sums, places, 25, across, (4, 15), window)
    for _ in range(20):
        u, v = int(rng.integers(3)), int(rng.integers(len(across)))
        # a path that wanders through all rows up to the line, crossing each where it likes
        steps = rng.normal(0.0, 0.6, 25 - places[u])
        path = np.clip(across[v] + np.concatenate([[0.0], np.cumsum(steps)]), 4.0, 15.0)
        cost = cell * np.hypot(1.0, np.diff(path)).sum()
        for row in range(places[u] + reach + 1, 25):
            at = path[row - places[u]]
            # all cells within half + 1 of the crossing
            low, high = int(np.ceil(at - half - 1.0)), int(np.floor(at + half + 1.0))
            cost += grid[row, max(low, 0) : high + 1].sum()
        assert bounds[u, v] <= cost + 1e-9


@pytest.mark.parametrize("floes", [0, 10, 80, 200])
def test_a_sweep_of_what_is_near_agrees_with_one_of_everything(floes: int) -> None:
    world = ship_world(floes, floes=floes)
    plan = ShipLattice(ShipLatticeConfig.quick()).plan(world).plan
    assert plan is not None
    path = plan.poses.copy()
    whole = IceInteraction().sweep(world, path)
    sweeper = path_sweeper(world, IceInteraction())
    here = world.movables.poses.copy()
    out, works = np.empty((len(path), len(here), 3)), np.zeros(len(path) - 1)
    for at in range(0, len(path) - 1, 8):
        end = min(at + 8, len(path) - 1)
        assert sweeper(path[at : end + 1], here, out[at : end + 1], works[at:end])
    assert works.sum() == pytest.approx(whole.work, rel=0.02, abs=1e-9)
    assert out[0] == pytest.approx(world.movables.poses)
