"""Drag on floating bodies that move in the plane of the water; docs/tasks.md has its sources."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pushplan.compiled import kernel, owned
from pushplan.geometry import polygon_area, polygon_centroid, polygon_inertia
from pushplan.world import World
from pushplan.world.checked_fields import CheckedFields, NonNegativeFloat, PositiveFloat
from pushplan.world.checks import FloatArray, IntArray, frozen


@kernel(allocates=True)
def flow_shapes(
    vertices: FloatArray,  # (V, 2) corners about the centroids [m], counter-clockwise
    offsets: IntArray,  # (K + 1,) where each body starts
) -> FloatArray:
    """(K, 4) mean width [m], area [m²] two rotation integrals [m⁴, m⁵] of convex bodies."""
    # 0: circumference over pi (Cauchy). 2: sum over both halves of each edge of half the integral
    # of |t|³ dt, t along the edge from the foot of the perpendicular, whose speed of rotation meets
    # the water head on (a plate of half length a about its middle has a⁴ / 2). 3: integral of
    # |r|³ dA, by two-point products over the triangles of the outline
    count = offsets.shape[0] - 1
    out = np.zeros((count, 4))
    for k in range(count):
        first = offsets[k]
        last = offsets[k + 1]
        for i in range(first, last):
            j = i + 1 if i + 1 < last else first
            ax = vertices[i, 0]
            ay = vertices[i, 1]
            bx = vertices[j, 0]
            by = vertices[j, 1]
            ex = bx - ax
            ey = by - ay
            long = math.hypot(ex, ey)
            s = (ax * ex + ay * ey) / long
            t = (bx * ex + by * ey) / long
            cross = ax * by - ay * bx
            out[k, 0] += long / math.pi
            out[k, 1] += 0.5 * cross
            out[k, 2] += 0.125 * abs(t * abs(t) ** 3 - s * abs(s) ** 3)
            out[k, 3] += cross * _cubed_distance(ax, ay, bx, by)
    return out


@kernel(allocates=True)
def _cubed_distance(ax: float, ay: float, bx: float, by: float) -> float:
    """Mean of |p|³ over the edge a-b, over 5: times the cross product, the triangle's integral."""
    total = 0.0
    # Gauss-Legendre with three points; |r|³ scales with the third power along rays
    for place, weight in ((-0.7745966692414834, 5.0), (0.0, 8.0), (0.7745966692414834, 5.0)):
        u = 0.5 + 0.5 * place
        total += weight / 18.0 * math.hypot(ax + u * (bx - ax), ay + u * (by - ay)) ** 3
    return total / 5.0


@dataclass(frozen=True)
class Water(CheckedFields):
    """Drag of water on bodies: ``F = -(b + c |v|) v``, and likewise about the vertical axis.

    Objects are flat floes. Water resists them at their edges (form drag) and underneath (skin
    drag), both quadratic. It is never quite still itself: against an ambient motion u0, the drag
    on a body that is slower than that is linear, which ``b = c u0`` stands for. So a floe comes to
    rest exponentially, where a quadratic law alone would let it creep for ever.

    The robot is a hull whose low-speed model is linear: its speed decays with a time constant.
    """

    field_prefix = "water "

    density: PositiveFloat = 1025.0  # of the water [kg/m³]
    object_draught: NonNegativeFloat = 1.05  # draught of an object [m]
    object_form_drag: NonNegativeFloat = 1.1  # C_d of an edge, on mean width times draught
    object_skin_drag: NonNegativeFloat = 0.0055  # C_w of the underside, ``F = density C_w area v²``
    ambient_speed: NonNegativeFloat = 0.05  # u0 [m/s]
    robot_draught: NonNegativeFloat = 5.0  # draught of the robot [m]
    # time constant of the robot's speed when nothing drives it [s]
    robot_surge_time: PositiveFloat = 88.0
    robot_yaw_time: PositiveFloat = 11.6  # of its turn rate [s]

    def coefficients(self, world: World) -> FloatArray:
        """Drag of the robot, then of each object.

        Returns:
            (1 + K, 4): linear b [N s/m] and quadratic c [N s²/m²] coefficient of the translation,
            linear [N m s] and quadratic [N m s²] of the rotation.
        """
        movables = world.movables
        out = np.zeros((1 + len(movables), 4))
        out[0, 0] = world.robot.mass / self.robot_surge_time
        out[0, 2] = world.robot.mass * _hull_inertia(world) / self.robot_yaw_time
        shape = flow_shapes(movables.vertices, movables.offsets)
        form = 0.5 * self.density * self.object_form_drag * self.object_draught
        skin = self.density * self.object_skin_drag
        out[1:, 1] = form * shape[:, 0] + skin * shape[:, 1]
        out[1:, 3] = form * shape[:, 2] + skin * shape[:, 3]
        out[1:, 0] = self.ambient_speed * out[1:, 1]
        out[1:, 2] = self.ambient_speed / np.sqrt(shape[:, 1] / np.pi) * out[1:, 3]
        return frozen(out)


def _hull_inertia(world: World) -> float:
    """Polar second moment of the robot's footprint about its origin, per unit mass [m²]."""
    total = moment = 0.0
    for part in world.robot.contact_parts:
        area = polygon_area(owned(part))
        x, y = polygon_centroid(part)
        total += area
        moment += area * (polygon_inertia(part) + x * x + y * y)
    return moment / total
