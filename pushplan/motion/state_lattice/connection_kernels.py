"""Compiled Dubins paths from the origin to the points of a lattice."""

from __future__ import annotations

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry.angles import wrap_angle
from pushplan.motion.dubins import dubins
from pushplan.world.checks import FloatArray


@kernel(allocates=True)
def fill_connections(
    heading: float,  # at the origin [rad]
    target: float,  # at the end [rad]
    radius: float,  # turning radius [steps]
    reach: int,  # greatest coordinate of an end [steps]
    slack: float,  # how much a path may turn beyond the change of heading [rad]
    out: FloatArray,  # (M, 9) receives length, x, y, and the three pieces of each path
) -> int:
    """Write the Dubins paths from the origin without needless turns; returns their number."""
    start, end, pieces = np.zeros(3), np.empty(3), np.empty((3, 2))
    start[2], end[2] = heading, target
    change = abs(wrap_angle(target - heading))
    count = 0
    for x in range(-reach, reach + 1):
        for y in range(-reach, reach + 1):
            ahead = x * np.cos(heading) + y * np.sin(heading)
            if ahead <= 0.0 or x * x + y * y > reach * reach or count == out.shape[0]:
                continue
            end[0], end[1] = x, y
            length = dubins(start, end, radius, pieces)
            turn = 0.0
            for i in range(3):
                turn += abs(pieces[i, 0] * pieces[i, 1])
            if turn > change + slack:
                continue
            out[count, 0], out[count, 1], out[count, 2] = length, x, y
            for i in range(3):
                out[count, 3 + 2 * i] = pieces[i, 0]
                out[count, 4 + 2 * i] = pieces[i, 1]
            count += 1
    return count
