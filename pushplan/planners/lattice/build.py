"""From a world to a `PoseLattice`: the map, the primitives, the goal and the bounds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pushplan.planners.lattice.config import ShipLatticeConfig
from pushplan.planners.lattice.cost_map import add_crowding, add_floes, block, prefix_sums
from pushplan.planners.lattice.floes import floe_prices, world_outlines
from pushplan.planners.lattice.frame import Frame
from pushplan.planners.lattice.heuristic import covering_bounds, row_bounds
from pushplan.planners.lattice.pose_lattice import PoseLattice, flat_runs
from pushplan.planners.lattice.primitives import PrimitiveConfig, PrimitiveSet, primitives, ways
from pushplan.planners.lattice.swaths import swaths
from pushplan.world import GoalDisc, World
from pushplan.world.checks import FloatArray
from pushplan.world.outline import flatten

_MOST_NODES = 3_000_000


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
        self.cell = self.step / config.cells_per_step
        self.motions = primitives(
            PrimitiveConfig(config.headings, ratio, config.variants, config.shifts)
        )
        self.frame = Frame.towards_goal(world)
        self.heading = self.frame.heading(float(world.robot_pose[2]))
        self._lay_out()

    def _lay_out(self) -> None:
        """How many rows and columns there are, and where the robot and the goal are."""
        world, step = self.world, self.step
        goal = world.navigation_goal
        size = world.robot.circumscribed_radius
        away = goal.distance(*(float(v) for v in world.robot_pose[:2]))
        horizon = self.config.horizon * size
        self.arrives = away <= horizon or isinstance(goal, GoalDisc)
        self.ahead = min(away + self.config.inset * size, horizon) / step  # [steps]
        # the ends of a primitive may lie beyond the line, and behind the robot where it turns
        beyond = int(np.ceil(self.motions.lengths.max())) + 1
        behind = beyond if abs(self.heading) > 1.0 or isinstance(goal, GoalDisc) else 1
        behind += int(np.ceil(2.0 * self.radius / step)) if abs(self.heading) > 1.5 else 0
        corners = world.static.bounds[[[0, 1], [2, 1], [2, 3], [0, 3]]]
        box = self.frame.inwards(corners) / step
        far = self.ahead + beyond + behind
        low, high = box.min(axis=0), box.max(axis=0)
        behind = int(min(behind, max(np.ceil(-low[0]), 0)))
        if not isinstance(goal, GoalDisc):  # no farther beyond the line than the bounds allow
            room = float(high[0]) - self.side / step if self.arrives else np.inf
            self.ahead = min(self.ahead, max(room, away / step))
        rows_ahead = int(np.ceil(self.ahead)) + beyond
        if isinstance(goal, GoalDisc):  # the way around walls may lead anywhere
            behind, rows_ahead = int(np.ceil(max(-low[0], 0))), int(np.ceil(max(high[0], 0)))
            far, self.ahead = float(np.abs(box).max()), away / step
        left = int(min(np.ceil(max(-low[1], 0.0)), far))
        right = int(min(np.ceil(max(high[1], 0.0)), far))
        self.clipped = (behind + rows_ahead) * (left + right) * self.config.headings > _MOST_NODES
        if self.clipped:  # a small robot in a large hall: look only near the straight way
            room = int(max(np.ceil(0.3 * self.ahead), 20))
            behind, left, right = min(behind, room), min(left, room), min(right, room)
            rows_ahead = min(rows_ahead, int(np.ceil(self.ahead)) + room)
        self.rows, self.columns = behind + rows_ahead + 1, left + right + 1
        self.start = (behind, left)

    def fits(self) -> bool:
        """Whether the lattice is of a size that can be searched."""
        return self.rows * self.columns * self.config.headings <= 4 * _MOST_NODES

    def build(self) -> BuiltLattice:
        """The lattice."""
        robot, cells, step = self.world.robot, self.config.cells_per_step, self.step
        hull = int(np.ceil(robot.circumscribed_radius / self.cell)) + 2
        # no swath leaves the map: curves into the lattice bulge by less than a step more
        reach = hull + (self.motions.bulge + 1) * cells
        corner = np.array([reach, reach], dtype=np.int64)
        shape = (
            (self.rows - 1) * cells + 2 * reach + 1,
            (self.columns - 1) * cells + 2 * reach + 1,
        )
        grid = self._price_map(shape, reach)
        covered = swaths(self.motions, robot.vertices / step, robot.offsets, cells)
        goal = self._goal()
        places = np.arange(self.rows, dtype=np.float64) * cells + reach
        window = int(np.floor(2.0 * robot.inscribed_radius / self.cell)) - 1
        edge = (reach, reach + (self.columns - 1) * cells)
        goal_cell = int(reach + (self.start[0] + self.ahead) * cells)
        least = covering_bounds(grid, places, goal_cell, window, hull, edge)
        rows = np.arange(self.rows, dtype=np.float64)
        bounds = row_bounds(
            self.motions.angles, rows, self.start[0] + self.ahead, step, self.radius, least
        )
        lattice = PoseLattice(
            rows=self.rows,
            columns=self.columns,
            step=step,
            cells=cells,
            corner=corner,
            first=self.motions.first,
            ends=self.motions.ends,
            lengths=self.motions.lengths * step,
            boxes=self.motions.boxes,
            run_first=covered.first,
            runs=flat_runs(covered.runs, shape[0] + 1),
            price_sums=prefix_sums(grid).ravel(),
            blocked_sums=self._blocked_sums(shape, reach),
            stride=shape[0] + 1,
            planes=self._planes(),
            goal=goal,
            row_bounds=self.config.inflation * bounds,
        )
        start = (*self.start, self.heading)
        return BuiltLattice(lattice, self.frame, self.motions, start, self.arrives)

    def _to_cells(self, points_world: FloatArray, reach: int) -> FloatArray:
        """(N, 2) points of the world as rows and columns of the map."""
        shift = np.array(self.start) * self.config.cells_per_step + reach
        points: FloatArray = self.frame.inwards(points_world) / self.cell + shift
        return points

    def _price_map(self, shape: tuple[int, int], reach: int) -> FloatArray:
        grid = np.zeros(shape)
        floes = self.world.movables
        if not len(floes):
            return grid
        corners = world_outlines(floes.vertices, floes.offsets, floes.poses)
        outlines = np.ascontiguousarray(self._to_cells(corners, reach))
        centres = np.ascontiguousarray(self._to_cells(floes.poses[:, :2], reach))
        prices = floe_prices(self.world, self.config, self.cell)
        radii = np.sqrt(prices.areas / np.pi) / self.cell
        exponent = self.config.exponent
        add_floes(
            outlines, floes.offsets, centres, radii, prices.totals, exponent, prices.soft, grid
        )
        if prices.crowding > 0.0:
            covered = np.zeros(shape)
            areas = prices.areas / self.cell**2
            add_floes(outlines, floes.offsets, centres, radii, areas, 0.0, 0.0, covered)
            beam = 2.0 * self.world.robot.inscribed_radius
            spread = self.config.crowding_spread * beam / self.cell
            factor = prices.crowding * self.cell**2
            add_crowding(covered, self.config.cells_per_step, spread, factor, grid)
        return grid

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
