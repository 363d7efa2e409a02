"""Where a robot stands to begin a push, and how it gets there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
import shapely

from pushplan.geometry import convex_overlap
from pushplan.motion.collision import footprint, is_free, obstacles
from pushplan.planners.pushing import contact_kernels
from pushplan.planners.pushing.bumper import face_towards
from pushplan.planners.pushing.model import PushModel
from pushplan.planners.pushing.parameters import PushParameters
from pushplan.planners.pushing.path import PushPath
from pushplan.planners.pushing.paths_from_start import PathsFromStart
from pushplan.world import StaticMap, World
from pushplan.world.checks import FloatArray, expect, integer, number
from pushplan.world.outline import centroid

_MILD = [(0, 0.0), (0, 0.25), (0, -0.25), (0, 0.45), (0, -0.45)]
_HARD = [(t, s) for t in (0, 12, -12, 30, -30) for s in (0.0, 0.4, -0.4, 0.65, -0.65, 0.8, -0.8)]
"""Headings of the robot against the direction of the path [degrees] and further offsets of the box
from the best one [half bumpers], in order of preference."""
_COARSE = 0.02  # how far the path to a box may be from the shortest one [circumscribed radii]
_LEANS = tuple(math.radians(lean) for lean in (0, 20, -20, 40, -40))
"""Directions of the last leg against the robot's heading at its end."""
_LEGS = (1.05, 0.6)
"""Lengths of the last leg [circumscribed radii]: the robot turns in free space before it."""
_STEP = 0.3  # greatest turn between two headings that are checked [rad]
_SPAN = 1.2  # sliding that one push should make do with [half bumpers]
_FARTHEST, _RIM = 0.6, 0.8
"""Greatest offsets at the beginning, with and without clearance beside the box [half bumpers]."""


@dataclass(frozen=True)
class Approach:
    """How to get behind a box.

    Args:
        points: (N, 2) to drive to in turn; the last one is the place of ``pose`` [m].
        pose: (3,) at the beginning of the push.
        offset: of the box to the left of the robot's x axis there [m].
    """

    points: FloatArray
    pose: FloatArray
    offset: float


def best_offset(model: PushModel, path: PushPath, speed: float) -> float:
    """Offset at which to begin, so that sliding in the path's turns leaves the box on the bumper.

    Without friction the box slides by the distance to its centre times the angle that the path
    turns by. The middle of that range lies on the middle of the bumper; of a path that needs too
    much of it only the beginning counts.

    Args:
        model: of the box on the bumper.
        path: of the box.
        speed: of the robot [m/s].
    """
    expect("model", model, PushModel)
    expect("path", path, PushPath)
    number("speed", speed, low=0.0, open_low=True)
    state, out = np.zeros(6), np.zeros(6)
    low = high = 0.0
    half = model.bumper.half
    lengths = path.lengths
    for i in range(1, len(path.poses)):
        length = float(lengths[i] - lengths[i - 1])
        if length < 1e-9:
            continue
        turn = math.remainder(float(path.poses[i, 2] - path.poses[i - 1, 2]), math.tau)
        contact_kernels.advance(
            model.contact, state, speed, turn * speed / length, length / speed, out
        )
        if max(high, state[3]) - min(low, state[3]) > _SPAN * half:
            break
        low, high = min(low, float(state[3])), max(high, float(state[3]))
        state[3] = min(max(state[3], -half), half)
    offset = -0.5 * (low + high)
    return min(max(offset, -_FARTHEST * half), _FARTHEST * half)


def find_approach(
    world: World,
    k: int,
    path: PushPath,
    parameters: PushParameters,
    slack: float,
    skip: int = 0,
) -> Approach | None:
    """A place behind object ``k`` from which to push it along a path.

    Args:
        world: the snapshot.
        k: index of the object.
        path: that the object is to take.
        parameters: friction.
        slack: clearance to leave between bumper and object [m].
        skip: how many of the best places to pass over, because they have failed before; the last
            one where there are no more.

    Returns:
        None where the robot fits nowhere behind it, or cannot get there around static things and
        the object. PathsFromStart around the other objects come first.

    Raises:
        InvalidInputError: if there is no such object.
    """
    expect("path", path, PushPath)
    robot = expect("world", world, World).robot
    integer("k", k, low=0, high=len(world.movables) - 1)
    number("slack", slack, low=0.0)
    integer("skip", skip, low=0)
    outline = world.movables.outline(k)
    direction = float(path.poses[0, 2])
    face = face_towards(outline, direction - float(world.movables.poses[k, 2]))
    model = PushModel(robot, outline, parameters, face)
    half = model.bumper.half
    best = best_offset(model, path, robot.max_speed)
    target = world.movables.outline_world(k)
    fallback: Approach | None = None
    scenes = _scenes(world, k)
    for options in (_MILD, _HARD):
        for scene, (turn, shift) in product(scenes, options):
            if turn and _leads_into(world.static, target, direction, turn):
                continue
            offset = min(max(best + shift * half, -_RIM * half), _RIM * half)
            found = scene.line_up(direction + math.radians(turn), offset, slack)
            if found is not None:
                fallback = found
                skip -= 1
            if fallback is not None and skip < 0:
                return fallback
    return fallback


