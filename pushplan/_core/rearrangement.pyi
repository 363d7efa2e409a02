"""Parts of rearrangement planning."""

from typing import Annotated

import numpy
from numpy.typing import NDArray

import pushplan._core.interaction
import pushplan._core.motion


class ObjectGoal:
    """The goal of the objects."""

    def __init__(self, polygon: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], edges: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], is_receptacle: bool, slack: float) -> None: ...

def all_done(poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], bodies: pushplan._core.interaction.Bodies, goal: ObjectGoal) -> Annotated[NDArray[numpy.bool_], dict(shape=(None,))]:
    """(K,) whether each object is where it belongs."""

def cost_to_go(costs: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], delivers: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], objects: int) -> tuple[Annotated[NDArray[numpy.float64], dict(shape=(None, None))], Annotated[NDArray[numpy.int64], dict(shape=(None, None))]]:
    """
    (2^objects, N + 1) cost of delivering the rest, and the push to follow or -1, by what is delivered and the last push; N for none.
    """

MAX_OBJECTS: int = 62

MAX_EXACT: int = 11

REMOVED: float = 10000000.0

class PoseGrid:
    """
    A lattice of poses over a static map; cell (i, j) has its middle at (x, y) + (j, i) * step.
    """

    def __init__(self, x: float, y: float, step: float, rows: int, columns: int, shape: pushplan._core.motion.Footprint, among: pushplan._core.motion.ConvexObstacles) -> None: ...

    @property
    def x(self) -> float: ...

    @property
    def y(self) -> float: ...

    @property
    def step(self) -> float: ...

    @property
    def blocked(self) -> Annotated[NDArray[numpy.bool_], dict(shape=(None, None, None), writable=False)]:
        """(16, rows, columns) where something static is in the way."""

    @property
    def blocked_moves(self) -> Annotated[NDArray[numpy.bool_], dict(shape=(None, None, None, None), writable=False)]:
        """
        (2, 16, rows, columns) from where it is in the way of the move ahead, and of the turn to the next heading.
        """

    def near_poses(self, pose: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], reach: float) -> tuple[Annotated[NDArray[numpy.int64], dict(shape=(None,))], Annotated[NDArray[numpy.float64], dict(shape=(None,))]]:
        """
        Flat indices of free poses within `reach` cells, and the cost of going there [m].
        """

    def contact_depths(self, shape: pushplan._core.motion.Footprint, poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], bodies: pushplan._core.interaction.Bodies) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None, None, None))]:
        """(K, 16, rows, columns) depth of the footprint in each object [m]."""

    def search(self, starts: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], start_costs: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], depths: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], touch: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], turn_cost: float, arm: float, targets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> tuple[Annotated[NDArray[numpy.float64], dict(shape=(None,))], Annotated[NDArray[numpy.int64], dict(shape=(None,))]]:
        """
        Cost of each pose [m], and the pose before it, -1 for none. Ends with the last target.
        """

def add_layers(layers: Annotated[NDArray[numpy.float32], dict(shape=(None, None, None, None), order='C', device='cpu', writable=False)], weights: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> tuple[Annotated[NDArray[numpy.float64], dict(shape=(None, None, None))], Annotated[NDArray[numpy.float64], dict(shape=(None, None, None))]]:
    """
    Depth in all objects of weight at each pose [m], and the weights of those it is in.
    """

def least_costs(costs: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], nodes: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], extra: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], ends: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
    """
    (N,) cost of getting to places, each by those of the poses that end there [m].
    """

def pose_behind(pose: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], outline: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], heading: float, shift: float, distance: float) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

def pushable_moves(middles: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], is_open: Annotated[NDArray[numpy.bool_], dict(shape=(None, None), order='C', device='cpu', writable=False)], shifts: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], distance: float, shape: pushplan._core.motion.Footprint, among: pushplan._core.motion.ConvexObstacles) -> Annotated[NDArray[numpy.bool_], dict(shape=(None, None, None))]:
    """
    (16, rows, columns) whether the robot fits behind an object to push it along each heading.
    """

