"""`ContactParameters`: friction and pressure of a contact, with how sure one is of them."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, fields, replace
from functools import cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from pushplan.core import geometry
from pushplan.files.safe_files import known_keys, read_data
from pushplan.interaction.quasi_static import QuasiStatic
from pushplan.world import InvalidInputError, RobotModel
from pushplan.world.checked_fields import (
    CheckedFields,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    Shape,
)
from pushplan.world.checks import ArrayRecord, FloatArray, array, choice, integer
from pushplan.world.outline import convex_outline

SUPPORTS = ("unknown", "evenly", "corners")
"""Ways to stand on the ground: not known, with even pressure, on the corners of the outline."""
_UNKNOWN_SPREADS = (0.4, 0.5, 0.4)  # of the logarithms of what nobody has measured
_KNOWN_SPREAD = 0.15  # of that of a gyration computed from the support
_LEAST_SPREAD = 0.2  # of that of a friction from a table: surfaces differ
_PARTS_OF_AN_EDGE = 16
_LEFT_OVER = 0.1  # of the inscribed radius of a part that is shrunk [1]


@dataclass(frozen=True, eq=False)
class ContactParameters(ArrayRecord, CheckedFields):
    """Parameters of `QuasiStatic`, with the covariance of their logarithms.

    The defaults are wide: friction has the mean and the spread of the pairs of ``materials.yaml``
    without ice, Teflon and rubber.

    Args:
        friction: Coulomb coefficient between robot and objects.
        gyration_scale: factor on the radius of the limit surface; see `QuasiStatic`.
        static_friction: Coulomb coefficient between objects and walls.
        log_covariance: (3, 3) of the logarithms of the three.
        overlap: by how much the outlines of robot and object overlap where they are in contact, as
            observed [m]; negative where a gap is seen. `fitted` corrects a robot by it.
        overlap_deviation: its standard deviation [m].
        miss: mean distance between observed and predicted ends of the pushes, plus the radius of
            gyration times the difference of the headings [m]; 0 where none was observed.
        pushes: number of pushes that they were identified from.
        saw_walls: friction at walls was observed; else `static_friction` is the prior's.

    Raises:
        InvalidInputError: if a value is out of range.
    """

    friction: PositiveFloat = 0.43
    gyration_scale: PositiveFloat = 1.0
    static_friction: PositiveFloat = 0.43
    log_covariance: Annotated[FloatArray, Shape(3, 3)] = field(
        default_factory=lambda: np.diag(np.square(_UNKNOWN_SPREADS))
    )
    overlap: float = 0.0
    overlap_deviation: NonNegativeFloat = 0.0
    miss: NonNegativeFloat = 0.0
    pushes: NonNegativeInt = 0
    saw_walls: bool = False

    @classmethod
    def prior(
        cls,
        materials: str | None = None,
        support: str | ArrayLike = "unknown",
        outline: ArrayLike | None = None,
    ) -> ContactParameters:
        """What is known before the first push.

        Args:
            materials: of robot and object, as ``"metal on wood"``; any if None.
            support: one of `SUPPORTS`, or (N, 2) points that the object stands on [m], in the body
                frame.
            outline: (N, 2) of the object in its body frame [m]; needed unless the support is
                unknown.

        Raises:
            UnknownNameError: if the table has no such materials.
            InvalidInputError: if there is no such support.
        """
        friction = cls.friction
        spreads = [*_UNKNOWN_SPREADS]
        if materials is not None:
            least, greatest = _friction_range(materials)
            friction = math.sqrt(least * greatest)
            spreads[0] = max(math.log(greatest / least) / 4.0, _LEAST_SPREAD)
        scale = 1.0
        if not (isinstance(support, str) and choice("support", support, SUPPORTS) == "unknown"):
            if outline is None:
                raise InvalidInputError("a support needs the outline of the object")
            scale = support_gyration(outline, support)
            spreads[1] = _KNOWN_SPREAD
        return cls(friction, scale, friction, np.diag(np.square(spreads)))

    def model(self, **settings: Any) -> QuasiStatic:
        """The interaction model with these values.

        Args:
            settings: numerical settings of `QuasiStatic`.
        """
        return QuasiStatic(
            friction=self.friction,
            gyration_scale=self.gyration_scale,
            static_friction=self.static_friction,
            **settings,
        )

    def samples(self, count: int, rng: np.random.Generator) -> list[ContactParameters]:
        """Parameters drawn from the distribution, each certain of itself."""
        logs = rng.multivariate_normal(
            np.log(self.values), self.log_covariance, integer("count", count, low=0)
        )
        drawn = []
        for friction, scale, static_friction in np.exp(logs).tolist():
            one = replace(self, friction=friction, gyration_scale=scale)
            drawn.append(
                replace(one, static_friction=static_friction, log_covariance=np.zeros((3, 3)))
            )
        return drawn

    @property
    def values(self) -> FloatArray:
        """(3,) friction, scale of the gyration, friction at walls."""
        return np.array([self.friction, self.gyration_scale, self.static_friction])

    @property
    def deviations(self) -> FloatArray:
        """(3,) their standard deviations."""
        return self.values * np.sqrt(np.diag(self.log_covariance))

    def fitted(self, robot: RobotModel) -> RobotModel:
        """The robot with a footprint that touches objects where they were observed to be touched.

        Each part shrinks by `overlap`, or grows, and keeps a tenth of its inscribed radius.
        """
        from shapely import Polygon, maximum_inscribed_circle

        parts = []
        for part in robot.parts:
            polygon = Polygon(part)
            radius = maximum_inscribed_circle(polygon).length
            by = min(self.overlap, (1.0 - _LEFT_OVER) * radius)
            shrunk = polygon.buffer(-by, join_style="mitre")
            parts.append(np.array(shrunk.exterior.coords)[:-1][::-1])
        return replace(robot, parts=tuple(parts))

    def save(self, path: str | Path) -> None:
        """Write to a file of JSON, which `load` reads."""
        Path(path).write_text(json.dumps(self.to_dict(), indent=1) + "\n", encoding="utf-8")

    def to_dict(self) -> dict[str, Any]:
        """All fields as JSON has them."""
        return {**vars(self), "log_covariance": self.log_covariance.tolist()}

    @classmethod
    def load(cls, path: str | Path) -> ContactParameters:
        """Read what `save` wrote.

        Raises:
            SchemaError: if the file is missing, or holds something else.
        """
        data = read_data(path, "contact parameters")
        names = tuple(one.name for one in fields(cls))
        known_keys(str(path), data, names, names)
        return cls(**data)


@cache
def _materials() -> dict[str, Any]:
    table: dict[str, Any] = read_data(Path(__file__).with_name("materials.yaml"), "materials")
    return table


def _friction_range(materials: str) -> tuple[float, float]:
    """Least and greatest coefficient of a pair of materials, in any order."""
    table = _materials()
    turned = " on ".join(reversed(materials.split(" on ")))
    if turned in table:
        materials = turned
    low, high = table[choice("materials", materials, tuple(table))]["friction"]
    return low, high


def support_gyration(outline: ArrayLike, support: str | ArrayLike) -> float:
    """The scale of the gyration of an object from how it stands on the ground.

    The radius of the limit surface is c = tau_max / f_max: the mean distance of the pressure from
    its centre (Goyal, Ruina and Papadopoulos 1991). On three points the balance of moments gives
    the pressure; on more, the one that is nearest to equal.

    Args:
        outline: (N, 2) in the body frame, whose origin is the centre of mass [m].
        support: ``"evenly"``, ``"corners"``, or (N, 2) points in the body frame [m].

    Raises:
        InvalidInputError: if the object does not stand on these points, or the support is unknown.
    """
    corners = convex_outline("outline", outline)
    inertia = math.sqrt(geometry.polygon_inertia(corners))
    if isinstance(support, str):
        if choice("support", support, SUPPORTS[1:]) == "evenly":
            return _mean_distance(corners) / inertia
        support = corners
    points: FloatArray = array("support", support, (None, 2))
    balance = np.vstack([points.T, np.ones(len(points))])
    equal = np.full(len(points), 1.0 / max(len(points), 1))
    off = np.array([0.0, 0.0, 1.0]) - balance @ equal
    weights = equal + np.linalg.pinv(balance) @ off
    if len(points) < 3 or weights.min() < 0.0 or not np.allclose(balance @ weights, [0, 0, 1]):
        raise InvalidInputError("support must hold points around the object's centre of mass")
    return float(weights @ np.hypot(points[:, 0], points[:, 1])) / inertia


def _mean_distance(corners: FloatArray) -> float:
    """Mean distance of the points of an outline from the origin inside it [m]."""
    nodes, weights = np.polynomial.legendre.leggauss(_PARTS_OF_AN_EDGE)
    area = total = 0.0
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        twice = float(a[0] * b[1] - a[1] * b[0])  # area of the triangle with the origin
        along = a + 0.5 * (nodes[:, None] + 1.0) * (b - a)
        area += 0.5 * twice
        total += twice / 3.0 * float(weights @ np.hypot(along[:, 0], along[:, 1])) / 2.0
    return total / area
