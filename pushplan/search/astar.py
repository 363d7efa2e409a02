"""One compiled A* for every lattice: a lattice knows its kinematics, the search does not.

A lattice is a named tuple of arrays that has been made known by `register` with three compiled
functions: `expand` lists the successors of a node with the costs of the edges, `estimate` bounds
the cost to the goal from below, and `is_goal` says where to stop. Numba compiles one search for
each type of lattice. Hart, Nilsson and Raphael (1968); nodes are opened again where the estimate is
not consistent, so the cost found is optimal whenever the estimate is admissible.
"""

from __future__ import annotations

import mmap
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pushplan.compiled import KernelByType, kernel
from pushplan.search.heap import pop_least, push_or_lift
from pushplan.world.checks import BoolArray, FloatArray, IntArray

EXHAUSTED = 0
FOUND = 1
PAUSED = 2
"""Results of `AStar.run`: no path exists; the goal was reached; the budget was used up."""
SIZE = 0
EXPANDED = 1
GENERATED = 2
GOAL = 3
"""Entries of `SearchState.counters`."""


@KernelByType
def expand(lattice: Any, node: int, nodes: IntArray, costs: FloatArray, edges: IntArray) -> int:
    """List the successors of a node; by the type of lattice.

    Args:
        lattice: the lattice.
        node: index in [0, number of nodes).
        nodes: (B,) receives the successors.
        costs: (B,) receives the costs of the edges, not negative; infinite where closed.
        edges: (B,) receives labels of the edges, from which a path is put together later.

    Returns:
        The number of successors.
    """
    raise NotImplementedError


@KernelByType
def estimate(lattice: Any, node: int) -> float:
    """A lower bound of the cost from a node to the goal, by the type of lattice."""
    raise NotImplementedError


@KernelByType
def is_goal(lattice: Any, node: int) -> bool:
    """Return True if a node is a goal; by the type of lattice."""
    raise NotImplementedError


def register(kind: type, successors: Any, bound: Any, reached: Any) -> None:
    """Teach the search a type of lattice.

    Args:
        kind: a named tuple class of arrays and numbers.
        successors: compiled function for `expand`.
        bound: compiled function for `estimate`.
        reached: compiled function for `is_goal`.
    """
    expand.add(kind, successors)
    estimate.add(kind, bound)
    is_goal.add(kind, reached)


class SearchState(NamedTuple):
    """Everything that a search has found out so far, so that it can be taken up again.

    Entries of nodes that are not ``known`` hold nothing: a large lattice costs what is looked at.
    """

    known: BoolArray  # (N,) nodes to which a way has been found
    costs: FloatArray  # (N,) least cost known to each node
    parents: IntArray  # (N,) node before each node, -1 at a start
    edges: IntArray  # (N,) label of the edge that leads to each node
    closed: BoolArray  # (N,) nodes that have been expanded at their present cost
    keys: FloatArray  # (N,) cost plus estimate of the nodes in the heap, in heap order
    heap: IntArray  # (N,) nodes in the heap, in heap order
    places: IntArray  # (N,) where in the heap a node is, -1 if it is not
    counters: IntArray  # (4,) size of the heap, nodes expanded, edges generated, goal or -1


def new_state(size: int) -> SearchState:
    """An empty search over nodes 0 to ``size`` - 1."""
    flags = [_sparse(size, np.bool_) for _ in range(2)]
    lengths = [_sparse(size, np.float64) for _ in range(2)]
    numbers = [_sparse(size, np.int64) for _ in range(4)]
    return SearchState(
        known=flags[0],
        costs=lengths[0],
        parents=numbers[0],
        edges=numbers[1],
        closed=flags[1],
        keys=lengths[1],
        heap=numbers[2],
        places=numbers[3],
        counters=np.array([0, 0, 0, -1], dtype=np.int64),
    )


def _sparse(size: int, kind: type[np.generic]) -> NDArray[Any]:
    """Zeros of which few will be used: in small pages, as the first use of a large one takes 1 ms.

    NumPy asks Linux for pages of 2 MiB.
    """
    wanted = size * np.dtype(kind).itemsize
    if wanted < _LARGE:
        return np.zeros(size, dtype=kind)
    memory = mmap.mmap(-1, wanted)
    if hasattr(mmap, "MADV_NOHUGEPAGE"):
        with suppress(OSError):  # a system without large pages
            memory.madvise(mmap.MADV_NOHUGEPAGE)
    return np.frombuffer(memory, dtype=kind)


_LARGE = 2**22  # from here on NumPy asks for large pages [bytes]


