"""Random changes of a path that keep it drivable: Dubins curves through displaced poses. Compiled.

Shortcutting after Geraerts and Overmars, "Creating high-quality paths for motion planning" (2007).
"""

from __future__ import annotations

import numpy as np

from pushplan.compiled import kernel
from pushplan.motion.dubins import dubins, sample_pieces
from pushplan.world.checks import FloatArray


@kernel(allocates=True)
def _add(
    start: FloatArray,
    end: FloatArray,
    radius: float,
    spacing: float,
    most_turn: float,
    poses: FloatArray,
    bends: FloatArray,
) -> int:
    """Lay a Dubins path that does not turn much in vain; -1 where there is none."""
    pieces = np.empty((3, 2))
    dubins(start, end, radius, pieces)
    turn = 0.0
    for i in range(3):
        turn += abs(pieces[i, 0] * pieces[i, 1])
    if turn > most_turn:
        return -1
    return sample_pieces(start, pieces, spacing, poses, bends)


@kernel(allocates=True)
def propose(
    path: FloatArray,
    bends: FloatArray,
    draws: FloatArray,
    normals: FloatArray,
    numbers: FloatArray,
    goal: FloatArray,
    out: FloatArray,
    out_bends: FloatArray,
) -> tuple[int, int, int]:
    """A changed path.

    Args:
        path: (N, 3) poses.
        bends: (N,) curvatures that lead to them [1/m].
        draws: (4,) uniform in [0, 1): length and place of the piece, kind of change, its scale.
        normals: (2,) standard normal: sideways displacement and turn.
        numbers: (5,) turning radius, spacing, typical displacement [m], greatest turn of a curve
            [rad], share of changes of the end.
        goal: (4,) point x, y and unit normal of the line where the path ends.
        out: (M, 3) receives the poses.
        out_bends: (M,) receives their curvatures.

    Returns:
        The last pose shared with ``path``, the first pose of the unchanged rest in ``out`` and the
        number of poses; the number is 0 where the change is not drivable.
    """
    count = path.shape[0]
    radius, spacing, spread, most_turn = numbers[0], numbers[1], numbers[2], numbers[3]
    span = int(4 + (count - 5) * draws[0])
    if count < 6 or out.shape[0] < 2 * count:
        return 0, 0, 0
    scale = spread * 10.0 ** (-1.3 * draws[3])
    target = np.empty(3)
    if draws[2] < numbers[4]:  # another end: sideways, and straight into the line
        first = max(0, count - 1 - span)
        end = path[count - 1]
        gap = (end[0] - goal[0]) * goal[2] + (end[1] - goal[1]) * goal[3]
        shift = scale * normals[0]
        target[0] = end[0] - gap * goal[2] - shift * goal[3]
        target[1] = end[1] - gap * goal[3] + shift * goal[2]
        if draws[2] < 0.5 * numbers[4]:
            target[2] = np.arctan2(goal[3], goal[2]) + 0.1 * normals[1]
        else:
            target[2] = end[2] + 0.2 * normals[1]
        out[: first + 1] = path[: first + 1]
        out_bends[: first + 1] = bends[: first + 1]
        added = _add(
            path[first],
            target,
            radius,
            spacing,
            most_turn,
            out[first + 1 :],
            out_bends[first + 1 :],
        )
        return (first, 0, 0) if added < 1 else (first, first + 1 + added, first + 1 + added)
    first = int(draws[1] * (count - span))
    last = min(first + span, count - 1)
    out[: first + 1] = path[: first + 1]
    out_bends[: first + 1] = bends[: first + 1]
    size = first + 1
    if draws[2] < 0.9:
        middle = path[(first + last) // 2]
        shift = scale * normals[0]
        target[0] = middle[0] - shift * np.sin(middle[2])
        target[1] = middle[1] + shift * np.cos(middle[2])
        target[2] = middle[2] + 0.15 * normals[1]
        added = _add(path[first], target, radius, spacing, most_turn, out[size:], out_bends[size:])
        if added < 1:
            return first, 0, 0
        size += added
    added = _add(
        out[size - 1], path[last], radius, spacing, most_turn, out[size:], out_bends[size:]
    )
    if added < 1 or size + added + count - last > out.shape[0]:
        return first, 0, 0
    size += added
    rest = count - 1 - last
    turns = np.round((out[size - 1, 2] - path[last, 2]) / (2.0 * np.pi))
    out[size : size + rest] = path[last + 1 :]
    out[size : size + rest, 2] += 2.0 * np.pi * turns
    out_bends[size : size + rest] = bends[last + 1 :]
    return first, size, size + rest
