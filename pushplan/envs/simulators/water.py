"""Drag on floating bodies that move in the plane of the water; docs/tasks.md has its sources."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pushplan.core import envs as core
from pushplan.core import geometry
from pushplan.world import Movables, World
from pushplan.world.checked_fields import CheckedFields, NonNegativeFloat, PositiveFloat
from pushplan.world.checks import FloatArray, frozen
from pushplan.world.outline import flatten


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
        shape = _flow_shapes(movables)
        form = 0.5 * self.density * self.object_form_drag * self.object_draught
        skin = self.density * self.object_skin_drag
        out[1:, 1] = form * shape[:, 0] + skin * shape[:, 1]
        out[1:, 3] = form * shape[:, 2] + skin * shape[:, 3]
        out[1:, 0] = self.ambient_speed * out[1:, 1]
        out[1:, 2] = self.ambient_speed / np.sqrt(shape[:, 1] / np.pi) * out[1:, 3]
        return frozen(out)


def _flow_shapes(movables: Movables) -> FloatArray:
    """(K, 4) as `FlowShape` of the core: edges are those of the hulls, areas those of the parts."""
    shape = core.flow_shapes(movables.vertices, movables.offsets)
    if movables.is_compound:
        pieces = [movables.contact_pieces(k) for k in range(len(movables))]
        each = core.flow_shapes(*flatten([piece for some in pieces for piece in some]))
        first = np.cumsum([0, *map(len, pieces)])[:-1]
        shape[:, [1, 3]] = np.add.reduceat(each[:, [1, 3]], first)
    return shape


def _hull_inertia(world: World) -> float:
    """Polar second moment of the robot's footprint about its origin, per unit mass [m²]."""
    total = moment = 0.0
    for part in world.robot.contact_parts:
        area = geometry.polygon_area(part)
        x, y = geometry.polygon_centroid(part)
        total += area
        moment += area * (geometry.polygon_inertia(part) + x * x + y * y)
    return moment / total
