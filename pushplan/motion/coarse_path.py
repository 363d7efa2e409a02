"""A coarse shortest path that trades length against pushing: where sampling is worth while."""

from __future__ import annotations

import functools
import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from pushplan.core import motion as core
from pushplan.motion.keep_out import keep_out
from pushplan.motion.time_slicing import never
from pushplan.search.grid_dijkstra import grid_dijkstra
from pushplan.world import GoalDisc, GoalLine, NavigationGoal, StaticMap, World
from pushplan.world.checks import FloatArray, frozen
from pushplan.world.outline import flatten, outline_boxes

_SIDE = 96  # cells along the longer side of the workspace, if that resolves the robot's own width
_MOST = 400  # cells along the longer side at most
_PIECE = 300  # walls between two looks at a stop rule
_PIECE_CELLS = 50_000  # the same of the cells that they cover, of walls with up to eight corners


def _cell(world: World) -> float:
    """Side of a cell [m]: narrower than the robot, as far as the size of the map allows."""
    extent = float((world.static.bounds[2:] - world.static.bounds[:2]).max())
    return max(min(extent / _SIDE, world.robot.inscribed_radius or np.inf), extent / _MOST)


def coarse_path(
    world: World, push_weight: float, stopped: Callable[[], bool] = never
) -> FloatArray:
    """A path of the robot's centre from its pose to the goal, coarse and cheap.

    Args:
        world: the snapshot, with a goal for the robot.
        push_weight: weight of a unit of pushing work against a unit of travel; infinite treats
            objects as obstacles.
        stopped: ends the search, asked every few milliseconds.

    Returns:
        (N, 2) points about one cell apart [m]; empty where there is no such path.
    """
    robot = world.robot
    objects = world.movables
    inner = robot.inscribed_radius
    outer = robot.circumscribed_radius
    cell = _cell(world)
    # walls hold the inscribed disc for certain; the rest of the footprint is a matter of heading
    terms = (inner, np.inf), (1.3 * outer, 2.0)
    walls = _wall_weights(keep_out(world), cell, terms).make(stopped)
    if walls is None:
        return np.empty((0, 2))
    # passing through the middle of a box pushes it for about a robot's width
    per_metre = push_weight * objects.masses / robot.mass
    boxes = objects.every_part_world
    reach = np.full(len(boxes), outer)
    weights = per_metre[objects.part_owners]
    extra = _no_weights(world.static.bounds, cell)
    _add_weights(extra, world.static.bounds, cell, boxes, reach, weights)
    return _cheapest(world, walls + extra, cell, stopped)


def reachable(world: World, stopped: Callable[[], bool] = never) -> bool:
    """Return True if the robot's inscribed disc may get from the start to the goal around walls.

    False only where it certainly does not, or ``stopped`` ends the search.
    """
    cell = _cell(world)
    inner = world.robot.inscribed_radius
    if cell > inner:
        return True  # too coarse to tell
    # a cell less than the disc: a narrow gap is left for the search to find out about
    extra = _wall_weights(keep_out(world), cell, ((inner - cell, np.inf),)).make(stopped)
    goal: NavigationGoal = world.navigation_goal  # grown by a cell: its rim may be reached alone
    if isinstance(goal, GoalDisc):
        goal = GoalDisc(goal.center, goal.radius + cell)
    else:
        goal = GoalLine(goal.point - cell * goal.normal, goal.normal)
    world = replace(world, goal=goal)
    return extra is None or len(_cheapest(world, extra, cell, stopped)) > 0


