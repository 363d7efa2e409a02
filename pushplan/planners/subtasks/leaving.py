"""The way out of a tight place that the robot itself is in."""

from __future__ import annotations

import itertools

import numpy as np

from pushplan.planners.kinodynamic.collision import footprint, obstacles
from pushplan.planners.subtasks.arcs import arcs_of, steps_of, swept
from pushplan.planners.subtasks.places import from_columns, from_walls
from pushplan.planners.subtasks.route import depth_inside
from pushplan.planners.subtasks.scene import Scene
from pushplan.world.checks import FloatArray

_LEAST = 0.15
"""By how much a way out has to make more room [circumscribed radii]."""
_BETWEEN = 4
"""In how many places between two poses it is looked whether something static is in the way."""
_DEEPER = 1e-3
"""By how much the robot may get deeper into what it touches [circumscribed radii]."""


def way_out(scene: Scene) -> FloatArray | None:
    """A drive (N, 3) out of a tight place that moves no object; None if there is none, or no need.

    It makes at least some more room round the robot, so that a few of them come to an end.
    """
    start, enough = np.array(scene.world.robot_pose), 1.1 * scene.size
    most = float(_room(scene, start[None])[0])
    if most > enough:
        return None
    tracks, poses, reached = swept(scene, start, scene.poses, arcs_of(scene), steps_of(scene, 3.0))
    best, most = None, most + _LEAST * scene.size
    for track, after, count in zip(tracks, poses, reached, strict=True):
        still = int((after[:count] == scene.poses).all(axis=(1, 2)).sum())
        rooms = np.minimum(_room(scene, track[:still]), enough + _LEAST * scene.size)
        if rooms.max() > most:
            end = int(rooms.argmax()) + 1
            if _gets_out(scene, track[:end]):
                best, most = track[:end], float(rooms.max())
    return best


def _room(scene: Scene, path: FloatArray) -> FloatArray:
    """Distance of the robot's middle on a path (N, 3) from all that is around it [m]."""
    points, static = path[:, :2], scene.world.static
    away = np.hypot(*np.moveaxis(points[:, None] - scene.poses[:, :2], 2, 0))
    objects = (away - scene.world.movables.radii).min(axis=1, initial=np.inf)
    out: FloatArray = np.minimum(
        np.minimum(from_walls(static, points), from_columns(static, points)), objects
    )
    return out


def _gets_out(scene: Scene, track: FloatArray) -> bool:
    """Whether the robot gets no deeper into what it may touch: a bumper can hook on a corner."""
    shape, among = footprint(scene.world.robot, 0.0), obstacles(scene.world.static)
    scratch = np.empty_like(shape.vertices)
    deepest = depth_inside(track[0].copy(), shape, among, scratch) + _DEEPER * scene.size
    for before, after in itertools.pairwise(track):
        for n in range(1, _BETWEEN + 1):
            pose = before + n / _BETWEEN * (after - before)
            if depth_inside(pose, shape, among, scratch) > deepest:
                return False
    return True
