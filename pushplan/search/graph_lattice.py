"""`GraphLattice`: an explicit graph, the plainest of lattices."""

from __future__ import annotations

from typing import NamedTuple

from pushplan.compiled import kernel
from pushplan.search.astar import register
from pushplan.world.checks import BoolArray, FloatArray, IntArray


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
