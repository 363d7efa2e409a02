"""From a world to a `PoseLattice`: the map, the primitives, the goal and the bounds."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pushplan.motion.keep_out import keep_out
from pushplan.motion.state_lattice.built_lattice import BuiltLattice, Frame, PoseLattice
from pushplan.motion.state_lattice.lattice_config import LatticeConfig
from pushplan.motion.state_lattice.lattice_map import (
    LEAN,
    FloeCosts,
    HullWindow,
    LatticeMap,
    place_costs,
)
from pushplan.motion.state_lattice.primitives import PrimitiveConfig, primitives
from pushplan.motion.state_lattice.swaths import flat_runs, swaths
from pushplan.motion.time_slicing import go_on, never
from pushplan.world import GoalDisc, World
from pushplan.world.checks import FloatArray


def dubins_to_line(
    distance: FloatArray,  # from the line [m], not negative
    heading: FloatArray,  # relative to the line's normal [rad]; broadcast with ``distance``
    radius: float,  # least turning radius R [m]
) -> FloatArray:
    """Length [m] of the shortest path of bounded curvature from a pose to a line.

    The robot turns towards the normal of the line until it faces it or is there, and then drives
    straight. While it turns from α to β it gets on by R (sin α - sin β).
    """
    angle = np.abs((np.asarray(heading) + np.pi) % (2.0 * np.pi) - np.pi)
    gained = radius * np.sin(angle)
    straight = radius * angle + (distance - gained)
    left = np.arcsin(np.clip(np.sin(angle) - distance / radius, -1.0, 1.0))
    turning = radius * (angle - left)
    length: FloatArray = np.where(distance >= gained, straight, np.maximum(turning, 0.0))
    return np.where(distance <= 0.0, 0.0, length)


FloeCostFunction = Callable[[World, float], FloeCosts]
"""Costs of the floes of a world on a map whose cells have a side [m]."""
_MOST_NODES = 3_000_000
_MOST_CELLS = 1_000_000
_FEW_COLUMNS = 256  # of the map, between two looks at a stop rule
_STEP = 0.5  # of the lattice, about [B]; the turning radius is a whole number of steps
_THINNEST = 0.1  # breadth that a thin robot counts as [circumscribed radii]
_RATIOS = (2, 40)  # fewest and most steps in a turning radius
_ASIDE = 0.3  # breadth of a clipped lattice, to each side [lengths of the straight line]
_LEAST_ASIDE = 20  # the same at least [steps]
_CELLS_PER_STEP = 4  # of the cost map; fewer where the map would be too large


@dataclass(eq=False)
class LatticeBuilder:
    """Makes the lattice of one planning call."""

    world: World
    config: LatticeConfig
    radius: float  # least turning radius [m]
    side: float  # distance of the robot's origin from the bounds [m]
    floe_costs: FloeCostFunction | None = None  # None where floes cost nothing
    stopped: Callable[[], bool] = never  # ends the work with `Stopped`

    def __post_init__(self) -> None:
        world = self.world
        config = self.config
        radius = self.radius
        robot = self.world.robot
        # the radius is a whole number of steps, so that few sets of primitives are ever needed
        width = 2.0 * max(robot.inscribed_radius, _THINNEST * robot.circumscribed_radius)
        least, most = _RATIOS
        ratio = float(min(max(round(radius / (_STEP * width)), least), most))
        self.step = radius / ratio
        goal = world.goal
        if isinstance(goal, GoalDisc):  # longer steps, so that the middle of a disc is a place
            steps = math.hypot(*(goal.center - world.robot_pose[:2])) / self.step
            self.step *= steps / math.floor(steps) if steps >= 1.0 else 1.0
        self.motions = primitives(
            PrimitiveConfig(config.headings, ratio, config.variants, config.shifts), self.stopped
        )
        self.frame = Frame.towards_goal(world)
        self.heading = self.frame.heading(float(world.robot_pose[2]))
        self._lay_out()
        self.cells = _CELLS_PER_STEP
        while self.cells > 1 and self.rows * self.columns * self.cells**2 > _MOST_CELLS:
            self.cells -= 1
        self.cell = self.step / self.cells

    def _lay_out(self) -> None:
        """Set how many rows and columns there are, and where the robot and the goal are."""
        goal = self.world.navigation_goal
        away = goal.distance(*(float(v) for v in self.world.robot_pose[:2]))
        corners = self.world.static.bounds[[[0, 1], [2, 1], [2, 3], [0, 3]]]
        box = self.frame.from_world(np.clip(corners, -1e9, 1e9)) / self.step
        low = np.minimum(box.min(axis=0), 0.0)
        high = np.maximum(box.max(axis=0), 0.0)
        if isinstance(goal, GoalDisc):  # the path around walls may lead anywhere
            self.arrives = True
            self.ahead = away / self.step
            behind = -low[0]
            rows_ahead = high[0]
            far = np.inf
        else:
            behind, rows_ahead, far = self._along(away, low, high)
        sides = [min(extent, far) for extent in (-low[1], high[1])]
        reach = [math.ceil(min(extent, 1e6)) for extent in (behind, rows_ahead, *sides)]
        size = (reach[0] + reach[1]) * (reach[2] + reach[3]) * self.config.headings
        self.clipped = size > _MOST_NODES
        if self.clipped:  # a small robot in a large hall: look only near the straight line
            aside = max(math.ceil(_ASIDE * self.ahead), _LEAST_ASIDE)
            most = (aside, math.ceil(self.ahead) + aside, aside, aside)
            reach = [min(pair) for pair in zip(reach, most, strict=True)]
        self.rows = reach[0] + reach[1] + 1
        self.columns = reach[2] + reach[3] + 1
        self.start = (reach[0], reach[2])

    def _along(self, away: float, low: FloatArray, high: FloatArray) -> tuple[float, float, float]:
        """Rows behind and ahead of the robot, and columns beside it, before a line ``away`` [m]."""
        size = self.world.robot.circumscribed_radius
        horizon = self.config.horizon * size
        self.arrives = away <= horizon
        self.ahead = min(away + self.config.inset * size, horizon) / self.step
        if self.arrives:  # no farther beyond the line than the bounds allow
            self.ahead = min(self.ahead, max(high[0] - self.side / self.step, away / self.step))
        # the ends of a primitive may lie beyond the line, and behind the robot where it turns
        beyond = math.ceil(float(self.motions.lengths.max())) + 1
        behind = beyond if abs(self.heading) > 1.0 else 1
        if abs(self.heading) > 1.5:
            behind += math.ceil(2.0 * self.radius / self.step)
        far = self.ahead + beyond + behind
        return min(behind, -low[0]), math.ceil(self.ahead) + beyond, far

    def build(self, factor: float = 1.0) -> BuiltLattice:
        """The lattice, with a factor on the costs of all floes."""
        lattice, sums = self._common
        if factor != 1.0:
            for first in range(0, len(sums), _FEW_COLUMNS):
                go_on(self.stopped)
                few = slice(first, first + _FEW_COLUMNS)
                np.multiply(factor, sums[few], out=self._scaled[few])
            sums = self._scaled
        go_on(self.stopped)
        lengths, costs = self._heuristic(sums, lattice)
        lattice = lattice._replace(cost_sums=sums.ravel(), row_bounds=lengths, place_costs=costs)
        if not sums.any():  # inflated, lane changes would come first where nothing is to avoid
            lattice = lattice._replace(inflation=1.0)
        start = (*self.start, self.heading)
        return BuiltLattice(lattice, self.frame, self.motions, start, self.arrives)

    @cached_property
    def _scaled(self) -> FloatArray:
        """Memory for sums with a factor, of one search at a time."""
        return np.empty_like(self._common[1])

    @cached_property
    def _map(self) -> LatticeMap:
        """The map; no swath leaves it: curves into the lattice bulge by less than a step more."""
        reach = self._hull + (self.motions.bulge + 1) * self.cells
        shape = (
            (self.rows - 1) * self.cells + 2 * reach + 1,
            (self.columns - 1) * self.cells + 2 * reach + 1,
        )
        return LatticeMap(self.frame, self.cell, np.array(self.start) * self.cells + reach, shape)

    @cached_property
    def _common(self) -> tuple[PoseLattice, FloatArray]:
        """A lattice without costs of floes, and the sums of those costs."""
        robot = self.world.robot
        step = self.step
        grid = self._map
        outlines = robot.vertices / step
        covered = swaths(self.motions, outlines, robot.offsets, self.cells, self.stopped)
        stride = grid.shape[0] + 1
        lattice = PoseLattice(
            rows=self.rows,
            columns=self.columns,
            step=step,
            cells=self.cells,
            corner=grid.origin - np.array(self.start) * self.cells,
            first=self.motions.first,
            ends=self.motions.ends,
            lengths=self.motions.lengths * step,
            boxes=self.motions.boxes,
            run_first=covered.first,
            runs=flat_runs(covered.runs, stride),
            cost_sums=np.zeros(0),
            blocked_sums=grid.blocked_sums(keep_out(self.world), self.stopped),
            stride=stride,
            planes=self._planes(),
            goal=self._goal(),
            row_bounds=np.zeros((1, 1)),
            place_costs=np.zeros((1, 1)),
            inflation=self.config.inflation,
        )
        floes = self.world.movables
        if self.floe_costs is None or not len(floes):
            return lattice, grid.no_costs()
        costs = self.floe_costs(self.world, self.cell)
        return lattice, grid.cost_sums(floes, costs, self.stopped)

    @property
    def _hull(self) -> int:
        """Distance that the hull reaches from its origin [cells]."""
        return int(np.ceil(self.world.robot.circumscribed_radius / self.cell)) + 2

    def _heuristic(self, sums: FloatArray, lattice: PoseLattice) -> tuple[FloatArray, FloatArray]:
        """Return the bounds on the cost to a line for `PoseLattice`; its own for a disc."""
        if isinstance(self.world.goal, GoalDisc):
            return lattice.row_bounds, lattice.place_costs
        cells = self.cells
        goal_row = self.start[0] + self.ahead
        reach = int(lattice.corner[0])
        distances = np.maximum(goal_row - np.arange(float(self.rows)), 0.0) * self.step
        lengths = dubins_to_line(distances[None], self.motions.angles[:, None], self.radius)
        radius = self.world.robot.inscribed_radius / self.cell
        half = max(math.floor(radius - 1.0), 0)
        window = HullWindow(half, self._hull, 0, 1, 1.0, self.cell, LEAN)
        if self.config.heuristic == "estimate":
            factor = 2.0 * radius / (2 * half + 1)
            window = window._replace(reach=0, along=self._hull, stage=cells, factor=factor)
        last = reach + (self.columns - 1) * cells
        costs = place_costs(
            sums,
            np.arange(self.rows) * cells + reach,
            math.floor(reach + goal_row * cells),
            np.arange(self.columns) * cells + reach,
            self._map.columns_between(self.world.static, self.side, reach, last),
            window,
        )
        return np.ascontiguousarray(lengths), costs

    def _planes(self) -> FloatArray:
        """The bounds of the world as half planes for the robot's origin [steps]."""
        x0, y0, x1, y1 = self.world.static.bounds
        normals = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
        offsets = np.array([x1, y1, -x0, -y0]) - self.side
        turned = normals @ self.frame.rotation
        turned[np.abs(turned) < 1e-12] = 0.0
        # n . (origin + rotation . step . (place - start)) <= offset
        clearance = (offsets - normals @ np.array([self.frame.x, self.frame.y])) / self.step
        clearance += turned @ np.array(self.start, dtype=np.float64) + 1e-9
        if not isinstance(self.world.goal, GoalDisc):  # a path is cut off at the line
            clearance[turned[:, 0] > 0.7] += np.inf
        kept = np.isfinite(clearance)
        planes: FloatArray = np.column_stack([turned, clearance])[kept]
        return planes

    def _goal(self) -> FloatArray:
        goal = self.world.navigation_goal
        row, column = self.start
        if isinstance(goal, GoalDisc):
            center = self.frame.from_world(goal.center[None])[0] / self.step
            inside = max(goal.radius - self.config.inset * self.world.robot.circumscribed_radius, 0)
            return np.array([1.0, row + center[0], column + center[1], inside / self.step])
        return np.array([0.0, row + self.ahead, 0.0, 0.0])