def _leads_into(static: StaticMap, target: FloatArray, direction: float, turn: float) -> bool:
    """Whether a push that is turned by ``turn`` degrees begins by pressing the box into a wall."""
    heading = direction + math.radians(turn)
    size = 0.5 * float(np.ptp(target, axis=0).max())
    ahead = target + size * np.array([math.cos(heading), math.sin(heading)])
    return any(convex_overlap(ahead, part) for part in static.convex_parts)


def _scenes(world: World, k: int) -> list[_Scene]:
    """What to keep off on the way to object ``k``: the other objects too, and then not."""
    outlines = [world.movables.outline_world(i) for i in range(len(world.movables))]
    others = [*outlines[:k], *outlines[k + 1 :]]
    size = world.robot.circumscribed_radius
    return [
        _Scene(world, outlines[k], around, clearance)
        for around in ((others, []) if others else ([],))
        for clearance in (size, 0.5 * (size + world.robot.inscribed_radius))
    ]


class _Scene:
    """Where the robot may stand and drive, beside static things and some outlines.

    Args:
        world: with the robot at the start.
        target: (N, 2) outline of the object to get behind [m].
        others: outlines of objects to go around.
        clearance: of the robot's origin on the way to the last leg [m].
    """

    def __init__(
        self, world: World, target: FloatArray, others: list[FloatArray], clearance: float
    ) -> None:
        self._world, self._target, self._clearance = world, target, clearance
        self._around = [*others, target]
        self._middle = centroid(target)
        self._shape = footprint(world.robot)
        self._among = obstacles(world.static, self._around)
        self._scratch = np.empty_like(self._shape.vertices)

    def line_up(self, heading: float, offset: float, slack: float) -> Approach | None:
        """The path to one place behind the object, None if there is none."""
        robot, middle = self._world.robot, self._middle
        ahead = np.array([math.cos(heading), math.sin(heading)])
        left = np.array([-ahead[1], ahead[0]])
        depth = float(((middle - self._target) @ ahead).max())
        depth += float(robot.vertices[:, 0].max()) + slack
        behind = middle - depth * ahead - offset * left
        if not self._free(behind, heading):
            return None
        size = robot.circumscribed_radius
        for leg, lean in product(_LEGS, _LEANS):
            course = heading + lean
            stop = behind - leg * size * np.array([math.cos(course), math.sin(course)])
            if not (
                self._free(stop, course)
                and self._free(0.5 * (stop + behind), course)
                and self._free(behind, course)
                and self._free(behind, heading + 0.5 * lean)
            ):
                continue
            path = self._paths.to(stop)
            if path is None:
                continue
            corners = _simpler(path, _COARSE * size)
            last = corners[-1] - corners[-2] if len(corners) > 1 else ahead
            if self._turns(stop, math.atan2(last[1], last[0]), course):
                points = np.concatenate([corners[1:-1], [stop, behind]])
                return Approach(points, np.array([*behind, heading]), offset)
        return None

    @cached_property
    def _paths(self) -> PathsFromStart:
        static = self._world.static
        shapes = (*static.polygons, *self._around)
        among = StaticMap(shapes, static.segments, static.radii, static.bounds)
        return PathsFromStart(among, self._clearance, self._world.robot_pose[:2])

    def _free(self, place: FloatArray, heading: float) -> bool:
        """Whether the robot overlaps nothing there."""
        pose = np.array([*place, heading])
        return bool(is_free(pose, self._shape, self._among, self._scratch))

    def _turns(self, place: FloatArray, begin: float, end: float) -> bool:
        """Whether the robot can turn at a place from one heading [rad] to another."""
        turn = math.remainder(end - begin, math.tau)
        count = max(1, math.ceil(abs(turn) / _STEP))
        return all(self._free(place, begin + turn * i / count) for i in range(1, count))


def _simpler(points: FloatArray, tolerance: float) -> FloatArray:
    """A polyline (N, 2) with fewer points, at most ``tolerance`` [m] away."""
    if len(points) < 3:
        return points
    simple = shapely.LineString(points).simplify(tolerance, preserve_topology=False)
    return np.asarray(simple.coords)
