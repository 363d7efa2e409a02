"""Start of a differential drive where no arc leads on: a path out, and a turn on the spot."""

from __future__ import annotations

import math

import numpy as np

from pushplan.core import motion as core
from pushplan.geometry import VisibilityGraph
from pushplan.motion.collision import footprint, obstacles
from pushplan.motion.keep_out import keep_out
from pushplan.motion.path_improver import ENDLESS, Lead, PathImprover
from pushplan.motion.room_ahead import way_to_turn
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import arc_lengths

_LEAST = 0.1
"""A turn that brings the heading nearer by less is not worth while [rad]."""
_CLEARANCE = 1.1
"""Clearance of the path whose bearing is turned to [circumscribed radii]; where there is none with
it, the inscribed radius."""


def start_turn(improver: PathImprover, before: Lead | None = None) -> Lead | None:
    """The turn of a differential drive towards the first leg of the shortest path around the walls.

    It goes the shorter way or, where something static blocks that, the longer one; where both are
    blocked, as far as it gets. Objects that the footprint sweeps are pushed.

    Args:
        improver: of this planning call.
        before: what the robot does first.

    Returns:
        The turn, after what comes before; None for other drives, and where a turn brings nothing.
    """
    world = improver.world
    if not world.robot.turns_on_spot:
        return None
    if before is None:
        before = Lead(np.empty((0, 2)), world.robot_pose, world.movables.poses)
    start = before.pose
    heading = _first_heading(improver, start[:2])
    if heading is None:
        return None
    left = math.remainder(heading - float(start[2]), math.tau)
    if abs(left) < _LEAST:
        return None
    angle, error, objects = _turn_freely(improver, before, left)
    longer = left - math.copysign(math.tau, left)
    other = _turn_freely(improver, before, longer)
    if other[1] < error - _LEAST:
        angle, error, objects = other
    if error > abs(left) - _LEAST:
        return None
    pose = start + np.array([0.0, 0.0, angle])
    piece = np.array([[abs(angle), math.copysign(math.inf, angle)]])
    return Lead(np.concatenate([before.pieces, piece]), pose, objects)


def drive_to_turn(improver: PathImprover) -> Lead | None:
    """The drive of a differential drive that may reverse to where it can turn about, and the turn.

    It moves no object and keeps the margin from walls if it can.

    Args:
        improver: of this planning call.

    Returns:
        The drive; None where there is none, or the robot can turn about where it is.
    """
    world = improver.world
    room = improver.room
    start = world.robot_pose
    boxes = world.movables.every_part_world
    among = obstacles(keep_out(world), boxes)
    for walls in (among, room.walls) if boxes else (room.walls,):
        for shape in (room.footprint, footprint(world.robot)):
            space = room._replace(footprint=shape, walls=walls)
            arcs = way_to_turn(world.robot, space, start, improver.stopped)
            if arcs is not None:
                path, count = improver.laid_out(arcs)
                core.sweep_cost(
                    path.view(), 0, count, np.inf, ENDLESS, improver.problem, improver.contacts
                )
                driven = Lead(arcs, path.poses[count - 1], path.objects[count - 1])
                return start_turn(improver, driven) or driven
    return None


def _first_heading(improver: PathImprover, start: FloatArray) -> float | None:
    """The bearing [rad] of the shortest path around the walls where it is R away; None without."""
    static = keep_out(improver.world)
    for clearance in (_CLEARANCE * improver.size, improver.world.robot.inscribed_radius):
        graph = VisibilityGraph(static, clearance)
        corners = graph.to_goal(start, improver.goal, improver.stopped).points
        if len(corners):
            along = arc_lengths(corners)
            ahead = min(improver.size, float(along[-1]))
            dx, dy = (float(np.interp(ahead, along, c - c[0])) for c in corners.T)
            return math.atan2(dy, dx)
        if improver.stopped():
            break
    return None


def _turn_freely(
    improver: PathImprover,
    before: Lead,  # where the turn begins
    angle: float,  # to turn by [rad]
) -> tuple[float, float, FloatArray]:
    """Turn until something blocks it; what of the turn comes nearest to the wanted heading.

    Returns:
        The angle [rad], the heading error that is left [rad], and (K, 3) poses of the objects.
    """
    objects = np.empty_like(before.objects)
    turned, error = core.turn_freely(
        improver.problem, improver.contacts, before.pose, before.objects, angle, objects
    )
    return turned, error, objects
