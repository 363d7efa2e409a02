"""`Skeleton`: along the middle of the open water between the objects. A floor for ships."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import QhullError, Voronoi, cKDTree

from pushplan.control import PurePursuit
from pushplan.geometry import VisibilityGraph
from pushplan.planners.kinodynamic.timing import start_margin
from pushplan.planners.policy import PlanFollower
from pushplan.planners.polyline import polyline_plan
from pushplan.planners.replanning import Replanning
from pushplan.world import (
    GoalDisc,
    Planner,
    PlanResult,
    PlanStats,
    PlanStatus,
    Stop,
    StopCheck,
    World,
)
from pushplan.world.checks import BoolArray, FloatArray, IntArray, number
from pushplan.world.outline import transform


@dataclass(frozen=True)
class Skeleton:
    """Shortest path along the Voronoi diagram of the objects' and obstacles' outlines.

    A metre costs more where the water is narrower than the robot, in proportion to what is
    missing. The path is a polyline: it does not know how the robot turns, nor what the objects
    weigh. The skeleton planner that AUTO-IceNav (arXiv 2411.17155) is compared with works
    likewise on an image.

    Args:
        spacing: distance between points on outlines, and between poses of the plan [R].
        narrow: price of a metre where there is no water at all, beside the metre itself.
    """

    spacing: float = 0.25
    narrow: float = 10.0

    def __post_init__(self) -> None:
        number("spacing", self.spacing, low=0.0, open_low=True)
        number("narrow", self.narrow, low=0.0)

    def plan(
        self,
        world: World,
        *,
        stop: Stop | None = None,
        rng: np.random.Generator | None = None,
    ) -> PlanResult:
        """Plan from ``world``; exact and without chance, so ``rng`` is not needed.

        The stop rule is looked at before the diagram is made, which cannot be interrupted: 5 to
        30 ms for some hundred objects.

        Raises:
            InvalidInputError: if the world's goal is not one for the robot.
        """
        began = time.perf_counter()
        check = None if stop is None else stop.start()
        status, points = self._path(world, check)
        if stop is not None and stop.cancelled:
            status, points = PlanStatus.CANCELLED, None
        plan = None
        if points is not None:
            plan = polyline_plan(world, points, self.spacing * world.robot.circumscribed_radius)
        wall = time.perf_counter() - began
        first = wall if plan is not None else float("nan")
        return PlanResult(status, plan, PlanStats(wall, first_solution_s=first, iterations=1))

    def _path(self, world: World, check: StopCheck | None) -> tuple[PlanStatus, FloatArray | None]:
        """Corners of the path (N, 2) [m] from the robot to the goal."""
        if start_margin(world, 0.0) is None:
            return PlanStatus.START_BLOCKED, None
        start = world.robot_pose[:2]
        goal = world.navigation_goal
        if goal.distance(float(start[0]), float(start[1])) <= 0.0:
            return PlanStatus.SOLVED, start[None]
        direct = VisibilityGraph(world.static, world.robot.inscribed_radius).to_goal(start, goal)
        if not np.isfinite(direct.length):
            return PlanStatus.GOAL_UNREACHABLE, None
        if check is not None and check(0, math.inf):
            return PlanStatus.TIMED_OUT, None
        sites, owners = self._sites(world)
        points = self._along(world, sites, owners) if len(set(owners.tolist())) > 1 else None
        return PlanStatus.SOLVED, direct.points if points is None else points

    def _sites(self, world: World) -> tuple[FloatArray, IntArray]:
        """(S, 2) points on all outlines [m], and whose they are."""
        spacing = self.spacing * world.robot.circumscribed_radius
        floes = world.movables
        outlines = [transform(floes.poses[k], floes.outline(k)) for k in range(len(floes))]
        outlines += list(world.static.convex_parts)
        points, owners = [np.zeros((0, 2))], [np.zeros(0, dtype=np.int64)]
        for owner, outline in enumerate(outlines):
            edges = np.roll(outline, -1, axis=0) - outline
            counts = np.maximum(np.ceil(np.hypot(edges[:, 0], edges[:, 1]) / spacing), 1.0)
            counts = np.minimum(counts, 1000.0).astype(np.int64)
            which = np.repeat(np.arange(len(outline)), counts)
            share = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
            points.append(outline[which] + edges[which] * (share / counts[which])[:, None])
            owners.append(np.full(len(which), owner))
        return np.concatenate(points), np.concatenate(owners)

    def _along(self, world: World, sites: FloatArray, owners: IntArray) -> FloatArray | None:
        """The cheapest path along the diagram, None where it does not lead to the goal."""
        try:
            diagram = Voronoi(sites)
        except QhullError:
            return None  # all points on one line
        ridges = np.array(diagram.ridge_vertices)
        between = owners[diagram.ridge_points]
        low, high = world.static.bounds[:2], world.static.bounds[2:]
        corners: FloatArray = np.asarray(diagram.vertices, dtype=np.float64)
        inside: BoolArray = np.all((corners >= low) & (corners <= high), axis=1)
        ridges = ridges[(ridges >= 0).all(axis=1) & (between[:, 0] != between[:, 1])]
        ridges = ridges[inside[ridges].all(axis=1)]
        if len(ridges) == 0:
            return None
        goal, start = world.navigation_goal, world.robot_pose[:2]
        vertices = np.concatenate([corners, start[None]])
        # the robot enters the diagram by the nearest vertices
        known = np.unique(ridges)
        _, nearest = cKDTree(corners[known]).query(start, k=min(8, len(known)))
        entry = known[np.atleast_1d(nearest)]
        ways = np.column_stack([np.full(len(entry), len(vertices) - 1), entry])
        edges = np.concatenate([ridges, ways])
        clear = np.asarray(cKDTree(sites).query(vertices)[0])
        a, b = edges[:, 0], edges[:, 1]
        lengths = np.hypot(*(vertices[a] - vertices[b]).T)
        missing = np.maximum(1.0 - np.minimum(clear[a], clear[b]) / world.robot.inscribed_radius, 0)
        costs = lengths * (1.0 + self.narrow * missing) + 1e-12
        graph = csr_matrix((costs, (a, b)), shape=(len(vertices), len(vertices)))
        table, previous = dijkstra(
            graph, directed=False, indices=[len(vertices) - 1], return_predecessors=True
        )
        best, before = table[0], previous[0]
        # the last stretch is straight ahead to the goal
        if isinstance(goal, GoalDisc):
            gap = np.hypot(*(vertices - goal.center).T) - goal.radius
            towards = goal.center - vertices
            towards /= np.maximum(np.hypot(*towards.T), 1e-12)[:, None]
        else:
            gap = (goal.point - vertices) @ goal.normal
            towards = np.broadcast_to(goal.normal, vertices.shape)
        gap = np.maximum(gap, 0.0)
        size = world.robot.circumscribed_radius
        total = best + gap * (1.0 + self.narrow * (gap > size))
        end = int(np.argmin(total))
        if not np.isfinite(total[end]):
            return None
        chain = [end]
        while before[chain[-1]] >= 0:
            chain.append(int(before[chain[-1]]))
        path = vertices[chain[::-1]]
        last = path[-1] + (gap[end] + 0.02 * size) * towards[end]
        return np.concatenate([path, last[None]])


def skeleton(planner: Planner | None = None, stop: Stop | None = None) -> PlanFollower:
    """Plans once along the open water and follows it."""
    return PlanFollower(
        planner or Skeleton(), PurePursuit(), replanning=Replanning(never=True), stop=stop
    )
