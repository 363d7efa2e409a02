"""Moving overlapping bodies apart by the least total motion, compiled."""

from __future__ import annotations

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray


@kernel
def _nudge(pose: FloatArray, x: float, y: float, ix: float, iy: float, inv: float) -> None:
    """Move a body by (ix, iy) applied at the world point (x, y)."""
    arm = (x - pose[0]) * iy - (y - pose[1]) * ix
    pose[0] += ix
    pose[1] += iy
    pose[2] += arm * inv


@kernel
def separate(
    points: FloatArray,  # (2, 5) contact points from the first to the second, from `contacts`
    found: int,  # number of them that count
    a: FloatArray,  # (3,) pose of the first body, changed in place
    weight_a: float,  # its inverse mass; 0 if it cannot move
    inv_a: float,  # its 1 / c²
    b: FloatArray,  # (3,) pose of the second body, likewise
    weight_b: float,
    inv_b: float,
) -> float:
    """Move two bodies apart by the least total motion; returns the sum of the impulses."""
    x0 = points[0, 0]
    y0 = points[0, 1]
    x1 = points[1, 0]
    y1 = points[1, 1]
    nx = points[0, 2]
    ny = points[0, 3]
    arm_a = (x0 - a[0]) * ny - (y0 - a[1]) * nx
    arm_b = (x0 - b[0]) * ny - (y0 - b[1]) * nx
    base = weight_a + weight_b
    wa = weight_a * inv_a
    wb = weight_b * inv_b
    k00 = base + wa * arm_a**2 + wb * arm_b**2
    first = points[0, 4] / k00
    second = 0.0
    if found == 2:
        # the exact solution of the 2 x 2 complementarity problem: both points, or only one
        other_a = (x1 - a[0]) * ny - (y1 - a[1]) * nx
        other_b = (x1 - b[0]) * ny - (y1 - b[1]) * nx
        k11 = base + wa * other_a**2 + wb * other_b**2
        k01 = base + wa * arm_a * other_a + wb * arm_b * other_b
        d0 = points[0, 4]
        d1 = points[1, 4]
        det = k00 * k11 - k01 * k01
        if det > 1e-12 * k00 * k11:
            first = (k11 * d0 - k01 * d1) / det
            second = (k00 * d1 - k01 * d0) / det
            if first < 0.0:
                first = 0.0
                second = d1 / k11
            elif second < 0.0:
                first = d0 / k00
                second = 0.0
    _nudge(a, x0, y0, -first * weight_a * nx, -first * weight_a * ny, inv_a)
    _nudge(b, x0, y0, first * weight_b * nx, first * weight_b * ny, inv_b)
    if found == 2:
        _nudge(a, x1, y1, -second * weight_a * nx, -second * weight_a * ny, inv_a)
        _nudge(b, x1, y1, second * weight_b * nx, second * weight_b * ny, inv_b)
    total: float = first + second
    return total


@kernel
def drag_along(
    points: FloatArray,  # as in `separate`; two points count as the one between them
    found: int,
    limit: float,  # friction times what the body was moved along the normal [m]
    robot_from: FloatArray,  # (3,) what the body touches has moved from here
    robot_to: FloatArray,  # (3,) to here
    before: FloatArray,  # (3,) pose of the body before the step
    pose: FloatArray,  # (3,) pose of the body, changed in place
    inv: float,  # its 1 / c²
) -> None:
    """Coulomb friction: carry the contact sideways with the robot, up to ``limit`` [m]."""
    x = points[0, 0]
    y = points[0, 1]
    nx = points[0, 2]
    ny = points[0, 3]
    if found == 2:
        x = 0.5 * (x + points[1, 0])
        y = 0.5 * (y + points[1, 1])
    tx = -ny
    ty = nx
    turn = robot_to[2] - robot_from[2]
    robot = (robot_to[0] - robot_from[0] - turn * (y - robot_to[1])) * tx
    robot += (robot_to[1] - robot_from[1] + turn * (x - robot_to[0])) * ty
    turn = pose[2] - before[2]
    body = (pose[0] - before[0] - turn * (y - pose[1])) * tx
    body += (pose[1] - before[1] + turn * (x - pose[0])) * ty
    arm = (x - pose[0]) * ty - (y - pose[1]) * tx
    by = min(max((robot - body) / (1.0 + arm * arm * inv), -limit), limit)
    _nudge(pose, x, y, by * tx, by * ty, inv)
