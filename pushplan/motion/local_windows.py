"""Local windows: a long way is driven along a guide, and searched only where that fails.

A tree over a whole office finds nothing in reasonable time. Where the curves along the guide touch
a wall, or jam an object, a tree is grown in a window of some robot lengths around the place alone,
and the way goes on from where that ends.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pushplan.core import motion as core
from pushplan.motion.dubins_warm_start import along_guide, curves_through, guides, is_far, is_way
from pushplan.motion.path_improver import PathImprover
from pushplan.motion.random_tree.tree_paths import TreePaths
from pushplan.motion.swept_path import SweptPath, make_swept_path
from pushplan.world import GoalDisc, Movables, NavigationGoal, StaticMap, Stop, World
from pushplan.world.checks import FloatArray
from pushplan.world.outline import flatten, outline_boxes
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
    """Poses that are fixed so far, and curves along the rest of the guide."""

    path: SweptPath
    count: int
    fixed: int  # poses that are
    bends: FloatArray  # (V,) length at which each of the last vias is reached [m]


def warm_start(improver: PathImprover) -> None:
    """Try to drive along the shortest homotopic path, objects or not; the improver keeps it.

    Where the curves along it fail and the goal is far, windows are searched.
    """
    for vias in guides(improver):
        if is_way(improver, vias) or (is_far(improver) and _drive_in_windows(improver, vias)):
            return


def _drive_in_windows(
    improver: PathImprover,
    vias: FloatArray,  # (V, 3) poses along the guide, the last in the goal
) -> bool:
    """Follow a guide, with searches in windows where that fails; True where it leads to a plan."""
    head, fixed = improver.laid_out(improver.lead.pieces)
    way = _continued(improver, head, fixed, vias)
    reached = 0.0
    level = 0
    for _ in range(_WINDOWS):
        fault = _first_fault(improver, way)
        if fault is None:
            return improver.swept(way.path, way.count, improver.jam_cost) is not None
        along = arc_lengths(way.path.poses[: way.count, :2])
        if along[fault] > reached + improver.size:
            level = 0
            reached = float(along[fault])
        while level < len(_LEVELS):
            if improver.stopped():
                return False
            found = _window(improver, way, along, fault, _LEVELS[level])
            level += 1
            if found is None:
                continue
            (path, count), end = found
            left = way.bends > along[end] + _STRAIGHT * improver.turning_radius
            left[-1] = True
            if end == way.count - 1:
                left[:] = False
            way = _continued(improver, path, count, vias[len(vias) - len(left) :][left])
            vias = vias[len(vias) - len(left) :][left]
            break
        else:
            return False
    return False


def _continued(
    improver: PathImprover,
    head: SweptPath,
    fixed: int,
    vias: FloatArray,
) -> _Way:
    """The first poses of a path, and curves along vias behind them."""
    arcs = curves_through(vias, head.poses[fixed - 1], improver.turning_radius)
    tail, count = improver.laid_out(arcs, head.poses[fixed - 1])
    path = _joined(improver, (head, 0, fixed), (tail, 1, count))
    begun = arc_lengths(head.poses[:fixed, :2])[-1]
    bends = begun + np.cumsum(np.abs(arcs[:, 0]))[2::3]
    return _Way(path, fixed + count - 1, fixed, bends)


def _joined(improver: PathImprover, *pieces: tuple[SweptPath, int, int]) -> SweptPath:
    """Poses first to last of some paths as one, with room for shortcuts."""
    count = sum(last - first for _, first, last in pieces)
    path = make_swept_path(3 * count + 200, len(improver.world.movables))
    at = 0
    for piece, first, last in pieces:
        path.poses[at : at + last - first] = piece.poses[first:last]
        path.curvatures[at : at + last - first] = piece.curvatures[first:last]
        at += last - first
    path.objects[0] = improver.world.movables.poses
    return path


def _first_fault(improver: PathImprover, way: _Way) -> int | None:
    """The first pose at which the robot touches a wall or jams; objects are known up to there."""
    path = way.path
    blocked = improver.first_blocked(path, way.count)
    jam_length = improver.jam_cost / improver.world.robot.mass
    core.sweep_cost(
        path.view(), 0, blocked, improver.jam_cost, 2**62, improver.problem, improver.contacts
    )
    jams = np.flatnonzero(path.lengths[:blocked] >= jam_length)
    if len(jams):
        return int(jams[0])
    return blocked if blocked < way.count else None


def _window(
    improver: PathImprover, way: _Way, along: FloatArray, fault: int, reach: float
) -> tuple[tuple[SweptPath, int], int] | None:
    """The path with another way around a place, and the old pose at which that ends."""
    size = improver.size
    path = way.path
    first = int(np.searchsorted(along, along[fault] - reach * size, side="right")) - 1
    first = max(first, 0)
    objects = improver.world.movables.moved_to(path.objects[first])
    last = _end(improver, way, along, along[fault] + reach * size, objects)
    goal: NavigationGoal = improver.goal
    if last < way.count - 1:
        goal = GoalDisc(path.poses[last, :2], _GOAL * size)
    places = path.poses[first : last + 1, :2]
    if last < way.count - 1:
        places = path.poses[first : last + 1, :2]
    wide = (_MARGIN + reach) * size
    box = np.concatenate([places.min(axis=0) - wide, places.max(axis=0) + wide])
    world = _cropped(improver.world, path.poses[first], objects, goal, box)
    found = _search(improver, world)
    if found is None:
        return None
    joined = _joined(improver, (path, 0, first + 1), (found, 1, len(found.poses)))
    return (joined, first + len(found.poses)), last


def _end(
    improver: PathImprover, way: _Way, along: FloatArray, least: float, objects: Movables
) -> int:
    """The first pose from a length [m] on at which there is room for the robot."""
    size = improver.size
    poses = way.path.poses[: way.count]
    for n in range(int(np.searchsorted(along, least)), way.count - 1):
        x, y = poses[n, :2].tolist()
        away = np.hypot(*(objects.poses[:, :2] - (x, y)).T) - objects.radii
        if (away > _ROOM * size).all() and improver.room.walls.can_turn(x, y, _ROOM * size):
            return n
    return way.count - 1


def _cropped(
    world: World, pose: FloatArray, objects: Movables, goal: NavigationGoal, box: FloatArray
) -> World:
    """What there is of a world in a box."""
    static = world.static
    box = np.concatenate(
        [np.maximum(box[:2], static.bounds[:2]), np.minimum(box[2:], static.bounds[2:])]
    )
    boxes = outline_boxes(*flatten(static.convex_parts))
    near = ((boxes[:, 2:] >= box[:2]) & (boxes[:, :2] <= box[2:])).all(axis=1)
    count = len(static.polygons)
    polygons = tuple(static.polygons[k] for k in np.flatnonzero(near[:count]))
    lines = near[count:]
    cropped = StaticMap(polygons, static.segments[lines], static.radii[lines], box)
    radii = objects.radii
    reached = (
        (objects.poses[:, :2] + radii[:, None] >= box[:2])
        & (objects.poses[:, :2] - radii[:, None] <= box[2:])
    ).all(axis=1)
    return replace(
        world, robot_pose=pose, static=cropped, movables=objects.select(reached), goal=goal
    )


def _search(outer: PathImprover, world: World) -> SweptPath | None:
    """The first path in a window."""
    stop = _FirstPlanWithin(outer.stopped, _ITERATIONS)
    call = PlanningCall(world, stop, outer.rng)
    improver = PathImprover(call, outer.config, outer.interaction, outer.turning_radius)
    trees = TreePaths(improver)
    if improver.begin() is None:
        trees.look_ahead()
        solved = along_guide(improver, around=True) or along_guide(improver)
        while not solved and not improver.stopped():
            for _ in trees.grow_two(outer.config.push_weight):
                break
            if improver.solved or trees.sealed or trees.boxed_in:
                break
            trees.change_start()
            trees.relax()
    outer.iterations += improver.iterations
    return improver.best if improver.solved else None
