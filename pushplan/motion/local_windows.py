"""Local windows: a long way is driven along a guide, and searched only where that fails.

A tree over a whole office finds nothing in reasonable time. Where the curves along the guide touch
a wall, or jam an object, a tree is grown in a window of some robot lengths around the place alone,
and the way goes on from where that ends.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pushplan.geometry.obstacles import obstacles_of
from pushplan.motion.dubins_warm_start import (
    ARCS,
    along_guide,
    curves_through,
    guides,
    is_far,
    is_way,
)
from pushplan.motion.path_improver import PathImprover
from pushplan.motion.random_tree.tree_paths import TreePaths
from pushplan.motion.swept_path import SweptPath, make_swept_path
from pushplan.world import GoalDisc, Movables, NavigationGoal, StaticMap, Stop, World
from pushplan.world.checks import BoolArray, FloatArray
from pushplan.world.planning_call import PlanningCall
from pushplan.world.polyline import arc_lengths

_LEVELS = (4.0, 8.0, 16.0)
"""Lengths of the way before and behind the place that a window replaces, one after the other [R].
"""
_MARGIN = 6.0  # of a window around what it replaces, at the first level [R]
_ROOM = 1.1  # clearance where a window ends [R]
_GOAL = 0.5  # radius of its goal [R]
_WINDOWS = 60  # windows along one guide at most
_ITERATIONS = 2_000  # of the search in one window at most
_STRAIGHT = 2.0  # distance behind a window to the next via [turning radii]


@dataclass(frozen=True)
class _FirstPlanWithin(Stop):
    """Return with the first plan, or with the call that the window serves."""

    stopped: Callable[[int], bool]  # asked with the iterations of the window
    iterations: int

    def start(self) -> Callable[[int, float], bool]:
        return lambda done, cost: cost < np.inf or done >= self.iterations or self.stopped(done)


def warm_start(improver: PathImprover) -> None:
    """Try to drive along the shortest homotopic path, objects or not; the improver keeps it.

    Where the curves along it fail and the goal is far, windows are searched. What is found of a way
    to a far goal is shortcut at once, as trees are slow to find better ones.
    """
    far = is_far(improver)
    for vias in guides(improver):
        if is_way(improver, vias) or (far and _GuidedDrive(improver, vias).run()):
            break
    if far and improver.solved:
        improver.work_out_best()


class _GuidedDrive:
    """A path that begins as it will stay, and goes on in curves along the rest of a guide."""

    def __init__(self, improver: PathImprover, vias: FloatArray) -> None:
        self._improver = improver
        self._vias = vias  # (V, 3) poses along the rest of the guide
        self._bends = np.zeros(0)  # (V,) lengths at which they are reached [m]
        self._path = make_swept_path(0, len(improver.world.movables))
        self._count = 0
        self._known = 1  # poses up to which the path stays, and the objects are known
        self._append(*improver.laid_out(improver.lead.pieces))
        self._path.objects[0] = improver.world.movables.poses

    def run(self) -> bool:
        """Search windows where the curves fail; True where that leads to a plan."""
        improver = self._improver
        self._follow_guide()
        reached = 0.0
        level = 0
        for _ in range(_WINDOWS):
            fault, cost = self._first_fault()
            if improver.stopped():
                return False
            if fault == self._count:
                return self._arrives(cost)
            along = arc_lengths(self._path.poses[: self._count, :2])
            if along[fault] > reached + improver.size:
                level = 0
                reached = float(along[fault])
            found = False
            while not found:
                if level == len(_LEVELS) or improver.stopped():
                    return False
                found = self._search_around(fault, along, _LEVELS[level])
                level += 1
            self._follow_guide()
        return False

    def _arrives(self, cost: float) -> bool:
        """Keep the path, with the heading of the goal at its end; True if that is a plan."""
        improver = self._improver
        ended = improver.ended(self._path, self._count)
        if ended is None:
            return False
        path, count = ended
        if not (improver.pose_goal or improver.goal).reached_by(path.poses[count - 1]):
            return False
        if path is not self._path:
            found = improver.sweep(path, count, improver.jam_cost)
            cost = np.inf if found is None else found
        improver.keep(path, count, cost)
        return improver.solved

    def _append(self, tail: SweptPath, count: int, first: int = 0) -> None:
        """Add poses ``first`` to ``count`` of a path, of which objects are not known."""
        whole = self._count + count - first
        if whole > len(self._path.poses):
            larger = make_swept_path(2 * whole, len(self._improver.world.movables))
            for ours, before in zip(larger, self._path, strict=True):
                ours[: self._count] = before[: self._count]
            self._path = larger
        self._path.poses[self._count : whole] = tail.poses[first:count]
        self._path.curvatures[self._count : whole] = tail.curvatures[first:count]
        self._count = whole

    def _follow_guide(self) -> None:
        """Go on through the vias."""
        end = self._path.poses[self._count - 1]
        begun = arc_lengths(self._path.poses[: self._count, :2])[-1]
        arcs = curves_through(self._improver, self._vias, end)
        self._append(*self._improver.laid_out(arcs, end), 1)
        self._bends = begun + np.cumsum(np.abs(arcs[:, 0]))[ARCS - 1 :: ARCS]

    def _first_fault(self) -> tuple[int, float]:
        """The first pose at which the robot touches a wall or jams, and the cost up to there.

        The objects are known before it. Where there is none it is the number of poses; then the
        cost is that of the whole path [kg m].
        """
        improver = self._improver
        path = self._path
        blocked = improver.first_blocked(path, self._count, self._known)
        cost = improver.sweep(path, blocked, improver.jam_cost, self._known)
        if cost is not None:
            return blocked, cost
        jams = path.lengths[:blocked] * improver.world.robot.mass >= improver.jam_cost
        return int(np.argmax(jams)), np.inf

    def _search_around(self, fault: int, along: FloatArray, reach: float) -> bool:
        """Cut the path before a fault, and go on with another way to behind it if there is one."""
        path = self._path
        improver = self._improver
        size = improver.size
        before, behind = along[fault] + np.array([-reach, reach]) * size
        first = max(int(np.searchsorted(along, before, side="right")) - 1, 0)
        objects = improver.world.movables.moved_to(path.objects[first])
        last = self._end_from(int(np.searchsorted(along, behind)), objects)
        is_last = last == self._count - 1
        goal: NavigationGoal = GoalDisc(path.poses[last, :2], _GOAL * size)
        if is_last:
            goal = improver.goal
        places = path.poses[first : last + 1, :2]
        wide = (_MARGIN + reach) * size
        box = np.concatenate([places.min(axis=0) - wide, places.max(axis=0) + wide])
        found = _search(improver, _cropped(improver.world, path.poses[first], objects, goal, box))
        if found is None:
            return False
        self._count = self._known = first + 1
        self._append(found, len(found.poses), 1)
        left = self._bends > along[last] + _STRAIGHT * improver.turning_radius
        left[-1:] = True
        self._vias = self._vias[left & (not is_last)]
        return True

    def _end_from(self, first: int, objects: Movables) -> int:
        """The first pose from some pose on at which there is room for the robot."""
        room = _ROOM * self._improver.size
        for n in range(first, self._count - 1):
            x, y = self._path.poses[n, :2].tolist()
            away = np.hypot(objects.poses[:, 0] - x, objects.poses[:, 1] - y) - objects.radii
            if (away > room).all() and self._improver.room.walls.can_turn(x, y, room):
                return n
        return self._count - 1


def _cropped(
    world: World, pose: FloatArray, objects: Movables, goal: NavigationGoal, box: FloatArray
) -> World:
    """The part of a world that lies in a box."""
    static = world.static
    low = np.maximum(box[:2], static.bounds[:2])
    high = np.minimum(box[2:], static.bounds[2:])
    near = _meets(obstacles_of(static).boxes, low, high)
    count = len(static.polygons)
    cropped = StaticMap(
        tuple(static.polygons[k] for k in np.flatnonzero(near[:count])),
        static.segments[near[count:]],
        static.radii[near[count:]],
        np.concatenate([low, high]),
    )
    places = objects.poses[:, :2]
    reach = objects.radii[:, None]
    reached = _meets(np.hstack([places - reach, places + reach]), low, high)
    movables = objects.select(reached)
    return replace(world, robot_pose=pose, static=cropped, movables=movables, goal=goal)


def _meets(boxes: FloatArray, low: FloatArray, high: FloatArray) -> BoolArray:
    """(N,) True for the boxes (N, 4) that reach into the box from ``low`` to ``high``."""
    meets: BoolArray = np.all((boxes[:, 2:] >= low) & (boxes[:, :2] <= high), axis=1)
    return meets


def _search(outer: PathImprover, world: World) -> SweptPath | None:
    """The first path in a window."""
    call = PlanningCall(world, _FirstPlanWithin(outer.stopped, _ITERATIONS), outer.rng)
    improver = PathImprover(call, outer.config, outer.interaction, outer.turning_radius)
    trees = TreePaths(improver)
    if improver.begin() is None:
        trees.look_ahead()
        solved = along_guide(improver, around=True) or along_guide(improver)
        while not solved and not improver.stopped() and not (trees.sealed or trees.boxed_in):
            solved = next(trees.grow_two(outer.config.push_weight), None) is not None
            trees.change_start()
            trees.relax()
    outer.iterations += improver.iterations
    return improver.best if improver.solved else None
