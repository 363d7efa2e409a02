"""Least driven length to the goal from every pose, around walls and under the turn limit.

The core's `CostToGo` is the value function of a forward car of bounded curvature on a grid of
(x, y, heading). Objects are not in it, so one table serves every call on a map; it is made and kept
a little at a time.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable

import numpy as np

from pushplan.core import motion
from pushplan.core import planners as core
from pushplan.motion.collision import footprint, obstacles
from pushplan.motion.goal_region import goal_numbers
from pushplan.world import GoalDisc, NavigationGoal, RobotModel, StaticMap

HEADINGS = 32
"""Headings of the grid."""
_CELL = 0.33  # side of a cell [R]
_COARSEST = 0.8  # side of a cell beyond which a table would not resolve the robot [R]
_MOST_CELLS = 16_000  # cells (x, y) at most; larger maps get larger cells
_ARC = 2.0  # length of the arcs that carry values from cell to cell [cells]
_SETTLED = 0.02  # change of a value below which the table is done [R]
_MOST_SWEEPS = 60
_BLOCK = 60  # cells (x, y) that are worked on between two looks at the stop rule: under 2 ms


class CostToGoMaker:
    """Makes one table in small steps, so that a planning call can stop in between.

    What is done is kept for the next call. Thread-safe.
    """

    def __init__(
        self,
        robot: RobotModel,  # gives footprint and size
        static: StaticMap,  # the map
        goal: NavigationGoal,
        radius: float,  # least turning radius [m]
        inset: float,  # depth in the goal at which paths end [m]
    ) -> None:
        size = robot.circumscribed_radius
        self._goal = goal_numbers(goal, inset)
        self._shape = footprint(robot)
        self._walls = obstacles(static)
        extent = static.bounds[2:] - static.bounds[:2]
        least = float(np.sqrt(extent[0] * extent[1] / _MOST_CELLS))
        cell = max(_CELL * size, least, float(extent.max()) / _MOST_CELLS)
        self.useful = cell <= _COARSEST * size
        """True if a table of bearable size resolves the robot."""
        cols, rows = (max(1, int(np.ceil(side / cell))) if self.useful else 1 for side in extent)
        self._length = _ARC * cell
        self._center = -1
        if isinstance(goal, GoalDisc):
            at = (goal.center - static.bounds[:2]) / cell
            if (at >= 0.0).all() and at[0] < cols and at[1] < rows:
                self._center = int(at[1]) * cols + int(at[0])
        self._free = np.zeros((rows, cols, HEADINGS), np.bool_)
        self._order = np.zeros(0, np.int64)
        self._values = np.full((rows, cols, HEADINGS), np.inf)
        self._floor = np.full((rows, cols), np.inf)
        x, y = static.bounds[:2].tolist()
        self._place: tuple[float, float, float] = (x, y, cell)
        self._table = core.CostToGo(self._values, self._floor, *self._place)
        self._ends = np.zeros((HEADINGS, 3, 3))
        for k in range(HEADINGS):
            for arc, side in enumerate((-1.0, 0.0, 1.0)):
                start = np.array([0.0, 0.0, 2.0 * np.pi * k / HEADINGS])
                motion.along_arc(start, self._length, side / radius, self._ends[k, arc])
        self._marked = self._at = self._sweeps = 0
        self._change = 0.0
        self._settled = _SETTLED * size
        self._lock = threading.Lock()
        self._done = not self.useful

    def make(self, stopped: Callable[[], bool]) -> core.CostToGo | None:
        """Work until the table is done; None if the stop rule fires before, or it is of no use."""
        while not self._done:
            if stopped():
                return None
            with self._lock:
                if not self._done:
                    self._step()
        return self._table if self.useful else None

    def _step(self) -> None:
        rows, cols, _ = self._free.shape
        if self._marked < rows * cols:
            last = min(self._marked + _BLOCK, rows * cols)
            core.mark_free(self._free, self._marked, last, *self._place, self._shape, self._walls)
            self._marked = last
            if last == rows * cols:
                some = np.asarray(self._free.any(axis=2))
                self._order = core.flood(some, *self._place, self._goal, self._center, self._floor)
                self._values[(self._floor == 0.0)[:, :, None] & self._free] = 0.0
            return
        last = min(self._at + _BLOCK, len(self._order))
        order = self._order[self._at : last]
        change = self._table.sweep(self._values, self._free, order, self._ends, self._length)
        self._change = max(self._change, change)
        self._at = last
        if last == len(self._order):
            self._sweeps += 1
            self._done = self._change < self._settled or self._sweeps >= _MOST_SWEEPS
            self._at = 0
            self._change = 0.0


@functools.lru_cache(maxsize=8)
def cost_to_go_maker(
    robot: RobotModel, static: StaticMap, goal: NavigationGoal, radius: float, inset: float
) -> CostToGoMaker:
    """The maker of a table, with what is done of it; cached."""
    return CostToGoMaker(robot, static, goal, radius, inset)
