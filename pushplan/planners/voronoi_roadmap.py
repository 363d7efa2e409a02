"""`Skeleton`: along the middle of the open water between objects. A reference for ships."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import networkx as nx
import numpy as np
import shapely
from scipy.spatial import QhullError, Voronoi, cKDTree

from pushplan.control import PurePursuit
from pushplan.geometry import VisibilityGraph
from pushplan.motion.keep_out import keep_out
from pushplan.motion.polyline_plan import polyline_result
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
from pushplan.world.outline import next_corner
from pushplan.world.planning_call import PlanningCall

_MOST_SITES = 2000
"""Points on outlines at most, but for three on each, or one of more outlines than this.

Time and what cannot be interrupted, Qhull, grow with them."""
_ENTRIES = 8  # corners of the diagram, the nearest ones, from which the robot may choose
_LINES = 500  # lines that are looked along between two looks at the stop rule


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
        narrow: cost of a metre where there is no water at all, beside the metre itself.
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

        The stop rule is looked at between the steps of the diagram, the longest of which takes 10
        to 50 ms. Where the diagram leads nowhere, the shortest path around the walls is taken.

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
        return polyline_result(call, points, self.spacing, 1)

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
        origin = world.robot_pose[:2]
        size = world.robot.circumscribed_radius
        sites = (sites - origin) / size
        try:
            diagram = Voronoi(sites)
        except QhullError:
            return None  # all points on one line
        go_on(stopped)
        corners = diagram.vertices
        low, high = (world.static.bounds.reshape(2, 2) - origin) / size
        inside = np.append(((corners >= low) & (corners <= high)).all(axis=1), False)
        ridges = np.array(diagram.ridge_vertices)  # -1 stands for a corner infinitely far away
        between = owners[diagram.ridge_points]
        ridges = ridges[(between[:, 0] != between[:, 1]) & inside[ridges].all(axis=1)]
        if len(ridges) == 0:
            return None
        # the robot enters the diagram by the nearest corners
        used = np.unique(ridges)
        start = len(corners)
        nearest = cKDTree(corners[used]).query(np.zeros((1, 2)), k=min(_ENTRIES, len(used)))[1]
        nearest = np.atleast_1d(nearest.squeeze())
        entries = np.column_stack([np.full(len(nearest), start), used[nearest]])
        edges = np.concatenate([ridges, entries])
        corners = np.concatenate([corners, np.zeros((1, 2))])
        places = origin + size * corners
        is_clear = _clear_of_walls(world, stopped)
        edges = edges[is_clear(places[edges[:, 0]], places[edges[:, 1]])]
        go_on(stopped)
        half = max(world.robot.inscribed_radius / size, 0.1)
        room = np.asarray(cKDTree(sites).query(corners)[0])
        a = edges[:, 0]
        b = edges[:, 1]
        lengths = np.hypot(*(corners[a] - corners[b]).T)
        missing = np.maximum(1.0 - np.minimum(room[a], room[b]) / half, 0.0)
        costs = lengths * (1.0 + self.narrow * missing)
        roadmap = nx.Graph()
        roadmap.add_weighted_edges_from(zip(a.tolist(), b.tolist(), costs.tolist(), strict=True))
        go_on(stopped)
        if start not in roadmap:
            return None
        before, lengths_to = nx.dijkstra_predecessor_and_distance(roadmap, start)
        go_on(stopped)
        # the last stretch is straight ahead to the goal, and a little into it
        nodes = np.array(list(lengths_to))
        gaps, ends = _last_stretches(world, places[nodes])
        total = np.array(list(lengths_to.values()))
        total += gaps / size * (1.0 + self.narrow * (gaps > size))
        for some in np.array_split(np.argsort(total, kind="stable"), math.ceil(len(nodes) / 50)):
            clear = some[is_clear(places[nodes[some]], ends[some])]
            if len(clear):
                chain = [int(nodes[clear[0]])]
                while before[chain[-1]]:
                    chain.append(before[chain[-1]][0])
                return np.concatenate([places[chain[::-1]], ends[clear[0]][None]])
        return None


def _last_stretches(world: World, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distances (N,) from places (N, 2) to the goal, and where they end, a little into it [m]."""
    goal = world.navigation_goal
    depth = 0.02 * world.robot.circumscribed_radius
    if isinstance(goal, GoalDisc):
        depth = min(depth, goal.radius)
        towards = goal.center - places
        away = np.hypot(*towards.T)
        gaps = away - goal.radius
        towards /= np.maximum(away, 1e-12)[:, None]
    else:
        gaps = (goal.point - places) @ goal.normal
        towards = np.broadcast_to(goal.normal, places.shape)
    gaps = np.maximum(gaps, 0.0)
    return gaps, places + (gaps + depth)[:, None] * towards


def _clear_of_walls(
    world: World, stopped: Callable[[], bool]
) -> Callable[[FloatArray, FloatArray], BoolArray]:
    """A function of the ends (N, 2) of lines [m]: True where the inscribed disc can go along.

    It raises `Stopped` if the stop rule fires.
    """
    walls = shapely.STRtree([shapely.Polygon(part) for part in keep_out(world).convex_parts])
    clearance = (1.0 - 1e-6) * world.robot.inscribed_radius

    def is_clear(a: FloatArray, b: FloatArray) -> BoolArray:
        clear = np.ones(len(a), dtype=np.bool_)
        lines = shapely.linestrings(np.stack([a, b], axis=1))
        for first in range(0, len(a), _LINES):
            go_on(stopped)
            part = lines[first : first + _LINES]
            near, _ = walls.query(part, predicate="dwithin", distance=clearance)
            clear[first + near] = False
        return clear

    return is_clear


def _outlines(world: World) -> tuple[FloatArray, IntArray]:
    """(V, 2) corners of all objects, then of all obstacles [m], and how many each has."""
    floes = world.movables
    vertices, offsets = keep_out(world).packed
    counts = np.concatenate([np.diff(floes.part_offsets), np.diff(offsets)])
    return np.concatenate([floes.part_vertices_world, vertices]), counts


def skeleton(planner: Planner | None = None, stop: Stop | None = None) -> PlanFollower:
    """Plans once along the open water and follows it."""
    return PlanFollower(
        planner or Skeleton(), PurePursuit(), replanning=Replanning(never=True), stop=stop
    )
