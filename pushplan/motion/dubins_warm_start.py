"""A warm start without a search: Dubins curves along the shortest path around the walls.

The shortest path of a disc around the walls bends at a few places. The robot is sent along the
tangents there, and from place to place on the shortest curve of bounded curvature (Dubins 1957;
Reeds and Shepp 1990 for cars that may reverse).
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from pushplan.core import motion as core
from pushplan.geometry import VisibilityGraph
from pushplan.interaction import QuasiStatic
from pushplan.interaction.compiled_model import compile_interaction
from pushplan.motion.keep_out import keep_out
from pushplan.motion.path_improver import PathImprover
from pushplan.motion.path_search_config import EDGE, INSET
from pushplan.motion.speed_profile import TIGHTEST
from pushplan.world import GoalDisc
from pushplan.world.checks import FloatArray

ARCS = 5
"""Arcs of a shortest curve; those that it does not need have no length."""
_FAR = 30.0
"""Edges of a tree in a straight line to the goal beyond which it is far."""
_SHARP = 0.8
"""Turn beyond which a bend is driven through its ends, not only through its middle [rad]."""
_WIDE = 1.25  # clearance of the first path [circumscribed radii]
_BEYOND_RADIUS = 1.02  # the same at least, so that curves around corners fit [turning radii]
_PATIENCE = 20  # times the usual rounds of the contact solver
_NARROW = 1.1  # clearance of the second path, where the first leads nowhere [circumscribed radii]


def is_far(improver: PathImprover) -> bool:
    """Return True if the goal is more edges of a tree away than one grows in some milliseconds."""
    away = improver.goal.distance(*improver.world.robot_pose[:2])
    return bool(away > _FAR * EDGE * improver.size)


def along_guide(improver: PathImprover, *, around: bool = False) -> bool:
    """Try to drive along the shortest homotopic path; the improver keeps it.

    Args:
        improver: of this planning call.
        around: True for a path around the objects, False for one that takes no notice of them.

    Returns:
        True if that is a path without a jam.
    """
    return any(is_way(improver, vias) for vias in guides(improver, around=around))


def set_aside_drive(improver: PathImprover) -> None:
    """Set aside a drive along the shortest path through all objects, for want of another plan.

    The contact solver runs so long that only a wall can hold an overlap that it leaves: in a crowd,
    or where objects overlap at the start, its usual rounds end before they are apart.
    """
    model = improver.interaction
    if isinstance(model, QuasiStatic):
        patient = replace(model, iterations=_PATIENCE * model.iterations)
        other = copy.copy(improver)
        other.contacts = compile_interaction(patient, improver.world)
        if along_guide(other):
            improver.spare = other


def is_way(improver: PathImprover, vias: FloatArray) -> bool:
    """Return True if curves through vias (V, 3) are a path without a jam; the improver keeps it."""
    if improver.world.robot.slides:
        return improver.slides(vias[:, :2])
    return improver.drives(curves_through(improver, vias, improver.lead.pose))


def guides(improver: PathImprover, *, around: bool = False) -> Iterator[FloatArray]:
    """Poses (V, 3) along the shortest homotopic path, wide of the walls and then near to them."""
    size = improver.size
    goal = improver.goal
    depth = 1.01 * INSET * size
    if isinstance(goal, GoalDisc):
        depth = goal.radius - 0.99 * float(improver.room.goal[3])
    radius = improver.turning_radius
    if improver.world.robot.slides:
        radius = TIGHTEST * size  # it may follow every corner
    wide = max(_WIDE * size, _BEYOND_RADIUS * radius)
    for clearance in (wide, _NARROW * size):
        if improver.stopped():
            return  # the contours alone take their time on a large map
        world = improver.world.moved(robot_pose=improver.lead.pose)
        if around:
            world = world.believing(np.ones(len(world.movables), bool)).with_fixed_as_static()
        graph = VisibilityGraph(keep_out(world), clearance)
        corners = graph.to_goal(world.robot_pose[:2], goal, improver.stopped).points
        if len(corners) >= 2:
            yield _vias(corners, radius, depth)


def curves_through(improver: PathImprover, vias: FloatArray, start: FloatArray) -> FloatArray:
    """(5 V, 2) lengths [m] and curvatures [1/m] of the shortest curves through vias (V, 3).

    They may touch walls and objects.
    """
    arcs = np.empty((ARCS * len(vias), 2))
    radius = improver.turning_radius
    reverses = improver.world.robot.curves_back
    here = start
    for i, there in enumerate(vias):
        core.shortest_curve(here, there, radius, reverses, arcs[ARCS * i : ARCS * (i + 1)])
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
