"""Getting behind an object: the heading to its goal, and where a robot stands to push it there."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pushplan.compiled import owned
from pushplan.geometry import VisibilityGraph, convex_penetration, goal_distances
from pushplan.motion.collision import footprint, is_free, obstacles
from pushplan.planners.rearrangement.object_paths import done_places
from pushplan.world import (
    ClearanceArea,
    Goal,
    InvalidInputError,
    Receptacle,
    RobotModel,
    StaticMap,
    World,
)
from pushplan.world.checks import FloatArray

_OPTIONS = sorted(
    (
        (math.radians(turn), shift)
        for turn in (0, 30, -30, 60, -60, 90, -90)
        for shift in (0.0, 0.35, -0.35, 0.7, -0.7)
    ),
    key=lambda option: 2.0 * abs(option[0]) + abs(option[1]),
)
"""Options to push, in order of preference: turn against the shortest path [rad], and how far the
robot's middle is to the left of the object's, as a fraction of half the bumper's width."""
_INSET = 0.7
"""Distance that a path's end keeps from the edges of a receptacle [radii of the object]."""
_LEANS = tuple(math.radians(lean) for lean in (0, 20, -20, 40, -40))
"""Directions of the last leg against the heading of the push [rad]."""


@dataclass(frozen=True)
class LineUp:
    """Where to begin a push.

    Args:
        heading: of the push [rad].
        turn: against the object's shortest path [rad].
        shift: of the robot's middle to the left of the object's, in half widths of the bumper.
        points: (N, 2) that lead there; driving to the last one turns the robot to the heading [m].
    """

    heading: float
    turn: float
    shift: float
    points: FloatArray


def is_done(world: World, k: int) -> bool:
    """Whether nothing is left to do about object ``k``.

    An area is clear of it when its outline no longer touches the area. A receptacle takes objects
    off the map, so one that is still there is not done.

    Raises:
        InvalidInputError: if the goal is one for the robot.
    """
    goal = world.goal
    if isinstance(goal, ClearanceArea):
        depth, _, _ = convex_penetration(world.movables.outline_world(k), owned(goal.polygon))
        return bool(depth < 0.0)
    if isinstance(goal, Receptacle):
        return False
    raise InvalidInputError(f"this needs a goal for the objects, got {type(goal).__name__}")


def goal_heading(world: World, k: int) -> float | None:
    """Heading [rad] of the shortest path of object ``k`` to its goal; None where it is there.

    The path keeps about half the object's width from static things where it can.
    """
    radius = float(world.movables.radii[k])
    here = world.movables.poses[k, :2]
    goals = done_places(world.goal, radius, _INSET)
    if goals is None:
        goals = [np.stack([_middle(world.goal), _middle(world.goal)])]
    path = goal_distances(world.static, goals, clearance=0.7 * radius).path_from(here)
    if not math.isfinite(path.length):
        path = goal_distances(world.static, goals).path_from(here)
    if path.length <= radius and isinstance(world.goal, Receptacle):
        step = _into(world.goal.polygon, world.movables.outline_world(k), 0.03 * radius)
    else:
        steps = path.points - here
        far = np.flatnonzero(np.hypot(steps[:, 0], steps[:, 1]) > 0.05 * radius)
        step = steps[far[0]] if len(far) else np.zeros(2)
    return math.atan2(step[1], step[0]) if step.any() else None


def line_up(world: World, k: int, slack: float, skip: int = 0) -> LineUp | None:
    """A place behind object ``k``, for the best option to push it that allows one.

    Args:
        world: the snapshot.
        k: index of the object.
        slack: clearance to leave between bumper and object [m].
        skip: how many of the best options to pass over, because they have failed before; it begins
            anew where there are no more.

    Returns:
        None where the robot fits nowhere, or cannot get there around static things and the
        object itself; other objects are not looked at.
    """
    robot, box = world.robot, world.movables.poses[k, :2]
    towards = goal_heading(world, k)
    if towards is None:  # all but there: farther in
        dx, dy = (_middle(world.goal) - box).tolist()
        towards = math.atan2(dy, dx)
    outline = world.movables.outline_world(k)
    static = world.static
    around = StaticMap((*static.polygons, outline), static.segments, static.radii, static.bounds)
    size, half = robot.circumscribed_radius, bumper_half(robot)
    found = []
    for clearance in (size, 0.5 * (size + robot.inscribed_radius)):
        for turn, shift in _OPTIONS:
            u = unit(towards + turn)
            depth = float(((box - outline) @ u).max()) + float(robot.vertices[:, 0].max()) + slack
            behind = box - depth * u + shift * half * np.array([-u[1], u[0]])
            points = _approach(world, around, behind, towards + turn, clearance)
            if points is not None:
                found.append(LineUp(towards + turn, turn, shift, points))
            if len(found) > skip:
                return found[skip]
        if found:
            return found[skip % len(found)]
    return None


def _approach(
    world: World, around: StaticMap, behind: FloatArray, heading: float, clearance: float
) -> FloatArray | None:
    """Points (N, 2) that lead to a place (2,) and turn the robot to a heading there.

    The last leg is straight, from where the robot can turn. Beside a wall it may come from
    farther out, and the robot turns at the end by as much.
    """
    robot, size = world.robot, world.robot.circumscribed_radius
    walls, shape = obstacles(world.static), footprint(robot)
    scratch = np.empty_like(shape.vertices)
    if not is_free(np.array([*behind, heading]), shape, walls, scratch):
        return None
    for lean in _LEANS:
        stop = behind - 1.05 * size * unit(heading + lean)
        poses = [
            np.array([*place, heading + angle])
            for place, angle in ((behind, lean), (behind, 0.5 * lean), (stop, lean))
        ]
        if not all(is_free(pose, shape, walls, scratch) for pose in poses):
            continue
        path = VisibilityGraph(around, clearance).shortest_path(world.robot_pose[:2], stop)
        if math.isfinite(path.length):
            facing = behind + 0.03 * size * unit(heading)
            return np.concatenate([path.points[1:], stop[None], behind[None], facing[None]])
    return None


def bumper_half(robot: RobotModel) -> float:
    """Half the width of the robot's foremost edge [m]."""
    front = float(robot.vertices[:, 0].max())
    return float(np.abs(robot.vertices[robot.vertices[:, 0] > 0.9 * front, 1]).max())


def unit(heading: float) -> FloatArray:
    """(2,) unit vector of a heading [rad]."""
    return np.array([math.cos(heading), math.sin(heading)])


def _middle(goal: Goal) -> FloatArray:
    assert isinstance(goal, Receptacle | ClearanceArea)
    middle: FloatArray = goal.polygon.mean(axis=0)
    return middle


def _into(polygon: FloatArray, outline: FloatArray, slack: float) -> FloatArray:
    """The shift (2,) [m] that brings an outline into a polygon, edge by edge.

    What sticks out by less than ``slack`` [m] is left alone: a wall may be there.
    """
    shift = np.zeros(2)
    for corner, following in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        along = (following - corner) / np.hypot(*(following - corner))
        outward = np.array([along[1], -along[0]])
        excess = float(((outline - corner) @ outward).max())
        if excess > slack:
            shift -= excess * outward
    return shift
