"""`Detector`: which objects a robot sees from where it is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np

from pushplan.perception.lidar import Angle, object_outlines, ray_lengths
from pushplan.world import Movables, World
from pushplan.world.checked_fields import (
    CheckedFields,
    Fraction,
    NonNegativeFloat,
    PositiveFloat,
)
from pushplan.world.checks import FloatArray, expect

_RAYS = 720  # in a full circle, by which the visible part of an outline is measured


@dataclass(frozen=True, eq=False)
class Detections(CheckedFields):
    """Objects that were seen at one time.

    Args:
        time: when [s].
        objects: those that were seen, with their whole outlines.

    Raises:
        InvalidInputError: if a member has the wrong type.
    """

    field_prefix: ClassVar[str] = "detections."

    time: float
    objects: Movables


@dataclass(frozen=True)
class Detector(CheckedFields):
    """A detector of objects, which knows their shapes and completes the outline that it sees.

    An object is reported where enough of its side that faces the robot is in view, with an id
    that lasts. It says nothing of whether the object can be moved.

    Args:
        field_of_view: half of it to each side of the heading [rad].
        range: greatest distance [m].
        least_visible: fraction of the visible angle of an object that has to be in view.
        position_noise: standard deviation of x and y [m].
        heading_noise: the same of the heading [rad].
        miss_rate: fraction of the objects in view that are not reported.
    """

    field_prefix: ClassVar[str] = "detector "

    field_of_view: Angle = math.tau
    range: PositiveFloat = 10.0
    least_visible: Fraction = 0.3
    position_noise: NonNegativeFloat = 0.0
    heading_noise: NonNegativeFloat = 0.0
    miss_rate: Fraction = 0.0

    def detect(self, world: World, rng: np.random.Generator | None = None) -> Detections:
        """Look at a scene from the robot's pose.

        Args:
            world: the scene.
            rng: of noise and misses; without it there are none.
        """
        visible = self.visible(world)
        seen = (visible > 0.0) & (visible >= self.least_visible)
        objects = world.movables
        poses = np.array(objects.poses)
        if rng is not None:
            expect("rng", rng, np.random.Generator)
            place = self.position_noise
            poses += np.array([place, place, self.heading_noise]) * rng.normal(size=poses.shape)
            seen &= rng.random(len(poses)) >= self.miss_rate
        fixed = np.zeros(len(poses), dtype=np.bool_)
        return Detections(world.time, objects.moved_to(poses).holding_fixed(fixed).select(seen))

    def visible(self, world: World) -> FloatArray:
        """(K,) fraction of each object's angle, as seen from the robot, that nothing hides.

        0 for one beyond the range or outside the field of view.
        """
        objects = expect("world", world, World).movables
        pose = world.robot_pose
        away = np.hypot(*(objects.poses[:, :2] - pose[:2]).T)
        near = np.flatnonzero(away - objects.radii < self.range)
        found = np.zeros(len(objects))
        if not len(near):
            return found
        objects = objects.select(near)
        corners, starts = object_outlines(objects)
        everything = [world.static.packed, (corners, starts)]
        lengths = ray_lengths(pose, _RAYS, self.range, everything)
        turns = np.arange(_RAYS) * (math.tau / _RAYS)
        in_view = np.abs(np.remainder(turns + math.pi, math.tau) - math.pi)
        in_view = in_view <= 0.5 * self.field_of_view + 1e-9
        bounds = np.searchsorted(objects.part_owners, np.arange(len(objects) + 1))
        for k, (first, last) in enumerate(pairwise(bounds.tolist())):
            part = corners, starts[first : last + 1]
            own = ray_lengths(pose, _RAYS, math.inf, [part])
            facing = np.isfinite(own)
            shown = facing & (own < self.range) & (own <= lengths + 1e-9) & in_view
            found[near[k]] = shown.sum() / max(int(facing.sum()), 1)
        return found
