"""Ship-Ice: take a ship through broken ice to a line ahead, moving little of the ice."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np
import shapely

from pushplan.envs.tasks.base import StepOutcome, Task
from pushplan.envs.tasks.presets import read_presets
from pushplan.envs.tasks.variations import TaskVariations
from pushplan.observation import ImageObservation
from pushplan.scenarios import FloeSizes, IceField, generate_ice, load_ice
from pushplan.world import (
    GoalLine,
    InvalidInputError,
    Movables,
    ScenarioError,
    StaticMap,
    World,
)
from pushplan.world.checked_fields import Fraction, Limits, OneOf, PositiveFloat
from pushplan.world.checks import FloatArray
from pushplan.world.outline import transform

CONCENTRATION = 0.1
"""Concentration of ice where none is asked for, and there is no file."""
_IMAGE_CHANNELS = ("footprint", "movable", "goal_distance", "heading_line")
_PIXELS = 150
_START_TRIES = 500
_REAL_ROUGHNESS = 0.2
_REAL_EXPONENT = 1.8  # of sizes, as Rothrock and Thorndike (1984) found for floes from 0.1 km
_REAL_GREATEST = 2.0  # radius, over that of convex floes
_UP = 0.5 * math.pi


PRESETS = read_presets("ship_ice")


@dataclass(frozen=True, kw_only=True)
class ShipIceVariations(TaskVariations):
    """Variations of the Ship-Ice task; None leaves the preset's value."""

    task = "ship_ice"

    # area of the floes as a fraction of that of the ice field, 0 to 0.5
    concentration: Annotated[float, Limits(0.0, 0.5)] | None = None
    # 0 for ice that is equally likely everywhere, 1 for patches and open water
    clumping: Fraction = 0.6
    # ``"convex"``, or ``"real"``: rough outlines with bays and sizes of a power law, as in images
    floes: Annotated[str, OneOf(("convex", "real"))] = "convex"
    channel_length: PositiveFloat | None = None  # with ice to the same distance from its end [m]
    # distance of the goal line ahead of the start line [m]
    goal_distance: PositiveFloat | None = None
    start_x: float | None = None  # place of the ship on the start line [m]; anywhere if None
    start_heading: float = _UP  # [rad], straight ahead by default
    # ice from a file, as `pushplan.scenarios.load_ice` reads it, instead of random ice
    ice_file: str | None = None
    ice_hull: bool = False  # take the convex hulls of floes of the file that are not convex
    ice_overlaps: bool = False  # take floes of the file that overlap
    time_limit: PositiveFloat | None = None  # when the episode is cut off [s]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.ice_file is not None:
            if self.concentration is not None:
                raise InvalidInputError("concentration and ice_file exclude each other")
            if self.floes != "convex":
                raise InvalidInputError("floes and ice_file exclude each other")


