"""How far robot and box stay from static things under a command."""

from __future__ import annotations

import math

import numpy as np

from pushplan.geometry.obstacles import obstacles_of
from pushplan.planners.pushing import clearance_kernels
from pushplan.planners.pushing.clearance_kernels import ClearanceProblem
from pushplan.planners.pushing.contact_kernels import Contact
from pushplan.world import RobotModel, StaticMap
from pushplan.world.checks import FloatArray, frozen
from pushplan.world.outline import flatten

_NEARER = 1e-6  # what is nearer than the clearance already may come this much nearer [R]


class Clearance:
    """Keeps a robot, and the box in front of it, off a static map.

    Args:
        robot: its footprint.
        static: what must not be touched.
        least: distance to keep [m].
        outline: (N, 2) corners of the box [m].
        face: direction of the pushed face's normal in the box's frame [rad].
    """

    def __init__(
        self,
        robot: RobotModel,
        static: StaticMap,
        least: float,
        outline: FloatArray,
        face: float,
    ) -> None:
        c, s = math.cos(face), math.sin(face)
        turned = outline @ np.array([[c, -s], [s, c]])  # in the frame of the face
        parts = [*robot.parts, turned]
        vertices, offsets = flatten(parts)
        reach = np.hypot(vertices[:, 0], vertices[:, 1])
        self._problem = ClearanceProblem(
            vertices,
            offsets,
            len(robot.parts),
            frozen(np.maximum.reduceat(reach, offsets[:-1])),
            least,
            _NEARER * robot.circumscribed_radius,
            obstacles_of(static),
        )

    def free_fraction(
        self, contact: Contact, state: FloatArray, v: float, w: float, duration: float
    ) -> float:
        """Fraction of ``duration`` [s] for which a command may be driven, 0 to 1.

        Args:
            contact: bumper, face and friction.
            state: (6,) where it begins.
            v: [m/s].
            w: [rad/s].
            duration: how far to look ahead [s].
        """
        return float(clearance_kernels.free_fraction(contact, state, v, w, duration, self._problem))
