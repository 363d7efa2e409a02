"""The A* kernel and the primitives."""

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from pushplan.compiled import kernel
from pushplan.core import motion as core
from pushplan.motion.state_lattice.lattice_builder import dubins_to_line
from pushplan.motion.state_lattice.primitive_set import PrimitiveConfig
from pushplan.motion.state_lattice.primitives import generate, primitives
from pushplan.search.astar import EXHAUSTED, FOUND, PAUSED, AStar, offer, register, take
from pushplan.world import InvalidInputError
from pushplan.world.checks import BoolArray, FloatArray, IntArray


def random_graph(seed: int, nodes: int = 120, edges: int = 500) -> tuple[csr_matrix, np.ndarray]:
    rng = np.random.default_rng(seed)
    ends = (rng.integers(0, nodes, edges), rng.integers(0, nodes, edges))
    graph = csr_matrix((rng.random(edges) + 0.01, ends), shape=(nodes, nodes))
    graph.sum_duplicates()
    return graph, dijkstra(graph.T.tocsr(), indices=7)


class GraphLattice(NamedTuple):
    """A directed graph in compressed rows."""

    first: IntArray  # (N + 1,) where the edges of each node start
    targets: IntArray  # (E,) where each edge leads
    costs: FloatArray  # (E,) its cost, not negative
    bounds: FloatArray  # (N,) lower bounds of the cost from each node to a goal
    goals: BoolArray  # (N,) which nodes are goals


@kernel
def _successors(
    lattice: GraphLattice, node: int, nodes: IntArray, costs: FloatArray, edges: IntArray
) -> int:
    """List the targets of the edges of a node."""
    count = 0
    for e in range(lattice.first[node], lattice.first[node + 1]):
        nodes[count], costs[count], edges[count] = lattice.targets[e], lattice.costs[e], e
        count += 1
    return count


@kernel
def _bound(lattice: GraphLattice, node: int) -> float:
    """Lower bound of the cost to a goal."""
    bound: float = lattice.bounds[node]
    return bound


@kernel
def _reached(lattice: GraphLattice, node: int) -> bool:
    """Whether a node is a goal."""
    reached: bool = lattice.goals[node]
    return reached


register(GraphLattice, _successors, _bound, _reached)


def lattice_of(graph: csr_matrix, bounds: np.ndarray) -> GraphLattice:
    goals = np.zeros(graph.shape[0], dtype=bool)
    goals[7] = True
    rows = (graph.indptr.astype(np.int64), graph.indices.astype(np.int64))
    return GraphLattice(*rows, graph.data, bounds, goals)


@settings(max_examples=150)
@given(seed=st.integers(0, 10**6), batch=st.integers(1, 50))
def test_cost_is_least_whatever_the_batch_and_the_admissible_bound(seed: int, batch: int) -> None:
    graph, exact = random_graph(seed)
    share = np.random.default_rng(seed).random(len(exact))
    bounds = np.where(np.isfinite(exact), exact * share, np.inf)  # admissible, not consistent
    star = AStar(lattice_of(graph, bounds), len(exact), 64)
    star.start(0)
    while (result := star.run(batch)) == PAUSED:
        pass
    assert result == (FOUND if np.isfinite(exact[0]) else EXHAUSTED)
    assert star.cost == pytest.approx(exact[0]) or result == EXHAUSTED
    if result == FOUND:
        nodes, edges = star.path()
        assert nodes[0] == 0 and nodes[-1] == 7
        assert graph.data[edges[1:]].sum() == pytest.approx(exact[0])


def test_a_better_bound_expands_fewer_nodes() -> None:
    counts = []
    for share in (0.0, 0.5, 1.0):
        graph, exact = random_graph(3)
        bounds = np.where(np.isfinite(exact), share * np.nan_to_num(exact, posinf=0.0), np.inf)
        star = AStar(lattice_of(graph, bounds), len(exact), 64)
        star.start(0)
        star.run(10_000)
        counts.append(star.expanded)
    assert counts[0] > counts[1] > counts[2]


def test_a_search_can_be_driven_from_outside() -> None:
    star = AStar(None, 5, 1)
    star.start(3, cost=1.0)
    offer(star.state, 4, 0.5, 0.0, 3, 9)
    assert take(star.state) == 4
    assert take(star.state) == 3
    assert take(star.state) == -1
    nodes, edges = star.path(4)
    assert nodes.tolist() == [3, 4] and edges.tolist() == [-1, 9]


def test_no_start_means_no_path() -> None:
    star = AStar(lattice_of(*random_graph(0)), 120, 64)
    assert star.run(10) == EXHAUSTED


@pytest.mark.parametrize("headings", [8, 16, 32])
@pytest.mark.parametrize("radius", [2.0, 6.0, 11.5])
def test_primitives_join_lattice_states(headings: int, radius: float) -> None:
    motions = generate(PrimitiveConfig(headings, radius))
    assert (np.diff(motions.first) >= 1).all()
    for p in range(len(motions)):
        pose = np.array([0.0, 0.0, motions.angles[motions.heading_of(p)]])
        for length, bend in motions.pieces[p]:
            assert abs(bend) <= 1.0 / radius + 1e-12
            core.along_arc(pose.copy(), length, bend, pose)
        x, y, heading = motions.ends[p]
        assert pose[:2] == pytest.approx([x, y], abs=1e-6)
        turn = pose[2] - motions.angles[heading]
        assert abs((turn + np.pi) % (2 * np.pi) - np.pi) < 1e-6


def test_a_set_is_made_once() -> None:
    made = primitives(PrimitiveConfig(8, 4.0))
    assert made == generate(PrimitiveConfig(8, 4.0))
    assert primitives(PrimitiveConfig(8, 4.0)) is made


def test_config_is_checked() -> None:
    with pytest.raises(InvalidInputError):
        PrimitiveConfig(headings=7)
    with pytest.raises(InvalidInputError):
        PrimitiveConfig(radius=float("nan"))


@settings(max_examples=80)
@given(
    heading=st.floats(-3.1, 3.1),
    distance=st.floats(0.01, 20.0),
    bends=st.lists(st.floats(-1.0, 1.0), min_size=200, max_size=200),
)
def test_no_drivable_path_is_shorter_than_the_bound(
    heading: float, distance: float, bends: list[float]
) -> None:
    pose = np.array([0.0, 0.0, heading])
    bound = float(dubins_to_line(np.array(distance), np.array(heading), 1.0))
    for k, bend in enumerate(bends):
        # half of the steps steer home, so that some paths are nearly the shortest
        turn = bend if k % 2 else -np.sign(pose[2])
        core.along_arc(pose.copy(), 0.1, float(turn), pose)
        if pose[0] >= distance:
            assert 0.1 * (k + 1) >= bound - 1e-6
            return
