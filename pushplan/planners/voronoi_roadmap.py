"""`Skeleton`: along the middle of the open water between the objects. A floor for ships."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import Delaunay, QhullError, cKDTree

from pushplan.compiled import kernel
from pushplan.control import PurePursuit
from pushplan.geometry import VisibilityGraph
from pushplan.geometry.obstacle_grid import ObstacleGrid, obstacle_grid, sees
from pushplan.geometry.obstacles import Obstacles, obstacles_of
from pushplan.motion.keep_out import keep_out
from pushplan.motion.polyline_plan import polyline_plan, polyline_status
from pushplan.motion.speed_profile import start_margin
from pushplan.motion.time_slicing import Stopped, go_on
from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.planners.following.replanning import Replanning
from pushplan.world import (
    GoalDisc,
    Planner,
    PlanResult,
    PlanStatus,
    Stop,
    World,
)
from pushplan.world.checks import BoolArray, FloatArray, IntArray, number
from pushplan.world.outline import flatten, next_corner
from pushplan.world.planning_call import PlanningCall

_MOST_SITES = 2000
"""Points on outlines at most, but for three on each, or one of more outlines than this.

Time and what cannot be interrupted, Qhull, grow with them."""
_LINES = 2000  # lines that are looked along between two looks at the stop rule
_SAME = 1e-6  # distance of corners of the diagram that differ by rounding only [R]


@dataclass(frozen=True)
class Skeleton:
    """Shortest path along the Voronoi diagram of the objects' and obstacles' outlines.

    A metre costs more where the water is narrower than the robot, in proportion to what is
    missing. The path is a polyline: it does not know how the robot turns, nor what the objects
    weigh. The skeleton planner that AUTO-IceNav (arXiv 2411.17155) is compared with works
    likewise on an image.

    Args:
        spacing: distance between points on outlines, and between poses of the plan [R]; points
            are farther apart where there are many outlines.
        narrow: price of a metre where there is no water at all, beside the metre itself.
    """

    spacing: float = 0.25
    narrow: float = 10.0

    def __post_init__(self) -> None:
        number("spacing", self.spacing, low=0.0, open_low=True)
        number("narrow", self.narrow, low=0.0)

    def plan(
        self, world: World, *, stop: Stop | None = None, rng: np.random.Generator | None = None
    ) -> PlanResult:
        """Plan from ``world``; exact and without chance, so ``rng`` is not needed.

        The stop rule is looked at between the steps of the diagram, the longest of which takes 5
        to 20 ms. Where the diagram leads nowhere, the shortest path around the walls is taken.

        The status is `PATH_ONLY` where the robot cannot drive the path as it stands.

        Raises:
            InvalidInputError: if the world's goal is not one for the robot.
        """
        call = PlanningCall(world, stop, rng)
        world = call.world
        try:
            status, points = self._path(world, call)
        except Stopped:
            status = call.stopped_status
            points = None
        if points is None:
            return call.result(status, iterations=1)
        plan = polyline_plan(world, points, self.spacing * world.robot.circumscribed_radius)
        return call.result(polyline_status(world, plan), plan, call.elapsed, 1)

    def _path(self, world: World, call: PlanningCall) -> tuple[PlanStatus, FloatArray | None]:
        """Corners of the path (N, 2) [m] from the robot to the goal.

        Raises:
            Stopped: if the stop rule fires.
        """
        if start_margin(world, 0.0) is None:
            return PlanStatus.START_BLOCKED, None
        start = world.robot_pose[:2]
        goal = world.navigation_goal
        if goal.distance(float(start[0]), float(start[1])) <= 0.0:
            return PlanStatus.SOLVED, start[None]

        def stopped() -> bool:
            return call.check(looks, math.inf)

        looks = 0
        go_on(stopped)
        looks = 1
        sites, owners = self._sites(world)
        if len(set(owners.tolist())) > 1:
            points = self._along(world, sites, owners, stopped)
            if points is not None:
                return PlanStatus.SOLVED, points
        graph = VisibilityGraph(keep_out(world), world.robot.inscribed_radius)
        direct = graph.to_goal(start, goal, stopped)
        if not np.isfinite(direct.length):
            go_on(stopped)
            return PlanStatus.GOAL_UNREACHABLE, None
        return PlanStatus.SOLVED, direct.points

    def _sites(self, world: World) -> tuple[FloatArray, IntArray]:
        """(S, 2) points on all outlines [m], and whose they are."""
        corners, counts = _outlines(world)
        if len(counts) == 0:
            return np.zeros((0, 2)), np.zeros(0, dtype=np.int64)
        ends = np.cumsum(counts)
        after = next_corner(np.concatenate([[0], ends]))
        edges = corners[after] - corners
        reached = np.cumsum(np.hypot(edges[:, 0], edges[:, 1]))
        around = np.diff(reached[ends - 1], prepend=0.0)
        spacing = max(self.spacing * world.robot.circumscribed_radius, around.sum() / _MOST_SITES)
        least = 3.0 if len(counts) <= _MOST_SITES else 1.0
        samples = np.maximum(np.ceil(around / spacing), least).astype(np.int64)
        owners = np.repeat(np.arange(len(counts)), samples)
        first = np.cumsum(samples) - samples
        fraction = (np.arange(len(owners)) - first[owners] + 0.5) / samples[owners]
        along = reached[ends[owners] - 1] - (1.0 - fraction) * around[owners]
        at = np.minimum(np.searchsorted(reached, along), ends[owners] - 1)
        left = (reached[at] - along) / np.maximum(np.hypot(edges[at, 0], edges[at, 1]), 1e-12)
        return corners[after[at]] - edges[at] * left[:, None], owners

    def _along(
        self, world: World, sites: FloatArray, owners: IntArray, stopped: Callable[[], bool]
    ) -> FloatArray | None:
        """The cheapest path along the diagram, None where it does not lead to the goal."""
        go_on(stopped)
        # about the robot, in units of its size: the same diagram wherever the world is
        start = world.robot_pose[:2]
        size = world.robot.circumscribed_radius
        sites = (sites - start) / size
        try:
            triangles = Delaunay(sites)
        except QhullError:
            return None  # all points on one line
        go_on(stopped)
        # its dual: corners of the diagram are circumcentres, and neighbours share a ridge
        corners = _circumcentres(sites[triangles.simplices])
        first, opposite = np.nonzero(triangles.neighbors > np.arange(len(corners))[:, None])
        ridges = np.column_stack([first, triangles.neighbors[first, opposite]])
        turn = np.array([[1, 2], [2, 0], [0, 1]])[opposite]
        between = owners[np.take_along_axis(triangles.simplices[first], turn, axis=1)]
        low, high = (world.static.bounds - np.tile(start, 2)).reshape(2, 2) / size
        inside: BoolArray = np.all((corners >= low) & (corners <= high), axis=1)
        corners[~inside] = low  # some are infinitely far; no ridge that stays leads to them
        ridges = ridges[(between[:, 0] != between[:, 1]) & inside[ridges].all(axis=1)]
        go_on(stopped)
        ridges = _merged(corners, ridges)
        if len(ridges) == 0:
            return None
        go_on(stopped)
        goal = world.navigation_goal
        vertices = np.concatenate([corners, np.zeros((1, 2))])
        # the robot enters the diagram by the nearest vertices
        known = np.unique(ridges)
        _, nearest = cKDTree(corners[known]).query(np.zeros(2), k=min(8, len(known)))
        entry = known[np.atleast_1d(nearest)]
        ways = np.column_stack([np.full(len(entry), len(vertices) - 1), entry])
        edges = np.concatenate([ridges, ways])
        walls = _Walls(world, stopped)
        places = start + size * vertices
        edges = edges[walls.are_clear(places[edges[:, 0]], places[edges[:, 1]])]
        half = max(world.robot.inscribed_radius / size, 0.1)
        clear = np.asarray(cKDTree(sites).query(vertices)[0])
        a = edges[:, 0]
        b = edges[:, 1]
        lengths = np.hypot(*(vertices[a] - vertices[b]).T)
        missing = np.maximum(1.0 - np.minimum(clear[a], clear[b]) / half, 0)
        costs = lengths * (1.0 + self.narrow * missing) + 1e-12
        go_on(stopped)
        graph = csr_matrix((costs, (a, b)), shape=(len(vertices), len(vertices)))
        table, previous = dijkstra(
            graph, directed=False, indices=[len(vertices) - 1], return_predecessors=True
        )
        best = table[0]
        before = previous[0]
        # the last stretch is straight ahead to the goal, and a little into it
        depth = 0.02 * size
        if isinstance(goal, GoalDisc):
            depth = min(depth, goal.radius)
            towards = goal.center - places
            away = np.hypot(*towards.T)
            gap = away - goal.radius
            towards /= np.maximum(away, 1e-12 * size)[:, None]
        else:
            gap = (goal.point - places) @ goal.normal
            towards = np.broadcast_to(goal.normal, places.shape)
        go_on(stopped)
        gap = np.maximum(gap, 0.0)
        ends = places + (gap + depth)[:, None] * towards
        best = np.where(np.isfinite(best) & walls.are_clear(places, ends), best, np.inf)
        total = best + gap / size * (1.0 + self.narrow * (gap > size))
        end = int(np.argmin(total))
        if not np.isfinite(total[end]):
            return None
        chain = [end]
        while before[chain[-1]] >= 0:
            chain.append(int(before[chain[-1]]))
        path = places[chain[::-1]]
        return np.concatenate([path, ends[end][None]])


class _Walls:
    """What the robot's inscribed disc may not touch."""

    def __init__(self, world: World, stopped: Callable[[], bool]) -> None:
        static = keep_out(world)
        clearance = (1.0 - 1e-6) * world.robot.inscribed_radius
        self._obstacles = obstacles_of(static, clearance)
        self._grid = obstacle_grid(static, clearance, 0.0)
        self._seen = np.zeros(len(self._obstacles.radii) + 1, dtype=np.int64)
        self._stopped = stopped

    def are_clear(self, a: FloatArray, b: FloatArray) -> BoolArray:
        """True if the lines from (N, 2) ``a`` to (N, 2) ``b`` keep clear of them.

        Raises:
            Stopped: if the stop rule fires.
        """
        clear = np.ones(len(a), dtype=np.bool_)
        for i in range(0, len(a) if len(self._seen) > 1 else 0, _LINES):
            go_on(self._stopped)
            part = slice(i, i + _LINES)
            _see(a[part], b[part], self._obstacles, self._grid, self._seen, clear[part])
        return clear


