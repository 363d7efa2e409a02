"""`Lidar`: a planar laser scanner, and the scans that it makes of a scene."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from pushplan.core import geometry
from pushplan.core import perception as core
from pushplan.errors import short
from pushplan.world import InvalidInputError, Movables, RobotModel, World
from pushplan.world.checked_fields import (
    CheckedFields,
    Fraction,
    Limits,
    NonNegativeFloat,
    PositiveFloat,
    Shape,
)
from pushplan.world.checks import ArrayRecord, BoolArray, FloatArray, IntArray, expect, frozen

_DEFAULT_RANGE = 30.0  # of the sensors of a robot [circumscribed radii]
Angle = Annotated[float, Limits(0.0, math.tau, open_low=True)]


@dataclass(frozen=True, eq=False)
class LidarScan(ArrayRecord, CheckedFields):
    """One scan.

    Args:
        time: when it was taken [s].
        pose: (3,) x, y [m], theta [rad] of the sensor then, world frame.
        bearings: (N,) directions of the beams from the sensor's heading [rad].
        ranges: (N,) distances [m]. From ``range_max`` on nothing was met, and the distance is kept
            as infinite; 0 and NaN are beams that gave nothing, and are kept as NaN (as REP 117).
        range_max: greatest distance that is measured [m].

    Raises:
        InvalidInputError: if a member has the wrong type or shape.
    """

    field_prefix = "scan."

    time: float
    pose: Annotated[FloatArray, Shape(3)]
    bearings: Annotated[FloatArray, Shape("N")]
    ranges: FloatArray
    range_max: PositiveFloat

    def __post_init__(self) -> None:
        super().__post_init__()
        try:
            ranges = np.array(self.ranges, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            ranges = np.full(1, -1.0)
        if ranges.shape != self.bearings.shape or (ranges < 0.0).any():
            raise InvalidInputError(
                f"scan.ranges must be {len(self.bearings)} distances of 0 or more, got "
                f"{short(self.ranges)}"
            )
        ranges[ranges == 0.0] = np.nan
        ranges[ranges >= self.range_max] = np.inf
        object.__setattr__(self, "ranges", frozen(ranges))

    @property
    def points(self) -> FloatArray:
        """(M, 2) places that were hit [m], world frame."""
        hit = np.isfinite(self.ranges)
        angles = self.pose[2] + self.bearings[hit]
        offsets = self.ranges[hit, None] * np.column_stack([np.cos(angles), np.sin(angles)])
        points: FloatArray = self.pose[:2] + offsets
        return points


@dataclass(frozen=True)
class Lidar(CheckedFields):
    """A laser scanner in the middle of the robot, which sees everything at its height.

    Args:
        beams: in a full circle: the angular resolution is 2π over it.
        field_of_view: angle that is scanned, half of it to each side of the heading [rad].
        range: greatest distance that is measured [m].
        noise: standard deviation of a distance [m].
        drop_out: fraction of the beams that give nothing.
    """

    field_prefix: ClassVar[str] = "lidar "

    beams: Annotated[int, Limits(4, 100_000)] = 720
    field_of_view: Angle = math.tau
    range: PositiveFloat = 10.0
    noise: NonNegativeFloat = 0.0
    drop_out: Fraction = 0.0

    @functools.cached_property
    def _kept(self) -> BoolArray:
        """(beams,) which beams of a full circle there are."""
        return np.abs(_turned(self.beams)) <= 0.5 * self.field_of_view + 1e-9

    def scan(self, world: World, rng: np.random.Generator | None = None) -> LidarScan:
        """Scan a scene from the robot's pose.

        Args:
            world: the scene.
            rng: of noise and drop-outs; without it there are none.
        """
        expect("world", world, World)
        outlines = [world.static.packed, object_outlines(world.movables)]
        lengths = ray_lengths(world.robot_pose, self.beams, self.range, outlines)[self._kept]
        ranges = np.where(lengths < self.range, lengths, np.inf)
        if rng is not None:
            expect("rng", rng, np.random.Generator)
            noisy = np.maximum(ranges + self.noise * rng.normal(size=len(ranges)), 0.0)
            ranges = np.where(rng.random(len(ranges)) < self.drop_out, np.nan, noisy)
        bearings = _turned(self.beams)[self._kept]
        return LidarScan(world.time, world.robot_pose, bearings, ranges, self.range)


def _turned(beams: int) -> FloatArray:
    """(N,) directions of the beams of a full circle, in [-pi, pi) [rad]."""
    turn = np.arange(beams) * (math.tau / beams)
    return np.where(turn >= math.pi, turn - math.tau, turn)


def ray_lengths(
    pose: FloatArray, count: int, reach: float, outlines: list[tuple[FloatArray, IntArray]]
) -> FloatArray:
    """(count,) lengths of rays around a pose (3,), beginning ahead, up to what they meet [m]."""
    lengths = np.full(count, reach)
    x, y, heading = pose.tolist()
    for vertices, offsets in outlines:
        core.cast_rays(lengths, x, y, heading, vertices, offsets)
    return lengths


def sensor_range(robot: RobotModel, chosen: float | None) -> float:
    """Range of the sensors of a robot [m]; 30 of its circumscribed radii if nobody chose."""
    return chosen or _DEFAULT_RANGE * robot.circumscribed_radius


def object_outlines(objects: Movables) -> tuple[FloatArray, IntArray]:
    """(V, 2) corners of the parts of objects where they are [m], and where each part starts."""
    corners = np.empty_like(objects.part_vertices)
    poses = objects.poses[objects.part_owners]
    geometry.transform_outlines(poses, objects.part_vertices, objects.part_offsets, corners)
    return frozen(corners), objects.part_offsets
