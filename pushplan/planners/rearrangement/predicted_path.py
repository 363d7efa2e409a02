"""The path that an object is predicted to take under a push, for control to keep it on."""

from __future__ import annotations

import math

import numpy as np

from pushplan.interaction.kernels import sweep_path
from pushplan.planners.pushing import PushPath
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import arc_lengths

_SPACING = 0.2  # between two poses of the path [circumscribed radii]
_BEYOND = 1.0  # by which the path goes on straight beyond its end [circumscribed radii]


def predicted_path(scene: PushScene, push: Push) -> tuple[PushPath, FloatArray]:
    """The path of a push's target, and its offset on the bumper at each pose of it.

    A controller that keeps both drives the robot where the prediction has found it free.

    Args:
        scene: in which the push begins.
        push: as it is predicted from there.

    Returns:
        The path, which goes on straight beyond its end, and (N,) distances of the object to the
        left of the robot's x axis [m].
    """
    k = int(np.flatnonzero(scene.world.movables.ids == push.target)[0])
    robots = np.ascontiguousarray(push.poses)
    swept = np.empty((len(robots), len(scene.poses), 3))
    sweep_path(robots, scene.poses.copy(), scene.bodies, scene.settings, swept)
    places = swept[:, k, :2]
    away = places - robots[:, :2]
    offsets = np.cos(robots[:, 2]) * away[:, 1] - np.sin(robots[:, 2]) * away[:, 0]
    lengths = arc_lengths(places)
    count = round(float(lengths[-1]) / (_SPACING * scene.size))
    at = np.linspace(0.0, lengths[-1], count + 1)
    points = np.column_stack([np.interp(at, lengths, places[:, axis]) for axis in (0, 1)])
    offsets = np.interp(at, lengths, offsets)
    heading = float(robots[-1, 2])  # of an object that is done as soon as it is touched
    if count:
        heading = math.atan2(*(points[-1] - points[-2])[::-1].tolist())
    beyond = _BEYOND * scene.size * np.array([math.cos(heading), math.sin(heading)])
    points = np.concatenate([points, points[-1] + np.outer([0.5, 1.0], beyond)])
    offsets = np.append(offsets, [offsets[-1], offsets[-1]])
    ahead = np.gradient(points, axis=0)
    headings = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
    return PushPath(np.column_stack([points, headings])), offsets
