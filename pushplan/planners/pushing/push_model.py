"""`PushModel`: where a box goes when a robot with a bumper drives against it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from pushplan.core import pushing as core
from pushplan.planners.pushing.bumper import Bumper, Face, face_towards
from pushplan.planners.pushing.parameters import (
    PushParameters,
    pressure_radius,
    stable_curvature,
)
from pushplan.world import InvalidInputError, RobotModel
from pushplan.world.checked_fields import CheckedFields, Shape
from pushplan.world.checks import ArrayRecord, FloatArray, array, expect, number
from pushplan.world.outline import centroid, convex_outline

_MOST_HOLLOW = 0.7  # greatest curvature times depth of a box: a box fits into the bumper's hollow


@lru_cache(maxsize=256)
def _radius(outline: bytes) -> float:
    return pressure_radius(np.frombuffer(outline).reshape(-1, 2))


@dataclass(frozen=True, eq=False)
class PushState(ArrayRecord, CheckedFields):
    """Robot and box while the box is in front of the bumper.

    Args:
        robot_pose: (3,) x, y [m], theta [rad].
        offset: of the box's centre to the left of the robot's x axis [m].
        angle: of the pushed face's inward normal against the robot's heading [rad].
        gap: between bumper and box along the robot's x axis [m].
    """

    robot_pose: Annotated[FloatArray, Shape(3)]
    offset: float
    angle: float
    gap: float = 0.0

    field_prefix: ClassVar[str] = "push state "

    def row(self) -> FloatArray:
        """(6,) as the core reads it."""
        return np.array([*self.robot_pose, self.offset, self.angle, max(self.gap, 0.0)])

    @classmethod
    def from_row(cls, row: FloatArray) -> PushState:
        """The inverse of `row`."""
        return cls(row[:3], float(row[3]), float(row[4]), float(row[5]))


class PushModel:
    """Quasi-static pushing of one convex box by a bumper, under Coulomb friction.

    Args:
        robot: whose bumper pushes; a `RobotModel`, or its `Bumper`.
        outline: (N, 2) convex corners of the box, from its centroid [m].
        parameters: friction.
        face: which side is pushed; the one that faces -x if None.
        radius: c, the greatest torque over the greatest force of the ground under uniform pressure
            [m]; that under the outline if None. Where it is given, the centre of pressure is the
            origin of the outline, which may be the hull of something else.

    Raises:
        InvalidInputError: if the outline is not convex, or its centroid is not at its origin and
            there is no radius.
    """

    def __init__(
        self,
        robot: RobotModel | Bumper,
        outline: ArrayLike,
        parameters: PushParameters | None = None,
        face: Face | None = None,
        radius: float | None = None,
    ) -> None:
        self.bumper = robot if isinstance(robot, Bumper) else Bumper.of(robot)
        self.outline = convex_outline("outline", outline)
        middle = centroid(self.outline)
        if radius is None and np.abs(middle).max() > 1e-6 * np.abs(self.outline).max():
            raise InvalidInputError(
                f"outline must have its centroid at the origin, got {middle.tolist()}"
            )
        if radius is None:
            radius = _radius(self.outline.tobytes())
        self.parameters = PushParameters() if parameters is None else parameters
        expect("parameters", self.parameters, PushParameters)
        self.face = face_towards(self.outline, 0.0) if face is None else face
        expect("face", self.face, Face)
        self.contact = core.BoxContact(
            self.bumper.front,
            self.bumper.half,
            min(self.bumper.curvature, _MOST_HOLLOW / self.face.depth),
            self.face.depth,
            self.face.low,
            self.face.high,
            self.parameters.spread * number("radius", radius, low=0.0, open_low=True),
            self.parameters.friction,
        )

    @property
    def reach(self) -> float:
        """From the axle to the centre of a box that lies on the middle of the bumper [m]."""
        return self.bumper.front + self.face.depth

    def stable_curvature(self, offset: float = 0.0) -> float:
        """`stable_curvature` of a box at an offset [m] on this bumper, as if straight [1/m]."""
        low, high = self.contact.line(number("offset", offset))
        return stable_curvature(
            self.parameters.friction,
            reach=self.bumper.front,
            depth=self.face.depth,
            half=min(-low, high),
            c=self.contact.spread,
        )

    def state(self, robot_pose: ArrayLike, box_pose: ArrayLike) -> PushState:
        """The state of a robot and a box at poses (3,) x, y [m], theta [rad]."""
        robot: FloatArray = array("robot_pose", robot_pose, (3,))
        box: FloatArray = array("box_pose", box_pose, (3,))
        return PushState.from_row(self.contact.observe(self.face.normal, robot, box))

    def box_pose(self, state: PushState) -> FloatArray:
        """(3,) pose of the box."""
        pose: FloatArray = self.contact.box_pose(state.row())
        pose[2] -= self.face.normal
        return pose

    def rows(
        self, state: PushState, twists: ArrayLike, dt: ArrayLike | float
    ) -> tuple[FloatArray, FloatArray]:
        """Predict states under commands.

        Args:
            state: where it begins.
            twists: (N, 2) forward speeds [m/s] and turn rates [rad/s].
            dt: how long each is held [s], one number or (N,).

        Returns:
            States (N + 1, 6) as `PushState.row`, and (N, 6) how the box moves at the end of each
            command: speeds along and across the face's normal [m/s], turn rate [rad/s], centre of
            pressure on the face [m], mode (free 0, sticks 1, slides 2; the same on a corner 3 and
            4), and friction over normal force.
        """
        commands = array("twists", twists, (None, 2))
        count = len(commands)
        if np.ndim(dt):
            steps = array("dt", dt, (count,))
        else:
            steps = np.full(count, number("dt", dt))
        if (steps <= 0.0).any():
            raise InvalidInputError(f"dt must be positive, got {steps.min()}")
        row = expect("state", state, PushState).row()
        states = np.empty((count + 1, 6))
        motions = np.empty((count, 6))
        self.contact.roll_out(row, commands, steps, states, motions)
        return states, motions
