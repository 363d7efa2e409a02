"""The length of the Dubins path to a goal line, as a bound of the cost to go."""

from __future__ import annotations

import numpy as np

from pushplan.world.checks import FloatArray


def dubins_to_line(
    distance: FloatArray,  # from the line [m], not negative
    heading: FloatArray,  # relative to the line's normal [rad]; broadcast with ``distance``
    radius: float,  # least turning radius R [m]
) -> FloatArray:
    """Length [m] of the shortest path of bounded curvature from a pose to a line.

    The robot turns towards the normal of the line until it faces it or is there, and then drives
    straight. While it turns from α to β it gets on by R (sin α - sin β).
    """
    angle = np.abs((np.asarray(heading) + np.pi) % (2.0 * np.pi) - np.pi)
    gained = radius * np.sin(angle)
    straight = radius * angle + (distance - gained)
    left = np.arcsin(np.clip(np.sin(angle) - distance / radius, -1.0, 1.0))
    turning = radius * (angle - left)
    length: FloatArray = np.where(distance >= gained, straight, np.maximum(turning, 0.0))
    return np.where(distance <= 0.0, 0.0, length)