class ShipIceTask(Task):
    """A ship in a channel of broken ice, as in the Bench-Push paper.

    Reward of a step: the cosine of the angle between the ship's heading and the normal of the
    goal line, minus ``work_reward`` times the work on the floes; -50 when the ship's origin leaves
    the channel to a side or behind, +200 at the goal line. The channel has no walls: ice drifts
    out of it freely.
    """

    name = "ship_ice"
    presets = tuple(PRESETS)
    solid_presets = ("full_scale",)
    actions: ClassVar[tuple[str, ...]] = ("turn_rate",)
    observations: ClassVar[tuple[str, ...]] = ("image", "state")

    preset_table = PRESETS
    variations: ShipIceVariations
    variation_class = ShipIceVariations

    def _prepare(self) -> None:
        self._make_robot()
        preset = self.preset
        wanted = self.variations
        self._width, length = preset.channel
        first, last = preset.ice
        beyond = length - last
        longer = wanted.channel_length
        away = wanted.goal_distance
        x = wanted.start_x
        least = preset.goal_y + beyond
        start = preset.start_y
        if longer is not None and longer < least:
            raise ScenarioError(
                f"ship_ice: channel_length must be at least {least:g} m, got {longer:g}"
            )
        length = longer or length
        room = length - start
        if away is not None and away > room:
            raise ScenarioError(
                f"ship_ice: goal_distance must be at most {room:g} m, which is the end of the "
                f"channel, got {away:g}"
            )
        if x is not None and not 0.0 <= x <= self._width:
            raise ScenarioError(
                f"ship_ice: start_x must lie in the channel, [0, {self._width:g}] m, got {x:g}"
            )
        self.ice_bounds = np.array([0.0, first, self._width, length - beyond])
        self.static = StaticMap.build(bounds=[0.0, 0.0, self._width, length])
        goal_y = preset.goal_y if away is None else start + away
        self.goal = GoalLine(np.array([0.5 * self._width, goal_y]), np.array([0.0, 1.0]))
        self.reach = 2.0 * float(np.hypot(self._width, length))
        self._file_ice = self._read_ice()

    def _read_ice(self) -> IceField | None:
        """The floes of the file, which must lie in the channel, or the water that it states."""
        path = self.variations.ice_file
        self.may_overlap = self.variations.ice_overlaps or self.preset.overlaps
        if path is None:
            return None
        try:
            field = load_ice(
                path,
                hull=self.variations.ice_hull,
                overlaps=self.may_overlap,
                within=self.static.bounds,
                place=self._place,
            )
        except InvalidInputError as error:
            raise ScenarioError(f"ship_ice: {error}") from error
        low = self.static.bounds[:2]
        high = self.static.bounds[2:]
        for i, parts in enumerate(() if self._in_channel(field.bounds) else field.floes):
            corners = np.concatenate(parts)
            if (corners < low - 1e-9).any() or (corners > high + 1e-9).any():
                raise ScenarioError(
                    f"ship_ice: {path}: polygon {i} must lie in the channel, x in [0, {high[0]:g}] "
                    f"and y in [0, {high[1]:g}] m; a field that states its water (field_size) is "
                    "turned and moved into it, and its floes may reach across the sides"
                )
        return field

    def _in_channel(self, bounds: FloatArray) -> bool:
        beyond = (bounds - self.static.bounds) * (-1.0, -1.0, 1.0, 1.0)
        return bool((beyond <= 1e-9).all())

    def _place(self, water: FloatArray) -> FloatArray:
        """Pose (3,) at which a field with this water (4,) [m] lies in the channel.

        It stays where it is if it lies in the channel. Otherwise it begins where the preset's ice
        does, midway between the sides; its longer side runs along the channel.
        """
        if self._in_channel(water):
            return np.zeros(3)
        sides = water[2:] - water[:2]
        width = float(sides.min())
        length = float(sides.max())
        low = water[:2]
        turn = 0.0
        if sides[0] > sides[1]:
            low = np.array([-water[3], water[0]])
            turn = _UP
        ice = self.ice_bounds
        most = ice[2:] - ice[:2]
        if width <= most[0] and length <= most[1]:
            return np.array([*((0.5 * (most[0] - width), ice[1]) - low), turn])
        wide = [name for name, preset in PRESETS.items() if preset.channel[0] >= width]
        longest = self.static.bounds[3] - most[1] + max(length, most[1])
        raise InvalidInputError(
            f"its water of {width:g} x {length:g} m does not fit in the ice field of {most[0]:g} x "
            f"{most[1]:g} m; presets that are wide enough: {', '.join(wide) or 'none'}; "
            f"channel_length of this one for the length: {longest:g} m"
        )

    def start(self, rng: np.random.Generator) -> World:
        """A new start: the ship on the start line, then ice that leaves it some room."""
        self._steps = 0
        if self._file_ice is None:
            pose = self._start_pose(rng)
            field = self._random_ice(rng, pose)
        else:
            field = self._file_ice
            pose = self._free_pose(rng, field)
        return World(
            robot=self.robot,
            robot_pose=pose,
            static=self.static,
            movables=Movables.from_polygons(
                field.floes,
                density=self.preset.floe_density,
                contact_radii=self.preset.contact_radius,
            ),
            goal=self.goal,
        )

    def _start_pose(self, rng: np.random.Generator) -> FloatArray:
        margin = self.preset.side_margin
        wanted = self.variations
        anywhere = rng.uniform(margin, self._width - margin)
        x = anywhere if wanted.start_x is None else wanted.start_x
        return np.array([x, self.preset.start_y, wanted.start_heading])

    def _random_ice(self, rng: np.random.Generator, pose: FloatArray) -> IceField:
        fraction = self.variations.concentration
        sizes = FloeSizes(**self.preset.sizes)
        real = self.variations.floes == "real"
        if real:
            greatest = _REAL_GREATEST * sizes.greatest
            sizes = replace(sizes, greatest=greatest, exponent=_REAL_EXPONENT)
        around = np.asarray(self._berth(pose).exterior.coords)[:-1]
        return generate_ice(
            rng,
            bounds=self.ice_bounds,
            concentration=CONCENTRATION if fraction is None else fraction,
            sizes=sizes,
            keep_off=[around],
            clumping=self.variations.clumping,
            roughness=_REAL_ROUGHNESS if real else 0.0,
        )

    def _free_pose(self, rng: np.random.Generator, field: IceField) -> FloatArray:
        """A start that is free of given ice."""
        parts = [part for floe in field.floes for part in floe]
        tree = shapely.STRtree([shapely.Polygon(part) for part in parts])
        for _ in range(_START_TRIES if self.variations.start_x is None else 1):
            pose = self._start_pose(rng)
            if len(tree.query(self._berth(pose), predicate="intersects")) == 0:
                return pose
        raise ScenarioError(
            f"ship_ice: the ice of {self.variations.ice_file} leaves no room for the ship on the "
            f"start line, y = {self.preset.start_y:g} m"
        )

    def _berth(self, pose: FloatArray) -> shapely.Polygon:
        """The water that is free at the start: the hull and some room around it."""
        hull = shapely.Polygon(transform(pose, self.robot.parts[0]))
        return hull.buffer(self.preset.clearance, join_style="mitre").convex_hull

    def score(
        self, before: World, after: World, *, work: float, touched_static: bool
    ) -> StepOutcome:
        """The reward above; to leave the channel is a failure even beyond the goal line."""
        x, y, heading = after.robot_pose.tolist()
        ahead = math.cos(heading) * self.goal.normal[0] + math.sin(heading) * self.goal.normal[1]
        reward = float(ahead) - self.preset.work_reward * work
        outside = x < 0.0 or x > self._width or y < 0.0
        return self._driven(reward, after, failure="left_channel" if outside else "")

    def _image(self, name: str) -> ImageObservation:
        side = self.preset.window
        pixels = (_PIXELS, _PIXELS)
        return ImageObservation(_IMAGE_CHANNELS, (side, side), pixels, True, self.preset.shift)
