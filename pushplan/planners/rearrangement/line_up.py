"""Getting behind an object: the path it is to take, and where a robot stands to push it along."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pushplan.control import Legs
from pushplan.geometry import VisibilityGraph
from pushplan.planners.pushing import PushPath
from pushplan.planners.rearrangement.push_poses import heading_axes, initial_heading, pose_behind
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.world import StaticMap
from pushplan.world.checks import FloatArray

_OPTIONS = sorted(
    (
        (math.radians(turn), shift)
        for turn in (0, 30, -30, 60, -60, 90, -90)
        for shift in (0.0, 0.35, -0.35, 0.7, -0.7)
    ),
    key=lambda option: 2.0 * abs(option[0]) + abs(option[1]),
)
"""Where to begin, in order of preference: turn against the shortest path [rad], and how far the
robot's middle is to the left of the object's, as a fraction of half the bumper's width."""
_PATHS = ((0.7, False), (0.0, False), (0.0, True))
"""Paths of an object: the clearance that it keeps where there is room [radii of the object], and
whether it goes to the middle of a receptacle."""
_LEANS = tuple(math.radians(lean) for lean in (0, 20, -20, 40, -40))
"""Directions of the last leg against the heading of the push [rad]."""


@dataclass(frozen=True)
class LineUp:
    """Where to begin a push.

    Args:
        path: of the object.
        shift: of the robot's middle to the left of the object's [m].
        legs: that lead there.
    """

    path: PushPath
    shift: float
    legs: Legs


def shortest_path(scene: PushScene, k: int) -> FloatArray | None:
    """(M, 2) the shortest path of object ``k`` to where it is done, and on [m]; None if none is.

    It keeps about half the object's width from static things where it can.
    """
    radius = float(scene.world.movables.radii[k])
    found = (scene.object_path(k, clearance * radius, deep) for clearance, deep in _PATHS)
    return next((path for path in found if path is not None), None)


def line_up(scene: PushScene, k: int, skip: int = 0) -> LineUp | None:
    """A place behind object ``k``, for the best option to push it that allows one.

    Args:
        scene: the scene.
        k: index of the object.
        skip: how many of the best options to pass over, because they have failed before; it begins
            anew where there are no more.

    Returns:
        None where the object has no path, or the robot fits nowhere, or cannot get there around
        static things and the object itself; other objects are not looked at.
    """
    path = shortest_path(scene, k)
    if path is None:
        return None
    robot, static = scene.world.robot, scene.world.static
    outline = scene.world.movables.outline_world(k)
    around = StaticMap((*static.polygons, outline), static.segments, static.radii, static.bounds)
    towards = initial_heading(path, scene.controller.ahead)
    found = []
    for clearance in (scene.size, 0.5 * (scene.size + robot.inscribed_radius)):
        for turn, fraction in _OPTIONS:
            heading, shift = towards + turn, fraction * scene.half
            start = pose_behind(scene, k, heading, shift)
            legs = _approach(scene, around, start, clearance)
            if legs is not None:
                found.append(LineUp(PushPath.through(path), shift, legs))
            if len(found) > skip:
                return found[skip]
        if found:
            return found[skip % len(found)]
    return None


def _approach(
    scene: PushScene, around: StaticMap, start: FloatArray, clearance: float
) -> Legs | None:
    """Legs that lead to a pose (3,).

    The last leg is straight, from where the robot can turn. Beside a wall it may come from
    farther out, and the robot turns at the end by as much.
    """
    behind, heading = start[:2], float(start[2])
    if not scene.fits(start):
        return None
    for lean in _LEANS:
        stop = behind - 1.05 * scene.size * heading_axes(heading + lean)[0]
        poses = [
            np.array([*place, heading + angle])
            for place, angle in ((behind, lean), (behind, 0.5 * lean), (stop, lean))
        ]
        if not all(scene.fits(pose) for pose in poses):
            continue
        path = VisibilityGraph(around, clearance).shortest_path(scene.world.robot_pose[:2], stop)
        if math.isfinite(path.length):
            return Legs.ahead(np.concatenate([path.points[1:], [stop, behind]]), heading)
    return None
