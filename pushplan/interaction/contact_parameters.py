"""`ContactParameters`: friction and pressure of a contact, with how sure one is of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
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

SPREADS = (0.4, 0.5, 0.4)
"""Deviations of the logarithms of friction, gyration and friction at walls before a push."""
_LEAST_SPREAD = 0.2  # of a friction from the table: surfaces of a material differ
_SUPPORT_SPREAD = 0.15  # of a gyration from a known support
_MOST = 100.0  # variance of a logarithm
_LEFT_OVER = 0.1  # of the inscribed radius of a part that is shrunk
_LINES = 64  # from the origin to each edge, for the mean distance of an even pressure


@dataclass(frozen=True, eq=False)
class ContactParameters(ArrayRecord, CheckedFields):
    """Parameters of `QuasiStatic`, with the covariance of their logarithms.

    By default friction has the mean and the spread of the pairs of ``materials.yaml`` without ice,
    Teflon and rubber.

    Args:
        friction: Coulomb coefficient between robot and objects.
        gyration_scale: factor on the radius of the limit surface; see `QuasiStatic`.
        static_friction: Coulomb coefficient between objects and walls.
        log_covariance: (3, 3) of the logarithms of the three.
        overlap: by how much the observed outlines of robot and object overlap in contact [m],
            negative for a gap; `fitted` corrects a robot by it.
        overlap_deviation: its standard deviation [m].
        miss: mean `ObservedPush.miss` of the pushes [m].
        pushes: number of pushes that they were identified from.
        saw_walls: friction at walls was observed; else it is the prior's.

    Raises:
        InvalidInputError: if a value is out of range.
    """

    friction: PositiveFloat = 0.43
    gyration_scale: PositiveFloat = 1.0
    static_friction: PositiveFloat = 0.43
    log_covariance: Annotated[FloatArray, Shape(3, 3)] = field(
        default_factory=lambda: np.diag(np.square(SPREADS))
    )
    overlap: float = 0.0
    overlap_deviation: NonNegativeFloat = 0.0
    miss: NonNegativeFloat = 0.0
    pushes: NonNegativeInt = 0
    saw_walls: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        covariance = self.log_covariance
        least = float(np.linalg.eigvalsh(covariance).min())
        if not np.allclose(covariance, covariance.T) or least < -1e-9 or covariance.max() > _MOST:
            raise InvalidInputError(
                "log_covariance must be symmetric, positive semidefinite and at most "
                f"{_MOST:g}, got {covariance.tolist()}"
            )

    @classmethod
    def prior(
        cls,
        materials: str | None = None,
        outline: ArrayLike | None = None,
        support: str | ArrayLike = "evenly",
    ) -> ContactParameters:
        """Return what is known before the first push.

        Args:
            materials: of robot and object, as ``"metal on wood"``; any if None.
            outline: (V, 2) of an object whose support is known [m]; any support if None.
            support: of that object; see `support_gyration`.

        Raises:
            InvalidInputError: if the table has no such materials, or there is no such support.
        """
        friction = cls.friction
        scale = 1.0
        spreads = [*SPREADS]
        if materials is not None:
            table = read_data(Path(__file__).with_name("materials.yaml"), "materials")
            turned = " on ".join(reversed(str(materials).split(" on ")))
            if turned in table:
                materials = turned
            least, greatest = table[choice("materials", materials, tuple(table))]["friction"]
            friction = math.sqrt(least * greatest)
            spreads[0] = max(math.log(greatest / least) / 4.0, _LEAST_SPREAD)
        if outline is not None:
            scale = support_gyration(outline, support)
            spreads[1] = _SUPPORT_SPREAD
        return cls(friction, scale, cls.static_friction, np.diag(np.square(spreads)))

    def model(self) -> QuasiStatic:
        """The interaction model with these values."""
        return QuasiStatic(self.friction, self.gyration_scale, static_friction=self.static_friction)

    def samples(self, count: int, rng: np.random.Generator) -> list[ContactParameters]:
        """Parameters drawn from the distribution, each certain of itself."""
        count = integer("count", count, low=0)
        logs = rng.multivariate_normal(np.log(self.values), self.log_covariance, count)
        certain = replace(self, log_covariance=np.zeros((3, 3)))
        return [
            replace(certain, friction=friction, gyration_scale=scale, static_friction=static)
            for friction, scale, static in np.exp(logs).tolist()
        ]

    @property
    def values(self) -> FloatArray:
        """(3,) friction, scale of the gyration, friction at walls."""
        return np.array([self.friction, self.gyration_scale, self.static_friction])

    @property
    def deviations(self) -> FloatArray:
        """(3,) standard deviations of the values."""
        return self.values * np.sqrt(np.diag(self.log_covariance))

    def fitted(self, robot: RobotModel) -> RobotModel:
        """The robot with a footprint that touches objects where they were felt to be touched.

        Each part shrinks by `overlap`, or grows, and keeps a tenth of its inscribed radius.
        """
        from shapely import Polygon, maximum_inscribed_circle

        parts = []
        for part in map(Polygon, robot.parts):
            by = min(self.overlap, (1.0 - _LEFT_OVER) * maximum_inscribed_circle(part).length)
            shrunk = part.buffer(-by, join_style="mitre")
            parts.append(np.array(shrunk.exterior.coords)[:-1])
        return replace(robot, parts=tuple(parts))

    def to_dict(self) -> dict[str, Any]:
        """All fields, as JSON has them."""
        values = {one.name: getattr(self, one.name) for one in fields(self)}
        return {**values, "log_covariance": self.log_covariance.tolist()}

    @classmethod
    def load(cls, path: str | Path) -> ContactParameters:
        """Read a file of `to_dict` as JSON, such as ``pushplan identify --json`` prints.

        Raises:
            SchemaError: if the file is missing, or holds something else.
        """
        data = read_data(path, "contact parameters")
        names = tuple(one.name for one in fields(cls))
        known_keys(str(path), data, names, names)
        return cls(**data)


def support_gyration(outline: ArrayLike, support: str | ArrayLike = "evenly") -> float:
    """The `gyration_scale` of an object from how it stands on the ground.

    The radius of the limit surface is c = tau_max / f_max, the mean distance of the pressure from
    its centre (Goyal, Ruina and Papadopoulos 1991). The balance of moments gives the pressure on
    three points; on more it is the one nearest to equal.

    Args:
        outline: (V, 2) in the body frame, whose origin is the centre of mass [m].
        support: ``"evenly"``, ``"corners"``, or (N, 2) points in the body frame [m].

    Raises:
        InvalidInputError: if the object cannot stand on the points.
    """
    corners = convex_outline("outline", outline)
    inertia = math.sqrt(geometry.polygon_inertia(corners))
    points: FloatArray = corners
    if not isinstance(support, str):
        points = array("support", support, (None, 2))
    elif choice("support", support, ("evenly", "corners")) == "evenly":
        following = np.roll(corners, -1, axis=0)
        steps = (np.arange(_LINES) + 0.5)[:, None, None] / _LINES
        along = np.linalg.norm(corners + steps * (following - corners), axis=2).mean(axis=0)
        areas = corners[:, 0] * following[:, 1] - corners[:, 1] * following[:, 0]  # of triangles
        return float(2.0 / 3.0 * areas @ along / areas.sum()) / inertia
    balance = np.vstack([points.T, np.ones(len(points))])
    equal = np.full(len(points), 1.0 / max(len(points), 1))
    weights = equal + np.linalg.pinv(balance) @ ([0.0, 0.0, 1.0] - balance @ equal)
    if len(points) < 3 or weights.min() < 0.0 or not np.allclose(balance @ weights, [0, 0, 1]):
        raise InvalidInputError("support must hold points around the object's centre of mass")
    return float(weights @ np.linalg.norm(points, axis=1)) / inertia
