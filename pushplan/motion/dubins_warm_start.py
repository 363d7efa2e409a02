"""A warm start without a search: Dubins curves along the shortest path around the walls.

The shortest path of a disc around the walls bends at a few places. The robot is sent along the
tangents there, and from place to place on the shortest curve of bounded curvature (Dubins 1957).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from pushplan.core import motion as core
from pushplan.geometry import VisibilityGraph
from pushplan.motion.keep_out import keep_out
from pushplan.motion.local_windows import drive_in_windows
from pushplan.motion.path_improver import PathImprover
from pushplan.motion.path_search_config import EDGE, INSET
from pushplan.world import GoalDisc, NavigationGoal, World
from pushplan.world.checks import FloatArray

_FAR = 30.0
"""Edges of a tree in a straight line to the goal beyond which it is far."""
_SHARP = 0.8
"""Turn beyond which a bend is driven through its ends, not only through its middle [rad]."""
_WIDE = 1.25  # clearance of the first path [circumscribed radii]
_BEYOND_RADIUS = 1.02  # the same at least, so that curves around corners fit [turning radii]
_NARROW = 1.1  # clearance of the second path, where the first leads nowhere [circumscribed radii]


def is_far(improver: PathImprover) -> bool:
    """Return True if the goal is more edges of a tree away than one grows in some milliseconds."""
    away = improver.goal.distance(*improver.world.robot_pose[:2])
    return bool(away > _FAR * EDGE * improver.size)


def warm_start(improver: PathImprover) -> None:
    """Try to drive along the shortest homotopic path, objects or not; the improver keeps it."""
    size = improver.size
    depth = 1.01 * INSET * size
    if isinstance(improver.goal, GoalDisc):
        depth = improver.goal.radius - 0.99 * float(improver.room.goal[3])
    radius = improver.turning_radius
    wide = max(_WIDE * size, _BEYOND_RADIUS * radius)
    for clearance in (wide, _NARROW * size):
        if improver.stopped():
            return  # the contours alone take their time on a large map
        world = improver.world.moved(robot_pose=improver.lead.pose)
        vias = _guide(world, improver.goal, clearance, radius, depth, improver.stopped)
        if vias is None:
            continue
        curves = partial(_curves, radius=radius)
        arcs = curves(improver.lead.pose, vias)
        if improver.candidate(arcs, improver.jam_cost, free=False) is not None:
            return
        if is_far(improver) and drive_in_windows(improver, vias, curves):
            return


def warm_start_arcs(
    world: World,  # gives the start and the walls
    goal: NavigationGoal,
    clearance: float,  # of the shortest path [m]
    radius: float,  # least turning radius [m]
    depth: float,  # depth in the goal at which the arcs end [m]
    stopped: Callable[[], bool],  # ends the search of the path
) -> FloatArray | None:
    """Arcs along the shortest homotopic path; they may touch walls and objects.

    Returns:
        (E, 2) length [m] and curvature [1/m] of each arc, or None if there is no way.
    """
    vias = _guide(world, goal, clearance, radius, depth, stopped)
    return None if vias is None else _curves(world.robot_pose, vias, radius)


def _guide(
    world: World,
    goal: NavigationGoal,
    clearance: float,
    radius: float,
    depth: float,
    stopped: Callable[[], bool],
) -> FloatArray | None:
    """Poses (V, 3) along the shortest homotopic path, or None if there is no way."""
    start = world.robot_pose[:2]
    corners = VisibilityGraph(keep_out(world), clearance).to_goal(start, goal, stopped).points
    if len(corners) < 2:
        return None
    return _vias(corners, radius, depth)


def _curves(here: FloatArray, vias: FloatArray, radius: float) -> FloatArray:
    """(3 V, 2) arcs of the shortest curves from a pose (3,) through vias (V, 3)."""
    arcs = np.empty((3 * len(vias), 2))
    for i, there in enumerate(vias):
        core.dubins(here, there, radius, arcs[3 * i : 3 * i + 3])
        here = there
    return arcs


def _vias(corners: FloatArray, radius: float, depth: float) -> FloatArray:
    """Poses (V, 3) on a polyline: some at each bend, one ``depth`` [m] past its end."""
    legs = np.diff(corners, axis=0)
    lengths = np.hypot(legs[:, 0], legs[:, 1])
    keep = lengths > 1e-9 * radius
    if not keep.any():
        return np.zeros((0, 3))
    legs = legs[keep]
    lengths = lengths[keep]
    ends = corners[1:][keep]
    headings = np.unwrap(np.arctan2(legs[:, 1], legs[:, 0]))
    found = []
    first = 0
    for i in range(1, len(legs)):
        # the corners first .. i - 1 follow each other closely: they are one bend
        if lengths[i] < radius and i < len(legs) - 1:
            continue
        at = {(first + i - 1) // 2}
        if abs(headings[i] - headings[first]) > _SHARP:
            at |= {first, i - 1}
        for k in sorted(at):
            found.append([*ends[k], 0.5 * (headings[k] + headings[k + 1])])
        first = i
    last = headings[-1]
    found.append([*(ends[-1] + depth * np.array([np.cos(last), np.sin(last)])), last])
    return np.array(found)
