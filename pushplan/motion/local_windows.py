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
from pushplan.motion.dubins_warm_start import along_guide, curves_through, guides, is_far, is_way
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
_STRAIGHT = 2.0  # distance behind a window to the next bend [turning radii]


@dataclass(frozen=True)
class _FirstPlanWithin(Stop):
    """Return with the first plan, or with the call that the window serves."""

    stopped: Callable[[], bool]
    iterations: int

    def start(self) -> Callable[[int, float], bool]:
        return lambda done, cost: cost < np.inf or done >= self.iterations or self.stopped()


@dataclass(frozen=True)
class _Way:
    """A path that begins as it will stay, and goes on in curves along the rest of a guide."""

    path: SweptPath
    count: int  # its poses
    known: int  # poses up to which it stays, and the objects are known
    vias: FloatArray  # (V, 3) poses along the rest of the guide
    bends: FloatArray  # (V,) lengths at which they are reached [m]


def warm_start(improver: PathImprover) -> None:
    """Try to drive along the shortest homotopic path, objects or not; the improver keeps it.

    Where the curves along it fail and the goal is far, windows are searched.
    """
    for vias in guides(improver):
        if is_way(improver, vias) or (is_far(improver) and _drive_in_windows(improver, vias)):
            return


def _drive_in_windows(improver: PathImprover, vias: FloatArray) -> bool:
    """Follow a guide, with searches in windows where that fails; True where it leads to a plan."""
    head, count = improver.laid_out(improver.lead.pieces)
    head.objects[0] = improver.world.movables.poses
    way = _along_vias(improver, _Way(head, count, 1, vias, np.zeros(0)))
    reached = 0.0
    level = 0
    for _ in range(_WINDOWS):
        fault, cost = _first_fault(improver, way)
        if fault == way.count:
            improver.keep(way.path, way.count, cost)
            return True
        along = arc_lengths(way.path.poses[: way.count, :2])
        if along[fault] > reached + improver.size:
            level = 0
            reached = float(along[fault])
        other = None
        while other is None:
            if level == len(_LEVELS) or improver.stopped():
                return False
            other = _with_window(improver, way, along, fault, _LEVELS[level])
            level += 1
        way = _along_vias(improver, other)
    return False


def _along_vias(improver: PathImprover, way: _Way) -> _Way:
    """A path that goes on through its vias."""
    end = way.path.poses[way.count - 1]
    arcs = curves_through(way.vias, end, improver.turning_radius)
    tail, count = improver.laid_out(arcs, end)
    path = _joined(way.path, way.count, tail, count)
    begun = arc_lengths(way.path.poses[: way.count, :2])[-1]
    bends = begun + np.cumsum(np.abs(arcs[:, 0]))[2::3]
    return _Way(path, way.count + count - 1, way.known, way.vias, bends)


def _joined(head: SweptPath, first: int, tail: SweptPath, last: int) -> SweptPath:
    """The first poses of a path, and those of one that begins where they end."""
    whole = make_swept_path(first + last - 1, head.objects.shape[1])
    for part, before, after in zip(whole, head, tail, strict=True):
        part[:first] = before[:first]
        if part is not whole.objects:  # of the tail they are not known
            part[first:] = after[1:last]
    return whole


def _first_fault(improver: PathImprover, way: _Way) -> tuple[int, float]:
    """The first pose at which the robot touches a wall or jams, and the cost up to there.

    The objects are known before it. Where there is none it is the number of poses; then the cost is
    that of the whole path [kg m].
    """
    path = way.path
    blocked = improver.first_blocked(path, way.count, way.known)
    cost = improver.sweep(path, blocked, improver.jam_cost, way.known)
    if cost is not None:
        return blocked, cost
    jams = path.lengths[:blocked] * improver.world.robot.mass >= improver.jam_cost
    return int(np.argmax(jams)), np.inf


def _with_window(
    improver: PathImprover, way: _Way, along: FloatArray, fault: int, reach: float
) -> _Way | None:
    """A path with another way around a fault, which ends where that does."""
    path = way.path
    size = improver.size
    first = max(int(np.searchsorted(along, along[fault] - reach * size, side="right")) - 1, 0)
    objects = improver.world.movables.moved_to(path.objects[first])
    last = _end_of(improver, way, int(np.searchsorted(along, along[fault] + reach * size)), objects)
    is_last = last == way.count - 1
    goal = improver.goal if is_last else GoalDisc(path.poses[last, :2], _GOAL * size)
    places = path.poses[first : last + 1, :2]
    wide = (_MARGIN + reach) * size
    box = np.concatenate([places.min(axis=0) - wide, places.max(axis=0) + wide])
    found = _search(improver, _cropped(improver.world, path.poses[first], objects, goal, box))
    if found is None:
        return None
    left = way.bends > along[last] + _STRAIGHT * improver.turning_radius
    left[-1:] = True
    if is_last:
        left[:] = False
    joined = _joined(path, first + 1, found, len(found.poses))
    count = first + len(found.poses)
    return _Way(joined, count, first + 1, way.vias[left], way.bends[left])


def _end_of(improver: PathImprover, way: _Way, first: int, objects: Movables) -> int:
    """The first pose from some pose on at which there is room for the robot."""
    room = _ROOM * improver.size
    for n in range(first, way.count - 1):
        x, y = way.path.poses[n, :2].tolist()
        away = np.hypot(objects.poses[:, 0] - x, objects.poses[:, 1] - y) - objects.radii
        if (away > room).all() and improver.room.walls.can_turn(x, y, room):
            return n
    return way.count - 1


def _cropped(
    world: World, pose: FloatArray, objects: Movables, goal: NavigationGoal, box: FloatArray
) -> World:
    """What there is of a world in a box."""
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