@kernel
def _see(
    a: FloatArray,
    b: FloatArray,
    obstacles: Obstacles,
    grid: ObstacleGrid,
    seen: IntArray,  # memory of `sees`
    clear: BoolArray,  # (N,) receives which lines keep clear
) -> None:
    for i in range(a.shape[0]):
        clear[i] = sees(a[i, 0], a[i, 1], b[i, 0], b[i, 1], obstacles, 0.0, grid, seen)


def _merged(corners: FloatArray, ridges: IntArray) -> IntArray:
    """Ridges (M, 2) between different corners: four sites on one circle make the same one twice."""
    known, named = np.unique(ridges, return_inverse=True)
    pairs = cKDTree(corners[known]).query_pairs(_SAME, output_type="ndarray")
    shape = (len(known), len(known))
    same = csr_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=shape)
    _, group = connected_components(same, directed=False)
    _, first = np.unique(group, return_index=True)
    merged: IntArray = known[first[group[named.reshape(-1, 2)]]]
    different: BoolArray = merged[:, 0] != merged[:, 1]
    return np.ascontiguousarray(merged[different])


def _circumcentres(triangles: FloatArray) -> FloatArray:
    """(T, 2) of triangles (T, 3, 2), not finite where one is flat."""
    u = triangles[:, 1] - triangles[:, 0]
    v = triangles[:, 2] - triangles[:, 0]
    uu = (u**2).sum(axis=1)
    vv = (v**2).sum(axis=1)
    twice = 2.0 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    away = np.column_stack([v[:, 1] * uu - u[:, 1] * vv, u[:, 0] * vv - v[:, 0] * uu])
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(triangles[:, 0] + away / twice[:, None])


def _outlines(world: World) -> tuple[FloatArray, IntArray]:
    """(V, 2) corners of all objects, then of all obstacles [m], and how many each has."""
    floes = world.movables
    (vertices, offsets) = flatten(keep_out(world).convex_parts)
    counts = np.concatenate([np.diff(floes.offsets), np.diff(offsets)])
    return np.concatenate([floes.vertices_world, vertices]), counts


def skeleton(planner: Planner | None = None, stop: Stop | None = None) -> PlanFollower:
    """Plans once along the open water and follows it."""
    return PlanFollower(
        planner or Skeleton(), PurePursuit(), replanning=Replanning(never=True), stop=stop
    )