class _WallWeights:
    """Extra cost per metre of each cell from walls, one term for each reach [m] and weight.

    They are made in small steps; what is done is kept.
    """

    def __init__(
        self, static: StaticMap, cell: float, terms: tuple[tuple[float, float], ...]
    ) -> None:
        self._static = static
        self._cell = cell
        self._terms = terms
        self._made = [_no_weights(static.bounds, cell) for _ in terms]
        self._done = 0
        self._row = 0  # of the next wall, if that takes several pieces
        self._lock = threading.Lock()
        reach = max(away for away, _ in terms)
        low = np.maximum(static.boxes[:, :2] - reach, static.bounds[:2])
        high = np.minimum(static.boxes[:, 2:] + reach, static.bounds[2:])
        cells = (np.maximum(high - low, 0.0) / cell).prod(axis=1)
        cells *= np.maximum(np.diff(static.packed[1]) / 8.0, 1.0)
        self._cells = np.append(0.0, np.cumsum(cells))  # of the parts before each

    def make(self, stopped: Callable[[], bool]) -> FloatArray | None:
        """Go on until all is done, or ``stopped``, asked every few milliseconds, says so: None."""
        parts = self._static.convex_parts
        while self._done < len(parts):
            if stopped():
                return None
            with self._lock:
                most = self._cells[self._done] + _PIECE_CELLS
                last = int(np.searchsorted(self._cells, most, "right")) - 1
                last = min(max(last, self._done + 1), self._done + _PIECE)
                some = parts[self._done : last]
                share = _PIECE_CELLS / max(self._cells[last] - self._cells[self._done], 1.0)
                end = self._row + math.ceil(min(share, 1.0) * len(self._made[0]))
                for (reach, weight), made in zip(self._terms, self._made, strict=True):
                    full = np.full(len(some), reach), np.full(len(some), weight)
                    rows = self._row, end
                    _add_weights(made, self._static.bounds, self._cell, some, *full, rows)
                self._row = end
                if end >= len(self._made[0]):
                    self._row = 0
                    self._done += len(some)
        return self._whole

    @functools.cached_property
    def _whole(self) -> FloatArray:
        return frozen(np.sum(self._made, axis=0))


_wall_weights = functools.lru_cache(maxsize=16)(_WallWeights)


def _no_weights(bounds: FloatArray, cell: float) -> FloatArray:
    cols, rows = (int(np.ceil(side / cell)) for side in bounds[2:] - bounds[:2])
    return np.zeros((rows, cols))


def _add_weights(
    weights: FloatArray,
    bounds: FloatArray,
    cell: float,
    shapes: Sequence[FloatArray],
    reach: FloatArray,
    weight: FloatArray,
    rows: tuple[int, int] | None = None,
) -> None:
    """Add the weight of each shape to the cells within its reach [m], of some rows or of all."""
    vertices, offsets = flatten(shapes)
    boxes = outline_boxes(vertices, offsets) + reach[:, None] * [-1.0, -1.0, 1.0, 1.0]
    within = ((boxes - np.tile(bounds[:2], 2)) / cell).astype(np.int64)
    if rows is not None:
        within[:, 1] = np.maximum(within[:, 1], rows[0])
        within[:, 3] = np.minimum(within[:, 3], rows[1] - 1)
    x, y = bounds[:2]
    core.add_cell_weights(weights, x, y, cell, vertices, offsets, within, reach, weight)


def _cheapest(
    world: World, extra: FloatArray, cell: float, stopped: Callable[[], bool]
) -> FloatArray:
    """The cheapest path from the robot to the goal over a grid of weights."""
    bounds = world.static.bounds
    goal = world.navigation_goal
    rows, cols = extra.shape
    x = bounds[0] + (np.arange(cols) + 0.5) * cell
    y = bounds[1] + (np.arange(rows) + 0.5) * cell
    row, col = _cell_of(world.robot_pose[:2], bounds, cell, rows, cols)
    reached = goal.contains(np.stack(np.meshgrid(x, y), axis=-1))
    if isinstance(goal, GoalDisc):  # it may be smaller than a cell
        reached[_cell_of(goal.center, bounds, cell, rows, cols)] = True
    start = np.array([row * cols + col])
    _, parents, order = grid_dijkstra(1.0 + extra, start, reached, cell, stopped)
    at = int(order[-1])
    if not reached[divmod(at, cols)]:
        return np.empty((0, 2))
    chain = []
    while at >= 0:
        chain.append(at)
        at = int(parents[at])
    cells = np.array(chain[::-1])
    return bounds[:2] + (np.column_stack([cells % cols, cells // cols]) + 0.5) * cell


def _cell_of(
    point: FloatArray, bounds: FloatArray, cell: float, rows: int, cols: int
) -> tuple[int, int]:
    """Row and column of the cell nearest to a point (2,)."""
    col = int(np.clip((point[0] - bounds[0]) / cell, 0, cols - 1))
    return int(np.clip((point[1] - bounds[1]) / cell, 0, rows - 1)), col
