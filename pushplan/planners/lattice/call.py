"""One call of the ship lattice planner."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np

from pushplan.interaction import InteractionModel
from pushplan.planners.kinodynamic.collision import first_blocked, footprint, is_free, obstacles
from pushplan.planners.kinodynamic.dubins import along_arc, sample_pieces
from pushplan.planners.kinodynamic.improve import Path, goal_numbers, in_goal
from pushplan.planners.kinodynamic.timing import timed_plan, turning_radius
from pushplan.planners.lattice.astar import FOUND, PAUSED, AStar
from pushplan.planners.lattice.build import BuiltLattice, LatticeBuilder
from pushplan.planners.lattice.config import ShipLatticeConfig
from pushplan.planners.lattice.improve import Improver
from pushplan.planners.lattice.pose_lattice import bound_at, flat_runs, swath_sum, within
from pushplan.planners.lattice.swaths import sweep_cells
from pushplan.planners.lattice.sweeper import make_sweeper
from pushplan.world import GoalLine, Plan, PlanStatus, StopCheck, World
from pushplan.world.checks import FloatArray, IntArray


class ShipCall:
    """Lattice, search and improvement of one planning call.

    Args:
        world: the snapshot.
        config: parameters.
        interaction: predicts what a path does.
        check: armed stop rule, None for the planner's own budget.
        rng: for the repairs.
        began: when the call began, on the clock of `time.perf_counter`.
    """

    def __init__(
        self,
        world: World,
        config: ShipLatticeConfig,
        interaction: InteractionModel | None,
        check: StopCheck | None,
        rng: np.random.Generator,
        began: float,
    ) -> None:
        self.world, self.config, self.interaction = world, config, interaction
        self.check, self.rng, self.began = check, rng, began
        self.goal = world.navigation_goal
        self.size = world.robot.circumscribed_radius
        self.iterations = self.expanded = self.repairs = 0
        self.lattice_cost = math.inf
        self.first_solution_s = float("nan")
        self.built: BuiltLattice | None = None
        self.side = 0.0
        self.improver: Improver | None = None
        self.cost = math.inf
        self.poses: FloatArray = np.zeros((0, 3))
        self.curvatures: FloatArray = np.zeros(0)

    def run(self) -> PlanStatus | None:
        """Plan until done or stopped; None where there is no plan by then."""
        world = self.world
        shape, walls = footprint(world.robot), obstacles(world.static)
        if not is_free(world.robot_pose, shape, walls, np.empty_like(shape.vertices)):
            return PlanStatus.START_BLOCKED
        if self.goal.distance(*(float(v) for v in world.robot_pose[:2])) <= 0.0:
            self.poses, self.curvatures = world.robot_pose[None].copy(), np.zeros(1)
            self.first_solution_s = time.perf_counter() - self.began
            return PlanStatus.SOLVED
        for share, side in self._limits():
            found = self._search(self.config.first_look(), share, side)
            if found is None:
                return None
            if found:
                self._improve(share, side)
                assert self.built is not None
                return PlanStatus.SOLVED if self.built.arrives else PlanStatus.APPROXIMATE
        return PlanStatus.GOAL_UNREACHABLE

    def _limits(self) -> list[tuple[float, float]]:
        """Shares of the turn rate and distances from the bounds [m] to try, one after the other."""
        share, side = self.config.turn_share, self.config.side * 2.0 * self._beam()
        nearer = [(share, part * side) for part in (1.0, 0.8, 0.6, 0.4, 0.2, 0.0)]
        return [*nearer, (1.0, 0.0)]

    def _beam(self) -> float:
        return self.world.robot.inscribed_radius

    def stopped(self, cost: float = math.inf) -> bool:
        """Whether the stop rule fires now."""
        return self.check is not None and self.check(self.iterations, cost)

    def _search(self, config: ShipLatticeConfig, turn_share: float, side: float) -> bool | None:
        """Whether a path was found; None if stopped before."""
        radius = turning_radius(self.world.robot, turn_share)
        builder = LatticeBuilder(self.world, config, radius=radius, side=side)
        if not builder.fits():
            return None
        if self.stopped(self.cost):
            return None
        built = builder.build()
        star, starts = open_search(built, builder)
        while True:
            result = star.run(config.batch)
            self.iterations += 1
            if result != PAUSED:
                break
            if self.stopped(self.cost):
                return None
        self.expanded += star.expanded
        if result != FOUND:
            return None if builder.clipped else False  # there may be a way elsewhere
        poses, curvatures = lay_path(built, path_arcs(built, star, starts), self.world, config)
        self.side = side
        if not self._free(poses):
            return False
        if self.built is None:
            self.built, self.lattice_cost = built, star.cost
            self.first_solution_s = time.perf_counter() - self.began
            self.poses, self.curvatures = poses, curvatures
            self.cost = self.world.robot.mass * star.cost
        else:
            self._consider(poses, curvatures)
        return True

    def _free(self, poses: FloatArray) -> bool:
        """Whether a path keeps clear of walls, and its origin from the bounds but those ahead."""
        world = self.world
        low, high = world.static.bounds[:2] + self.side, world.static.bounds[2:] - self.side
        if isinstance(self.goal, GoalLine):
            high = np.where(self.goal.normal > 0.7, world.static.bounds[2:], high)
            low = np.where(self.goal.normal < -0.7, world.static.bounds[:2], low)
        start = world.robot_pose[:2]
        low, high = np.minimum(low, start), np.maximum(high, start)
        shape, walls = footprint(world.robot), obstacles(world.static)
        walls = walls._replace(
            bounds=np.concatenate([low - 1e-6 * self.size, high + 1e-6 * self.size])
        )
        scratch = np.empty_like(shape.vertices)
        return bool(first_blocked(poses, len(poses), shape, walls, scratch) == len(poses))

    def _improve(self, turn_share: float, side: float) -> None:
        """Sweep the path, look at others, and change the best at random."""
        config, world = self.config, self.world
        assert self.built is not None
        point, normal = self.built.finish(world)
        radius = turning_radius(world.robot, turn_share)
        numbers = [radius, config.spacing * self.size, 0.6 * self.size, 2.5, 0.15]
        self.improver = Improver(
            make_sweeper(world, self.interaction),
            np.ascontiguousarray(world.movables.poses),
            world.movables.masses,
            robot_mass=world.robot.mass,
            weight=config.push_weight,
            numbers=np.array(numbers),
            goal=np.concatenate([point, normal]),
            ahead=config.sweep_ahead * self.size,
            stopped=lambda: self.stopped(self.cost),
            free=self._free,
        )
        self._consider(self.poses, self.curvatures)
        for weight, crowding in config.alternatives:
            if self.stopped(self.cost) or len(world.movables) == 0:
                return
            other = replace(
                config,
                push_weight=weight * config.push_weight,
                crowding=crowding * config.crowding,
                inflation=1.0,
            )
            self._search(other, turn_share, side)
        if self.improver.best is None or not isinstance(self.goal, GoalLine):
            return
        if config.refinement and not self.stopped(self.cost):
            self._refine(radius)
        while self.repairs < config.repairs and self.improver.best.works[-1] > 0.0:
            if self.stopped(self.cost):
                return
            self.improver.repair(self.rng)
            self.repairs += 1
            self.iterations += 1
            self.cost = self.improver.best.cost

    def _refine(self, radius: float) -> None:
        """Optimise the best path in continuous space; it is kept if the sweep says it is better."""
        from pushplan.planners.lattice.continuous import price_field, refine

        assert self.built is not None and self.improver is not None
        assert self.improver.best is not None
        built, lattice, best = self.built, self.built.lattice, self.improver.best
        cell = lattice.step / lattice.cells
        hull = max(1, round(2.0 * self.world.robot.inscribed_radius / cell))
        row, column, heading = built.start
        origin = lattice.corner + np.array([row, column]) * lattice.cells
        field = price_field(
            lattice.price_sums, lattice.stride, lattice.cells, cell, hull, origin.astype(np.float64)
        )
        across = built.frame.inwards(best.poses[:, :2])[:, 1]
        reach = 2.0 * self.size
        arcs = refine(
            field,
            np.column_stack([np.diff(best.lengths), best.bends[1:]]),
            heading,
            radius=radius,
            goal=(lattice.goal[1] - row) * lattice.step,
            sides=(float(across.min()) - reach, float(across.max()) + reach),
            iterations=self.config.refinement,
        )
        self.iterations += 1
        if arcs is not None:
            poses, curvatures = lay_path(built, arcs, self.world, self.config)
            if self._free(poses):
                self._consider(poses, curvatures)

    def _consider(self, poses: FloatArray, curvatures: FloatArray) -> None:
        assert self.improver is not None
        if self.improver.consider(poses, curvatures) and self.improver.best is not None:
            self.cost = self.improver.best.cost

    def plan(self) -> Plan:
        """The best path as a plan, with the prediction of what it does as far as there is one."""
        best = None if self.improver is None else self.improver.best
        if best is None:
            return timed_plan(
                self.world, bare_path(self.poses, self.curvatures), self.config.turn_share
            )
        missing = len(best.poses) - len(best.objects)
        objects = np.concatenate([best.objects, np.repeat(best.objects[-1:], missing, axis=0)])
        works = np.concatenate([best.works, np.repeat(best.works[-1:], missing)])
        path = Path(best.poses, best.bends, objects, best.lengths, works)
        return timed_plan(self.world, path, self.config.turn_share)


def bare_path(poses: FloatArray, curvatures: FloatArray) -> Path:
    """A path about which nothing is predicted."""
    moves = np.diff(poses[:, :2], axis=0)
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(moves[:, 0], moves[:, 1]))])
    return Path(poses, curvatures, None, lengths, np.zeros(len(poses)))  # type: ignore[arg-type]


def open_search(built: BuiltLattice, builder: LatticeBuilder) -> tuple[AStar, list[FloatArray]]:
    """A search from the robot: from its node, or from where short curves lead to.

    Returns:
        The search, and for start edge -2 - i the (3, 2) arcs [steps] of curve i.
    """
    lattice, motions = built.lattice, built.motions
    branching = int(np.diff(motions.first).max())
    star = AStar(lattice, built.size, branching)
    row, column, heading = built.start
    turns = np.abs((motions.angles - heading + np.pi) % (2.0 * np.pi) - np.pi)
    nearest = int(np.argmin(turns))
    if turns[nearest] < 1e-6:
        node = built.node(nearest, row, column)
        star.start(node, bound=float(bound_at(lattice, node)))
        return star, []
    robot = builder.world.robot
    vertices = robot.vertices / builder.cell
    reach = robot.circumscribed_radius / builder.cell
    curves: list[FloatArray] = []
    for h, rows in builder.ways_in():
        for way in rows:
            to_row, to_column = row + round(way[1]), column + round(way[2])
            if not (0 <= to_row < lattice.rows and 0 <= to_column < lattice.columns):
                continue
            pieces = way[3:].reshape(3, 2)
            box = np.array([min(way[1], 0), max(way[1], 0), min(way[2], 0), max(way[2], 0)])
            if not within(lattice.planes, row, column, box):
                continue
            arcs = pieces * np.array([lattice.cells, 1.0 / lattice.cells])
            runs = sweep_cells(heading, arcs, vertices, robot.offsets, reach, 1.0)
            cost = way[0] * lattice.step + _cells_cost(built, runs, row, column)
            node = built.node(h, to_row, to_column)
            curves.append(pieces)
            if np.isfinite(cost):
                bound = float(bound_at(lattice, node))
                star.start(node, cost=cost, bound=bound, edge=-1 - len(curves))
    return star, curves


def _cells_cost(built: BuiltLattice, runs: IntArray, row: int, column: int) -> float:
    lattice = built.lattice
    cell = lattice.corner + np.array([row, column]) * lattice.cells
    at = int(cell[1] * lattice.stride + cell[0])
    flat = flat_runs(runs, lattice.stride)
    low, high = at + int(flat.min(initial=0)), at + int(flat.max(initial=0))
    if low < 0 or high >= len(lattice.price_sums):
        return math.inf  # a curve that leaves the map
    if len(lattice.blocked_sums) and swath_sum(lattice.blocked_sums, flat, 0, len(flat), at) > 0.5:
        return math.inf
    return float(swath_sum(lattice.price_sums, flat, 0, len(flat), at))


def path_arcs(built: BuiltLattice, star: AStar, curves: list[FloatArray]) -> FloatArray:
    """(E, 2) length [m] and curvature [1/m] of the arcs of the path that was found."""
    _, edges = star.path()
    parts = []
    for edge in edges.tolist():
        if edge >= 0:
            parts.append(built.motions.pieces[edge])
        elif edge < -1:
            parts.append(curves[-2 - edge])
    scale = np.array([built.lattice.step, 1.0 / built.lattice.step])
    return np.concatenate(parts) * scale if parts else np.zeros((0, 2))


def lay_path(
    built: BuiltLattice, arcs: FloatArray, world: World, config: ShipLatticeConfig
) -> tuple[FloatArray, FloatArray]:
    """(N, 3) poses along arcs from the robot, and the (N,) curvatures that lead to them [1/m].

    The path is cut off where it reaches the goal, or the goal row of a lattice that ends before.
    """
    size = world.robot.circumscribed_radius
    spacing = config.spacing * size
    room = int(arcs[:, 0].sum() / spacing + np.abs(arcs[:, 0] * arcs[:, 1]).sum() / 0.1)
    poses, bends = np.empty((room + 2 * len(arcs) + 8, 3)), np.zeros(room + 2 * len(arcs) + 8)
    poses[0] = world.robot_pose
    count = 1 + sample_pieces(world.robot_pose, arcs, spacing, poses[1:], bends[1:])
    poses, bends = poses[:count], bends[:count]
    goal = world.navigation_goal
    if isinstance(goal, GoalLine):
        point, normal = built.finish(world)
        inside = np.flatnonzero((poses[:, :2] - point) @ normal >= -1e-9)
    else:
        numbers = goal_numbers(goal, config.inset * size)
        inside = np.array([i for i in range(count) if in_goal(poses[i, 0], poses[i, 1], numbers)])
    end = int(inside[0]) + 1 if len(inside) else count
    poses, bends = poses[:end].copy(), bends[:end].copy()
    if isinstance(goal, GoalLine) and len(inside) and end > 1:
        cut_at_line(poses[-2], float(bends[-1]), spacing, point, normal, poses[-1])
    return poses, bends


def cut_at_line(
    before: FloatArray,
    bend: float,
    spacing: float,
    point: FloatArray,
    normal: FloatArray,
    out: FloatArray,
) -> None:
    """Put the pose where an arc from ``before`` crosses a line into ``out`` (3,), by bisection."""
    low, high = 0.0, spacing
    for _ in range(50):
        middle = 0.5 * (low + high)
        along_arc(before, middle, bend, out)
        if float((out[:2] - point) @ normal) < 0.0:
            low = middle
        else:
            high = middle
    along_arc(before, high, bend, out)
