"""Rearrange: push every object to a place and a heading of its own."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np

from pushplan.envs.tasks.presets import read_presets
from pushplan.envs.tasks.room import RoomTask, WorldVariations
from pushplan.observation import ObservationBuilder, StateObservation
from pushplan.scenarios import generate_rearrangement, load_relopush
from pushplan.scenarios.rearrangement import (
    ARRANGEMENTS,
    HEADING_TOLERANCE,
    MOST_OBJECTS,
    RELOPUSH_ROOM,
    SHAPES,
)
from pushplan.world import BUMPERS, World
from pushplan.world.checked_fields import Limits, NonNegativeInt, OneOf, PositiveFloat

PRESETS = read_presets("rearrange")
_SECONDS_EACH = 120.0  # time limit for each object


@dataclass(frozen=True, kw_only=True)
class RearrangeVariations(WorldVariations):
    """Variations of the Rearrange task; None leaves the preset's value."""

    task = "rearrange"

    objects: Annotated[int, Limits(1, MOST_OBJECTS)] = 8  # that have a place
    shape: Annotated[str, OneOf(SHAPES)] = "box"  # of the objects
    # places at random, or each where another object starts
    arrangement: Annotated[str, OneOf(ARRANGEMENTS)] = "random"
    obstacles: NonNegativeInt = 0  # objects that may be anywhere in the end
    room: PositiveFloat | None = None  # side of the square room [m]
    tolerance: PositiveFloat = 0.02  # of the positions [m]
    # to either side [rad]
    heading_tolerance: Annotated[float, Limits(0.0, math.pi, open_low=True)] = HEADING_TOLERANCE
    # of ReloPush, whose room and objects then count, and the number of one, drawn if None
    instances: str | None = None
    instance: NonNegativeInt | None = None
    robot: str | None = None  # one of the preset's robots, or one of a user's
    bumper: Annotated[str, OneOf(BUMPERS)] | None = None  # of the robot


class RearrangeTask(RoomTask):
    """Boxes or T shapes in a room, each with a place and a heading, and a robot that pushes.

    Rewards and ends are those of the `RoomTask`. An episode is cut off after 120 s for each object.
    """

    name = "rearrange"
    goal_kind = "objects"
    presets = tuple(PRESETS)
    observations: ClassVar[tuple[str, ...]] = ("state", "image")

    image_channels = ("footprint", "movable", "static")

    preset_table = PRESETS
    variations: RearrangeVariations
    variation_class = RearrangeVariations

    def _prepare(self) -> None:
        self._make_robot()
        wanted = self.variations
        self._side = wanted.room or self.preset.room
        self.state_objects = max(self.state_objects, wanted.objects + wanted.obstacles)
        room = (self._side, self._side)
        if wanted.instances is not None:
            room = RELOPUSH_ROOM
        self.reach = 2.0 * math.hypot(*room)
        if wanted.instances is not None:  # a file that is not there is refused before a start
            load_relopush(wanted.instances, 0, robot=self.robot)

    def observation(self, name: str) -> ObservationBuilder:
        """The builder of an observation by name; states say where each object belongs."""
        builder = super().observation(name)
        if isinstance(builder, StateObservation):
            return replace(builder, places=True)
        return builder

    def start(self, rng: np.random.Generator) -> World:
        """A new room, or the next instance of the file."""
        wanted = self.variations
        tolerances = {
            "tolerance": wanted.tolerance,
            "heading_tolerance": wanted.heading_tolerance,
        }
        if wanted.instances is not None:
            index = wanted.instance
            if index is None:
                index = int(rng.integers(0, 2**31))
            world = load_relopush(wanted.instances, index, robot=self.robot, **tolerances)
        else:
            world = generate_rearrangement(
                rng,
                robot=self.robot,
                objects=wanted.objects,
                shape=wanted.shape,
                arrangement=wanted.arrangement,
                obstacles=wanted.obstacles,
                room=(self._side, self._side),
                **tolerances,
            )
        self._furnish(world)
        return super().start(rng)

    @property
    def _longest(self) -> float:
        return _SECONDS_EACH * int(self._world.wanted.sum())
