"""`TreePaths`: paths of random trees around a coarse path, one tree after the other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pushplan.core import motion as core
from pushplan.geometry import VisibilityGraph
from pushplan.motion.coarse_path import coarse_path, reachable
from pushplan.motion.collision import footprint, obstacles
from pushplan.motion.keep_out import keep_out
from pushplan.motion.path_improver import Candidate, PathImprover
from pushplan.motion.path_search_config import EDGE
from pushplan.motion.polyline_plan import polyline_plan
from pushplan.motion.random_tree.kinodynamic_tree import TreeGrowth, TreeLimits
from pushplan.motion.room_ahead import gets_away, is_boxed_in
from pushplan.motion.speed_profile import TIGHTEST
from pushplan.motion.start_turn import drive_to_turn, start_turn
from pushplan.world import Drive, GoalDisc
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import path_length

_COARSE_PATH_FRACTION = 0.8  # of the targets, that are near the coarse path at first
_COARSE_PATH_SPREAD = 0.5  # standard deviation of those about it [R]
_AVOID_ITERATIONS = 200  # of the tree that takes objects as obstacles
_TREE_ITERATIONS = 1500  # of the tree that may push them
_BACKWARD = 2.0  # greatest distance that a car may go back at first [turning radii]
_EDGES = 30
"""Edges along a coarse path up to which a tree gets its budget; in proportion more beyond."""
_BLOCK = 128  # targets that are drawn at once, as a draw of few takes as long
_HEADING_SPREAD = 0.4  # standard deviation of headings about the coarse path [rad]


class TreePaths:
    """Grows trees for a `PathImprover`, which keeps the clock and the best path."""

    def __init__(
        self,
        improver: PathImprover,  # of this planning call
    ) -> None:
        self._improver = improver
        self._fraction = _COARSE_PATH_FRACTION
        self._exact: FloatArray | None = None
        self.trees = 0
        self.sealed = False
        """True if certainly no path leads to the goal."""
        self.boxed_in = False
        """True if the robot cannot even get away from where it stands."""

    def relax(self) -> None:
        """Look farther from the coarse path, as the way out may be the other way."""
        self._fraction *= 0.5
        self._improver.relax()

    def look_ahead(self) -> None:
        """Change the start at once where no forward arc leads away from it."""
        improver = self._improver
        if improver.world.robot.can_stop and not self._gets_away():
            self.change_start()

    def _gets_away(self) -> bool:
        improver = self._improver
        return gets_away(improver.room, improver.lead.pose, improver.size, improver.turning_radius)

    def change_start(self) -> None:
        """Begin in another way, after what was tried has failed.

        A differential drive begins with a turn on the spot and without it, in turns; where neither
        leads on and it can reverse, with a drive to where it can turn about. A car that can reverse
        may do so, by two turning radii and twice as far each time. The first time it is found out
        whether the robot is `boxed_in`.
        """
        improver = self._improver
        robot = self._improver.world.robot
        turned = len(improver.lead.pieces) > 0
        improver.begin_with(None if turned else start_turn(improver))
        if not robot.can_stop:
            return
        if robot.min_speed < 0.0 and robot.drive is Drive.CAR:
            improver.backward = max(2.0 * improver.backward, _BACKWARD * robot.turning_radius)
        elif robot.min_speed < 0.0 and not self._gets_away():
            improver.begin_with(drive_to_turn(improver) or improver.lead)
        if not improver.relaxed and not robot.slides:
            tightest = max(robot.turning_radius, TIGHTEST * improver.size)
            bare = improver.room._replace(footprint=footprint(robot))
            pose = improver.world.robot_pose
            self.boxed_in = is_boxed_in(robot, bare, pose, tightest, improver.stopped)

    def grow_two(self, push_weight: float) -> Iterator[Candidate]:
        """Paths of two trees, around the objects and among them, until the stop rule fires."""
        for weight, budget in (
            (np.inf, _AVOID_ITERATIONS),
            (push_weight, _TREE_ITERATIONS),
        ):
            if self._improver.stopped():
                return
            candidate = self.grow(weight, budget)
            if candidate is not None:
                yield candidate

    def grow(
        self,
        push_weight: float,  # of the coarse path; infinite treats objects as obstacles
        budget: int,
    ) -> Candidate | None:
        """The path of a new tree."""
        improver = self._improver
        world = self._improver.world
        room = self._improver.room
        size = improver.size
        self.trees += 1
        improver.iterations += 1
        among = room.walls
        shape = room.footprint
        if np.isinf(push_weight):
            among = self._among
            if not core.CollisionChecker(shape, among).is_free(improver.lead.pose):
                return None  # the robot touches an object already: only pushing helps
        coarse = coarse_path(world, push_weight, improver.stopped)
        if improver.stopped():
            return None
        if len(coarse) == 0:
            if self._exact is None:
                sealed = not reachable(improver.given, improver.stopped)
                if improver.stopped():
                    return None
                self.sealed = sealed
                if sealed:
                    return None
                self._exact = self._around_walls()
            coarse = self._exact
        edges = path_length(coarse) / (EDGE * size)
        last = improver.iterations + int(budget * max(1.0, edges / _EDGES))

        def done() -> bool:
            improver.iterations += 1
            return improver.iterations >= last or improver.stopped()

        limits = TreeLimits(
            max_curvature=1.0 / improver.turning_radius,
            edge_length=EDGE * size,
            spacing=room.spacing,
            turn_weight=0.5 * size,
            backward=improver.backward,
        )
        spread = _COARSE_PATH_SPREAD * size
        bounds = world.static.bounds
        targets = Targets(coarse, self._fraction, spread, bounds, improver.rng)
        goal = improver.goal
        if isinstance(goal, GoalDisc) and improver.pose_goal is not None:
            goal = GoalDisc(goal.center, size)  # the end of its path is made anew
        growth = TreeGrowth(improver.lead.pose, goal, targets, limits, bounds, shape, among)
        arcs = growth.grow(int(improver.rng.integers(1, 2**31)), done, improver.stopped)
        if arcs is None:
            return None
        improver.nodes += len(arcs)
        return improver.candidate(arcs)

    @cached_property
    def _among(self) -> core.ConvexObstacles:
        """Walls and objects, where they are at first."""
        world = self._improver.world
        return obstacles(keep_out(world), world.movables.every_part_world)

    def _around_walls(self) -> FloatArray:
        """A path around the walls alone, where the coarse grid misses a narrow passage."""
        world = self._improver.world
        graph = VisibilityGraph(keep_out(world), world.robot.inscribed_radius)
        start = world.robot_pose[:2]
        improver = self._improver
        corners = graph.to_goal(start, improver.goal, improver.stopped).points
        if len(corners) == 0:
            return world.robot_pose[None, :2]
        return polyline_plan(world, corners, self._improver.size).poses[:, :2]


@dataclass(eq=False)
class Targets:
    """Draws the poses that a tree grows towards."""

    coarse: FloatArray  # (N, 2) coarse path to the goal [m]
    fraction: float  # of the targets that are near it; the others are uniform
    spread: float  # standard deviation of those about it [m]
    bounds: FloatArray  # (4,) of the workspace
    rng: np.random.Generator

    def __post_init__(self) -> None:
        coarse = self.coarse
        index = np.arange(len(self.coarse))
        ahead = coarse[np.minimum(index + 3, len(coarse) - 1)]
        behind = coarse[np.maximum(index - 3, 0)]
        self.headings = np.arctan2(ahead[:, 1] - behind[:, 1], ahead[:, 0] - behind[:, 0])
        self.block = np.empty((0, 3))
        self.used = 0

    def __call__(self) -> FloatArray:
        """The next target (3,)."""
        if self.used == len(self.block):
            self.block = self._draw(_BLOCK)
            self.used = 0
        self.used += 1
        target: FloatArray = self.block[self.used - 1]
        return target

    def _draw(self, count: int) -> FloatArray:
        rng = self.rng
        bounds = self.bounds
        near = rng.random(count) < self.fraction
        index = rng.integers(len(self.coarse), size=count)
        offsets = rng.standard_normal((count, 3)) * [self.spread, self.spread, _HEADING_SPREAD]
        coarsed = np.column_stack([self.coarse[index], self.headings[index]]) + offsets
        spread = rng.random((count, 3))
        low = [*bounds[:2], -np.pi]
        high = [*bounds[2:], np.pi]
        uniform = low + spread * (np.asarray(high) - low)
        return np.where(near[:, None], coarsed, uniform)