_spare: list[SearchState] = []
"""Memory of the last search that has ended, as fresh pages take longer than a search."""


def _borrowed(size: int) -> SearchState:
    """Memory for an empty search over at least ``size`` nodes."""
    try:
        state = _spare.pop()
    except IndexError:
        return new_state(size)
    if len(state.known) < size:
        return new_state(size)
    state.known[:size] = False
    state.counters[:] = 0, 0, 0, -1
    return state


@kernel
def offer(state: SearchState, node: int, cost: float, bound: float, parent: int, edge: int) -> None:
    """Take note of a path to ``node``; it is opened if none as cheap was known."""
    if not cost + bound < np.inf or (state.known[node] and cost >= state.costs[node]):
        return
    if not state.known[node]:
        state.known[node] = True
        state.places[node] = -1
    state.costs[node] = cost
    state.parents[node] = parent
    state.edges[node] = edge
    state.closed[node] = False
    push_or_lift(state.keys, state.heap, state.places, state.counters, node, cost + bound)


@kernel
def take(state: SearchState) -> int:
    """The open node of least cost plus estimate, now closed; -1 if none is open."""
    if state.counters[SIZE] == 0:
        return -1
    node = pop_least(state.keys, state.heap, state.places, state.counters)
    state.closed[node] = True
    state.counters[EXPANDED] += 1
    return node


@kernel(allocates=True)
def search(
    lattice: Any,
    state: SearchState,
    budget: int,
    nodes: IntArray,
    costs: FloatArray,
    edges: IntArray,
) -> int:
    """Expand up to ``budget`` nodes; see `AStar.run`. The last three are memory for successors."""
    for _ in range(budget):
        if state.counters[SIZE] == 0:
            return EXHAUSTED
        if is_goal(lattice, state.heap[0]):
            state.counters[GOAL] = state.heap[0]
            return FOUND
        node = take(state)
        count = expand(lattice, node, nodes, costs, edges)
        state.counters[GENERATED] += count
        here = state.costs[node]
        for i in range(count):
            cost = here + costs[i]
            if not state.known[nodes[i]] or cost < state.costs[nodes[i]]:
                bound = estimate(lattice, nodes[i])
                offer(state, nodes[i], cost, bound, node, edges[i])
    return PAUSED


class AStar:
    """A search that runs in batches and can be taken up again.

    Args:
        lattice: a named tuple with overloads of `expand`, `estimate` and `is_goal`; None for a
            search that is driven from outside with `take` and `offer`.
        size: number of nodes.
        branching: greatest number of successors of a node.
    """

    def __init__(self, lattice: Any, size: int, branching: int) -> None:
        self.lattice = lattice
        self._memory = _borrowed(size)
        parts = (values[:size] for values in self._memory[:-1])
        self.state = SearchState._make((*parts, self._memory.counters))
        self._nodes = np.empty(branching, dtype=np.int64)
        self._costs = np.empty(branching)
        self._edges = np.empty(branching, dtype=np.int64)

    def __del__(self) -> None:
        """Leave the memory to the next search."""
        if not _spare and hasattr(self, "_memory"):
            _spare.append(self._memory)

    def start(self, node: int, *, cost: float = 0.0, bound: float = 0.0, edge: int = -1) -> None:
        """Open a node from which paths may begin."""
        offer(self.state, node, float(cost), float(bound), -1, edge)

    def run(self, budget: int) -> int:
        """Expand up to ``budget`` nodes.

        Returns:
            `FOUND` when the cheapest open node is a goal (then `goal` is set), `EXHAUSTED` when
            no open node is left, `PAUSED` when the budget was used up.
        """
        return int(search(self.lattice, self.state, budget, self._nodes, self._costs, self._edges))

    @property
    def goal(self) -> int:
        """The goal that was reached, -1 before."""
        return int(self.state.counters[GOAL])

    @property
    def expanded(self) -> int:
        """Number of nodes that have been expanded."""
        return int(self.state.counters[EXPANDED])

    @property
    def cost(self) -> float:
        """Cost of the path to the goal, infinite before it is reached."""
        if self.goal < 0:
            return np.inf
        return float(self.state.costs[self.goal])

    def path(self, node: int | None = None) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Nodes from a start to ``node``, by default the goal, and the labels of the edges.

        Returns:
            (P,) nodes and (P,) labels; label i is that of the edge that leads to node i, the
            first being the one given to `start`.
        """
        at = self.goal if node is None else node
        nodes: list[int] = []
        while at >= 0:
            nodes.append(at)
            at = int(self.state.parents[at])
        chain = np.array(nodes[::-1], dtype=np.int64)
        return chain, self.state.edges[chain]