def push_costs(is_open: Annotated[NDArray[numpy.bool_], dict(shape=(None, None), order='C', device='cpu', writable=False)], pushable: Annotated[NDArray[numpy.bool_], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], goals: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], step: float, drag_cost: float) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
    """
    (rows, columns) cost of the cheapest path of an object from each cell to a goal [m].
    """

class RouteSearch:
    """Costs of motions among objects and walls, with memory for one thread."""

    def __init__(self, step: float, turn_cost: float, arm: float, shape: pushplan._core.motion.Footprint, tight: pushplan._core.motion.Footprint, among: pushplan._core.motion.ConvexObstacles, poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], bodies: pushplan._core.interaction.Bodies, weights: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

    def cheapest_legs(self, points: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], heading: float, end: float, first: int, longest: int) -> tuple[Annotated[NDArray[numpy.float64], dict(shape=(None,))], Annotated[NDArray[numpy.int64], dict(shape=(None,))], Annotated[NDArray[numpy.float64], dict(shape=(None, None))]]:
        """
        Costs of ending ahead and back; the row before each row (2 i, 2 i + 1); (2 N, 2) turns before and after.
        """

class PushingController:
    """Parameters of the geometric pushing controller."""

    def __init__(self, step: float, turn: float, size: float, half: float, front: float, ahead: float, gain: float) -> None: ...

    @property
    def step(self) -> float:
        """Distance between two commands [m]."""

    @property
    def turn(self) -> float:
        """Greatest turn in one step [rad]."""

    @property
    def ahead(self) -> float:
        """Look-ahead distance of the object on its path [m]."""

    def with_gain(self, gain: float) -> PushingController: ...

    def is_on_bumper(self, robot: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], target: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)]) -> bool: ...

    def steer_push(self, robot: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], target: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], path: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], reached: float, shift: float) -> tuple[float, float, float, bool]:
        """
        Step [m], turn [rad], arc length now [m], and whether the object is on the bumper.
        """

def along_path(x: float, y: float, path: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], reached: float, ahead: float) -> tuple[float, float, float, float]:
    """
    The point to head for, the arc length of the nearest one, and the distance to that [m].
    """

class PushRollout:
    """Rollouts of pushes, with memory for one thread."""

    def __init__(self, bodies: pushplan._core.interaction.Bodies, goal: ObjectGoal, max_step: float, tolerance: float, jam_depth: float, iterations: int, friction: float, static_friction: float) -> None: ...

    def run(self, start: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], target: int, path: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], shift: float, limit: float, wanted: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C', device='cpu', writable=False)], controller: PushingController, longest: int) -> tuple[Annotated[NDArray[numpy.float64], dict(shape=(None, None))], Annotated[NDArray[numpy.int64], dict(shape=(None,))], Annotated[NDArray[numpy.float64], dict(shape=(None, None, None))], Annotated[NDArray[numpy.float64], dict(shape=(None, None))], Annotated[NDArray[numpy.float64], dict(shape=(None,))]]:
        """
        (T, 3) poses of the robot, at most `longest`; (S,) how many of them each stage has; (S, K, 3) the objects and (S, K) their path lengths at its end [m]; (4,) the box around all that moved and its surroundings [m].
        """

def sweep_arcs(model: pushplan._core.interaction.QuasiStatic, start: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], arcs: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], steps: int, target: int, size: float, least: float) -> tuple[Annotated[NDArray[numpy.float64], dict(shape=(None, None, None))], Annotated[NDArray[numpy.float64], dict(shape=(None, None, None, None))], Annotated[NDArray[numpy.int64], dict(shape=(None, None))]]:
    """
    (A, steps + 1, 3) poses of the robot along arcs, (A, steps + 1, K, 3) of the objects, and (N, 2) the arcs and steps at which the target has moved on. What lies beyond the last of them on an arc is not defined.
    """
