"""Shortest paths on graphs."""

import enum
from typing import Annotated

import numpy
from numpy.typing import NDArray


class SearchStatus(enum.Enum):
    """How far a search has come."""

    EXHAUSTED = 0
    """No path exists."""

    FOUND = 1
    """The cheapest open node is a goal."""

    PAUSED = 2
    """The budget was used up."""

class SearchTree:
    """Cheapest paths known so far, and the open nodes."""

    def __init__(self, size: int) -> None: ...

    def clear(self) -> None: ...

    def offer(self, node: int, cost: float, bound: float, parent: int, edge: int) -> None: ...

    def take(self) -> int: ...

    def known(self, node: int) -> bool: ...

    def closed(self, node: int) -> bool: ...

    def cost(self, node: int) -> float: ...

    def parent(self, node: int) -> int: ...

    def edge(self, node: int) -> int: ...

    def next(self) -> int: ...

    @property
    def open_nodes(self) -> Annotated[NDArray[numpy.int64], dict(shape=(None,))]: ...

    @property
    def open_count(self) -> int: ...

    @property
    def expanded(self) -> int: ...

    def path(self, node: int) -> Annotated[NDArray[numpy.int64], dict(shape=(None, None))]:
        """(P, 2) nodes from a start on, and the labels of the edges to them."""

class GridDijkstra:
    """Dijkstra's algorithm over the cells of a grid."""

    def __init__(self, weights: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], cell: float, starts: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

    def settle(self, goals: Annotated[NDArray[numpy.bool_], dict(shape=(None, None), order='C', device='cpu', writable=False)], upto: int) -> bool: ...

    @property
    def costs(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

    @property
    def parents(self) -> Annotated[NDArray[numpy.int64], dict(shape=(None,))]: ...

    @property
    def order(self) -> Annotated[NDArray[numpy.int64], dict(shape=(None,))]: ...
