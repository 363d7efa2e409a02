"""From a world to a `PoseLattice`: the map, the primitives, the goal and the bounds."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pushplan.geometry import transform_outlines
from pushplan.motion.state_lattice.cost_map import add_floes, block, prefix_sums
from pushplan.motion.state_lattice.frame import Frame
from pushplan.motion.state_lattice.heuristic import LEAN, Window, place_costs, row_bounds
from pushplan.motion.state_lattice.pose_lattice import PoseLattice, flat_runs
from pushplan.motion.state_lattice.primitives import PrimitiveConfig, PrimitiveSet, primitives, ways
from pushplan.motion.state_lattice.swaths import swaths
from pushplan.planners.ship_lattice.floe_costs import floe_prices
from pushplan.planners.ship_lattice.ship_lattice_config import ShipLatticeConfig
from pushplan.world import GoalDisc, World
from pushplan.world.checks import FloatArray
from pushplan.world.outline import flatten

_MOST_NODES = 3_000_000
_MOST_CELLS = 1_000_000


@dataclass(frozen=True)
class BuiltLattice:
    """A lattice among the things of one world.

    Args:
        lattice: for the search.
        frame: in which it lies; its origin is the robot.
        motions: its primitives.
        start: (3,) row, column and heading [rad] of the robot.
        arrives: whether the goal of the lattice is that of the world, not one on the way.
    """

    lattice: PoseLattice
    frame: Frame
    motions: PrimitiveSet
    start: tuple[int, int, float]
    arrives: bool

    def node(self, heading: int, row: int, column: int) -> int:
        """Number of a node."""
        return (heading * self.lattice.rows + row) * self.lattice.columns + column

    def finish(self, world: World) -> tuple[FloatArray, FloatArray]:
        """A point (2,) [m] and the normal (2,) of the line where paths of this lattice end."""
        normal = self.frame.rotation[:, 0]
        ahead = (self.lattice.goal[1] - self.start[0]) * self.lattice.step
        return world.robot_pose[:2] + ahead * normal, normal

    @property
    def size(self) -> int:
        """Number of nodes."""
        return self.motions.config.headings * self.lattice.rows * self.lattice.columns


class LatticeBuilder:
    """Makes the lattice of one planning call.

    Args:
        world: the snapshot.
        config: parameters.
        radius: least turning radius [m].
        side: distance of the robot's origin from the bounds [m].
    """

    def __init__(
        self, world: World, config: ShipLatticeConfig, *, radius: float, side: float
    ) -> None:
        self.world, self.config, self.radius, self.side = world, config, radius, side
        robot = world.robot
        # the radius is a whole number of steps, so that few sets of primitives are ever needed
        wanted = config.step * 2.0 * max(robot.inscribed_radius, 0.1 * robot.circumscribed_radius)
        ratio = float(min(max(round(radius / wanted), 2), 40))
        self.step = radius / ratio
        goal = world.goal
        if isinstance(goal, GoalDisc):  # longer steps, so that the middle of a disc is a place
            steps = math.hypot(*(goal.center - world.robot_pose[:2])) / self.step
            self.step *= steps / math.floor(steps) if steps >= 1.0 else 1.0
        self.motions = primitives(
            PrimitiveConfig(config.headings, ratio, config.variants, config.shifts)
        )
        self.frame = Frame.towards_goal(world)
        self.heading = self.frame.heading(float(world.robot_pose[2]))
        self._common: tuple[PoseLattice, FloatArray] | None = None
        self._lay_out()
        self.cells = config.cells_per_step
        while self.cells > 1 and self.rows * self.columns * self.cells**2 > _MOST_CELLS:
            self.cells -= 1
        self.cell = self.step / self.cells

    def _lay_out(self) -> None:
        """How many rows and columns there are, and where the robot and the goal are."""
        goal = self.world.navigation_goal
        away = goal.distance(*(float(v) for v in self.world.robot_pose[:2]))
        corners = self.world.static.bounds[[[0, 1], [2, 1], [2, 3], [0, 3]]]
        box = self.frame.inwards(np.clip(corners, -1e9, 1e9)) / self.step
        low, high = np.minimum(box.min(axis=0), 0.0), np.maximum(box.max(axis=0), 0.0)
        if isinstance(goal, GoalDisc):  # the way around walls may lead anywhere
            self.arrives, self.ahead = True, away / self.step
            behind, rows_ahead, far = -low[0], high[0], np.inf
        else:
            behind, rows_ahead, far = self._along(away, low, high)
        sides = [min(extent, far) for extent in (-low[1], high[1])]
        reach = [math.ceil(min(extent, 1e6)) for extent in (behind, rows_ahead, *sides)]
        size = (reach[0] + reach[1]) * (reach[2] + reach[3]) * self.config.headings
        self.clipped = size > _MOST_NODES
        if self.clipped:  # a small robot in a large hall: look only near the straight way
            room = max(math.ceil(0.3 * self.ahead), 20)
            most = (room, math.ceil(self.ahead) + room, room, room)
            reach = [min(pair) for pair in zip(reach, most, strict=True)]
        self.rows, self.columns = reach[0] + reach[1] + 1, reach[2] + reach[3] + 1
        self.start = (reach[0], reach[2])

    def _along(self, away: float, low: FloatArray, high: FloatArray) -> tuple[float, float, float]:
        """Rows behind and ahead of the robot, and columns beside it, on the way to a line.

        Args:
            away: distance of the line [m].
            low: (2,) least coordinates of the bounds, not above 0 [steps].
            high: (2,) greatest ones.
        """
        size = self.world.robot.circumscribed_radius
        horizon = self.config.horizon * size
        self.arrives = away <= horizon
        self.ahead = min(away + self.config.inset * size, horizon) / self.step
        if self.arrives:  # no farther beyond the line than the bounds allow
            self.ahead = min(self.ahead, max(high[0] - self.side / self.step, away / self.step))
        # the ends of a primitive may lie beyond the line, and behind the robot where it turns
        beyond = math.ceil(float(self.motions.lengths.max())) + 1
        behind = beyond if abs(self.heading) > 1.0 else 1
        behind += math.ceil(2.0 * self.radius / self.step) if abs(self.heading) > 1.5 else 0
        far = self.ahead + beyond + behind
        return min(behind, -low[0]), math.ceil(self.ahead) + beyond, far

    def build(self, factor: float = 1.0) -> BuiltLattice:
        """The lattice, with a factor on all prices."""
        if self._common is None:
            self._common = self._make_common()
        lattice, sums = self._common
        if factor != 1.0:
            sums = factor * sums
        lengths, costs = self._guide(sums, lattice)
        lattice = lattice._replace(price_sums=sums.ravel(), row_bounds=lengths, place_costs=costs)
        if not sums.any():  # inflated, lane changes would come first where nothing is to avoid
            lattice = lattice._replace(inflation=1.0)
        start = (*self.start, self.heading)
        return BuiltLattice(lattice, self.frame, self.motions, start, self.arrives)

    def _make_common(self) -> tuple[PoseLattice, FloatArray]:
        """A lattice without prices, and the sums of the prices."""
        robot, cells, step = self.world.robot, self.cells, self.step
        # no swath leaves the map: curves into the lattice bulge by less than a step more
        reach = self._hull() + (self.motions.bulge + 1) * cells
        shape = (
            (self.rows - 1) * cells + 2 * reach + 1,
            (self.columns - 1) * cells + 2 * reach + 1,
        )
        covered = swaths(self.motions, robot.vertices / step, robot.offsets, cells)
        lattice = PoseLattice(
            rows=self.rows,
            columns=self.columns,
            step=step,
            cells=cells,
            corner=np.array([reach, reach], dtype=np.int64),
            first=self.motions.first,
            ends=self.motions.ends,
            lengths=self.motions.lengths * step,
            boxes=self.motions.boxes,
            run_first=covered.first,
            runs=flat_runs(covered.runs, shape[0] + 1),
            price_sums=np.zeros(0),
            blocked_sums=self._blocked_sums(shape, reach),
            stride=shape[0] + 1,
            planes=self._planes(),
            goal=self._goal(),
            row_bounds=np.zeros((1, 1)),
            place_costs=np.zeros((1, 1)),
            inflation=self.config.inflation,
        )
        return lattice, self._price_sums(shape, reach)

    def _hull(self) -> int:
        """How far the hull reaches from its origin [cells]."""
        return int(np.ceil(self.world.robot.circumscribed_radius / self.cell)) + 2

    def _guide(self, sums: FloatArray, lattice: PoseLattice) -> tuple[FloatArray, FloatArray]:
        """What `PoseLattice` knows about the cost to a line; nothing for a disc."""
        if isinstance(self.world.goal, GoalDisc):
            return lattice.row_bounds, lattice.place_costs
        cells, goal_row = self.cells, self.start[0] + self.ahead
        reach = int(lattice.corner[0])
        lengths = row_bounds(
            self.motions.angles, np.arange(float(self.rows)), goal_row, self.step, self.radius
        )
        radius = self.world.robot.inscribed_radius / self.cell
        half = max(math.floor(radius - 1.0), 0)
        window = Window(half, self._hull(), 0, 1, 1.0, self.cell, LEAN)
        if self.config.guide == "estimate":
            factor = 2.0 * radius / (2 * half + 1)
            window = window._replace(reach=0, along=self._hull(), stage=cells, factor=factor)
        costs = place_costs(
            sums,
            np.arange(self.rows) * cells + reach,
            math.floor(reach + goal_row * cells),
            np.arange(self.columns) * cells + reach,
            self._across(reach),
            window,
        )
        return lengths, costs

    def _across(self, reach: int) -> tuple[int, int]:
        """First and last column of the map where the origin may be."""
        bounds = self.world.static.bounds + self.side * np.array([1.0, 1.0, -1.0, -1.0])
        finite = np.clip(bounds, -1e12, 1e12)
        corners = self._to_cells(finite[[[0, 1], [2, 1], [2, 3], [0, 3]]], reach)[:, 1]
        most = reach + (self.columns - 1) * self.cells
        first = min(max(math.ceil(float(corners.min()) - 1e-9), reach), most)
        return first, max(min(math.floor(float(corners.max()) + 1e-9), most), first)

    def _to_cells(self, points_world: FloatArray, reach: int) -> FloatArray:
        """(N, 2) points of the world as rows and columns of the map."""
        shift = np.array(self.start) * self.cells + reach
        points: FloatArray = self.frame.inwards(points_world) / self.cell + shift
        return points

    def _price_sums(self, shape: tuple[int, int], reach: int) -> FloatArray:
        """Sums of the prices of each column before each row."""
        grid, floes = np.zeros(shape), self.world.movables
        if not len(floes):
            return np.zeros((shape[1], shape[0] + 1))
        corners = np.empty_like(floes.vertices)
        transform_outlines(floes.poses, floes.vertices, floes.offsets, corners)
        outlines = np.ascontiguousarray(self._to_cells(corners, reach))
        centres = np.ascontiguousarray(self._to_cells(floes.poses[:, :2], reach))
        prices = floe_prices(self.world, self.config, self.cell)
        radii = np.sqrt(prices.areas / np.pi) / self.cell
        add_floes(
            outlines,
            floes.offsets,
            centres,
            radii,
            prices.totals,
            self.config.exponent,
            prices.soft,
            grid,
        )
        return prefix_sums(grid)

    def _blocked_sums(self, shape: tuple[int, int], reach: int) -> FloatArray:
        parts = self.world.static.convex_parts
        if not parts:
            return np.zeros(0)
        vertices, offsets = flatten(parts)
        grid = np.zeros(shape)
        block(np.ascontiguousarray(self._to_cells(vertices, reach)), offsets, 0.8, grid)
        return prefix_sums(grid).ravel()

    def _planes(self) -> FloatArray:
        """The bounds of the world as half planes for the robot's origin [steps]."""
        x0, y0, x1, y1 = self.world.static.bounds
        normals = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
        offsets = np.array([x1, y1, -x0, -y0]) - self.side
        turned = normals @ self.frame.rotation
        turned[np.abs(turned) < 1e-12] = 0.0
        # n . (origin + rotation . step . (place - start)) <= offset
        room = (offsets - normals @ np.array([self.frame.x, self.frame.y])) / self.step
        room += turned @ np.array(self.start, dtype=np.float64) + 1e-9
        if not isinstance(self.world.goal, GoalDisc):  # a path is cut off at the line
            room[turned[:, 0] > 0.7] += np.inf
        kept = np.isfinite(room)
        planes: FloatArray = np.column_stack([turned, room])[kept]
        return planes

    def _goal(self) -> FloatArray:
        goal = self.world.navigation_goal
        row, column = self.start
        if isinstance(goal, GoalDisc):
            center = self.frame.inwards(goal.center[None])[0] / self.step
            inside = max(goal.radius - self.config.inset * self.world.robot.circumscribed_radius, 0)
            return np.array([1.0, row + center[0], column + center[1], inside / self.step])
        return np.array([0.0, row + self.ahead, 0.0, 0.0])

    def ways_in(self) -> list[tuple[int, FloatArray]]:
        """From the robot's heading to headings of the lattice: index, and rows of `ways`."""
        angles = self.motions.angles
        change = np.abs((angles - self.heading + np.pi) % (2.0 * np.pi) - np.pi)
        found = []
        for h in np.argsort(change, kind="stable")[:4]:
            rows = ways(self.heading, float(angles[h]), self.motions.config, 0.8)
            found.append((int(h), rows[:8]))
        return found
