"""Searches and tables of planners."""

from typing import Annotated, overload

import numpy
from numpy.typing import NDArray

import pushplan._core.interaction
import pushplan._core.motion
import pushplan._core.search


class CostToGo:
    """A table of lengths to the goal, made in steps."""

    def __init__(self, footprint: pushplan._core.motion.Footprint, walls: pushplan._core.motion.ConvexObstacles, goal: Annotated[NDArray[numpy.float64], dict(shape=(5), order='C', device='cpu', writable=False)], size: float, radius: float) -> None: ...

    @property
    def useful(self) -> bool: ...

    @property
    def done(self) -> bool: ...

    def step(self) -> None: ...

    @property
    def shape(self) -> tuple[int, int, int]: ...

    @property
    def cell(self) -> float: ...

    def length_to_go(self, x: float, y: float, theta: float) -> float: ...

class PushTree:
    """A search tree, in memory that is made once."""

    def __init__(self, nodes: int, objects: int, memory: float, rows: int = 1, columns: int = 1, headings: int = 1, signatures: int = 1) -> None: ...

    def set_cells(self, rows: int, columns: int, headings: int, signatures: int) -> None: ...

    def plant(self, pose: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], objects: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], estimate: float) -> None: ...

    @property
    def count(self) -> int: ...

    @property
    def full(self) -> bool: ...

    @property
    def driven(self) -> int: ...

    def cost(self, node: int) -> float: ...

    def arcs_to(self, node: int) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

class PushSearch:
    """A best-first search over arcs that push."""

    def run(self, budget: int) -> pushplan._core.search.SearchStatus: ...

    @property
    def goal(self) -> int:
        """The node of the tree in the goal, -1 before it is reached."""

class RolloutProblem:
    """Robot, static obstacles and goal."""

    def __init__(self, period: float, substeps: int, limits: Annotated[NDArray[numpy.float64], dict(shape=(6), order='C', device='cpu', writable=False)], footprint: pushplan._core.motion.Footprint, walls: pushplan._core.motion.ConvexObstacles, goal: Annotated[NDArray[numpy.float64], dict(shape=(5), order='C', device='cpu', writable=False)], has_goal: bool, allowed: float) -> None: ...

class Rollouts:
    """Rollouts of poses among objects."""

    def __init__(self, paths: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu')], twists: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu')], ends: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu')], outcomes: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu')], objects: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu')], works: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')]) -> None: ...

def roll_robots(controls: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], start: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], speed: float, turn_rate: float, problem: RolloutProblem, out: Rollouts) -> None: ...

@overload
def push_search(tree: PushTree, table: CostToGo, curvatures: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], length: float, inflation: float, pruning_factor: float, masses: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], bound: float, problem: pushplan._core.motion.PathProblem, model: pushplan._core.interaction.QuasiStatic, size: int) -> PushSearch: ...

@overload
def push_search(tree: PushTree, table: CostToGo, curvatures: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], length: float, inflation: float, pruning_factor: float, masses: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], bound: float, problem: pushplan._core.motion.PathProblem, model: pushplan._core.interaction.IceInteraction, size: int) -> PushSearch: ...

@overload
def push_search(tree: PushTree, table: CostToGo, curvatures: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], length: float, inflation: float, pruning_factor: float, masses: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], bound: float, problem: pushplan._core.motion.PathProblem, model: pushplan._core.interaction.CalledInteraction, size: int) -> PushSearch:
    """
    A search from the root of a planted tree; `size` is twice the nodes of the tree.
    """

@overload
def grow(tree: PushTree, draws: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], bound: float, longest: float, scales: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], problem: pushplan._core.motion.PathProblem, model: pushplan._core.interaction.QuasiStatic) -> int: ...

@overload
def grow(tree: PushTree, draws: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], bound: float, longest: float, scales: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], problem: pushplan._core.motion.PathProblem, model: pushplan._core.interaction.IceInteraction) -> int: ...

@overload
def grow(tree: PushTree, draws: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], bound: float, longest: float, scales: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], problem: pushplan._core.motion.PathProblem, model: pushplan._core.interaction.CalledInteraction) -> int:
    """A node in the goal; -1: none; -2: memory is full."""

@overload
def roll_objects(model: pushplan._core.interaction.QuasiStatic, start: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], rollouts: Rollouts) -> None: ...

@overload
def roll_objects(model: pushplan._core.interaction.IceInteraction, start: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], rollouts: Rollouts) -> None: ...

@overload
def roll_objects(model: pushplan._core.interaction.CalledInteraction, start: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], rollouts: Rollouts) -> None: ...

def propose_change(poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], curvatures: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], draws: Annotated[NDArray[numpy.float64], dict(shape=(4), order='C', device='cpu', writable=False)], normals: Annotated[NDArray[numpy.float64], dict(shape=(2), order='C', device='cpu', writable=False)], problem: Annotated[NDArray[numpy.float64], dict(shape=(9), order='C', device='cpu', writable=False)], out: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu')], out_curvatures: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')]) -> list[int]:
    """
    `problem` is radius, spacing, spread, most turn, end fraction, and the goal line.
    """

class IceCostToGo:
    """Costs to the goal line if no floe moved."""

    def __init__(self, table: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu')], field: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], left: float, low: float, column: float, row: float, cell: float, bow: float, mass: float, weight: float, radius: float) -> None: ...

    def fill_field(self, poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], radii: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], masses: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], half_beam: float) -> None: ...

    def fill_table(self) -> None: ...

    def cost_to_go(self, x: float, y: float, theta: float) -> float: ...

    def cost_ahead(self, arc: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], step: float) -> tuple[float, float]: ...

    def steer_on(self, pose: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], curvatures: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], step: float, out: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')]) -> int: ...

def arc_ahead(goal: float, low: Annotated[NDArray[numpy.float64], dict(shape=(2), order='C', device='cpu', writable=False)], high: Annotated[NDArray[numpy.float64], dict(shape=(2), order='C', device='cpu', writable=False)], pose: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], curvature: float, step: float, out: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')]) -> int: ...
