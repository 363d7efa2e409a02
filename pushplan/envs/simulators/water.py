"""Drag on floating bodies that move in the plane of the water."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from pushplan.geometry import polygon_area
from pushplan.world import World
from pushplan.world.checks import FloatArray, frozen, number


@dataclass(frozen=True)
class Water:
    """How water brakes bodies: ``F = -(b + c |v|) v``, and likewise about the vertical axis.

    Args:
        density: of the water [kg/m³].
        robot_draught: how deep the robot reaches [m].
        object_draught: how deep an object reaches [m].
        robot_drag: quadratic drag coefficient C_d of the robot.
        object_drag: of an object.
        robot_yaw_drag: quadratic drag coefficient of the robot's rotation.
        object_yaw_drag: of an object's rotation.
        robot_linear: linear coefficient b of the robot [N s/m], and [N m s] for its rotation.
        object_linear: of an object.
    """

    density: float = 1025.0
    robot_draught: float = 5.0
    object_draught: float = 1.0
    robot_drag: float = 0.5
    object_drag: float = 1.1
    robot_yaw_drag: float = 10.0
    object_yaw_drag: float = 2.0
    robot_linear: float = 1.0
    object_linear: float = 1.5

    def __post_init__(self) -> None:
        for field in fields(self):
            value = number(f"water {field.name}", getattr(self, field.name), low=0.0)
            object.__setattr__(self, field.name, value)

    def coefficients(self, world: World) -> FloatArray:
        """Drag of the robot, then of each object.

        Returns:
            (1 + K, 4): linear [N s/m] and quadratic [N s²/m²] coefficient of the translation,
            linear [N m s] and quadratic [N m s²] of the rotation. The area that a body turns
            against the flow is its equivalent diameter times its draught; the lever of the
            rotation is its equivalent radius.
        """
        areas = np.array(
            [sum(polygon_area(part) for part in world.robot.parts)]
            + [polygon_area(world.movables.outline(k)) for k in range(len(world.movables))]
        )
        radii = np.sqrt(areas / np.pi)
        first = np.arange(len(areas)) == 0
        draught = np.where(first, self.robot_draught, self.object_draught)
        linear = np.where(first, self.robot_linear, self.object_linear)
        form = np.where(first, self.robot_drag, self.object_drag)
        yaw = np.where(first, self.robot_yaw_drag, self.object_yaw_drag)
        front = 0.5 * self.density * 2.0 * radii * draught
        return frozen(np.stack([linear, form * front, linear, yaw * front * radii**3], axis=1))
