"""NAMO: drive to the goal through rooms whose doors are held by boxes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from pushplan.envs.tasks.maze import MazeTask
from pushplan.envs.tasks.namo_layout import LAYOUTS, ROOM, NamoLayout, Opening, box_outline
from pushplan.envs.tasks.namo_proof import proves
from pushplan.envs.tasks.presets import read_presets
from pushplan.envs.tasks.variations import TaskVariations
from pushplan.world import BUMPERS, GoalDisc, Movables, ScenarioError, World
from pushplan.world.checked_fields import OneOf, PositiveFloat

PRESETS = read_presets("namo")
_TRIES = 500
_ROOMS = 3  # at most


@dataclass(frozen=True, kw_only=True)
class NamoVariations(TaskVariations):
    """Variations of the NAMO task; None leaves the preset's value."""

    task = "namo"

    layout: Annotated[str, OneOf(tuple(LAYOUTS))] = "one_box"  # name of the layout of the doors
    # claim to the policy about which boxes do not move: the truth, that all of them move, or the
    # opposite of the truth
    movability: Annotated[str, OneOf(("known", "unknown", "wrong"))] = "known"
    box_size: PositiveFloat | None = None  # side of a plain box [m]
    # of the testbed's robot, one of `pushplan.world.BUMPERS`
    bumper: Annotated[str, OneOf(BUMPERS)] | None = None
    time_limit: PositiveFloat | None = None  # when the episode is cut off [s]


class NamoTask(MazeTask):
    """Navigation among movable obstacles: the way to the goal is closed, and can be opened.

    A maze of rooms in a row. Rewards and ends are those of the `MazeTask`. Lengths go with the
    width of the robot. Each start has an `opening` that proves that there is a way: boxes that
    are pushed straight, one step after another, with room for the robot behind them, after which
    a disc around the robot gets to the goal. Before it the robot gets there in no heading.
    """

    name = "namo"
    presets = tuple(PRESETS)
    actions: ClassVar[tuple[str, ...]] = ("velocity", "wheels")
    preset_table = PRESETS
    variation_class = NamoVariations  # type: ignore[assignment]
    variations: NamoVariations  # type: ignore[assignment]

    opening: tuple[Opening, ...] = ()
    """The proof of the last start; `Opening.by` in metres."""

    def _lay_out(self) -> None:
        self.unit = float(np.ptp(self.robot.vertices[:, 1])) / 1.2
        """Unit of the layout [m]."""
        self.reach = 2.0 * self.unit * float(np.hypot(_ROOMS * ROOM[0], ROOM[1]))

    def start(self, rng: np.random.Generator) -> World:
        """A new start: rooms, doors and the boxes that hold them, the robot and the goal."""
        self._steps = 0
        draw = LAYOUTS[self.variations.layout]
        unit = self.unit
        size = 1.0
        if self.variations.box_size is not None:
            size = self.variations.box_size / unit
        for _ in range(_TRIES):
            layout = draw(rng, size)
            world = self._world(rng, layout)
            opening = tuple(
                Opening(step.boxes, (unit * step.by[0], unit * step.by[1]))
                for step in layout.openings
            )
            if proves(world, opening):
                self.opening = opening
                assert isinstance(world.goal, GoalDisc)
                self.static = world.static
                self.goal = world.goal
                self.__dict__.pop("field", None)
                self.__dict__.pop("_farthest", None)
                return world
        raise ScenarioError(
            f"namo: no start of layout {self.variations.layout!r} was found that can be opened; "
            "try boxes of another size"
        )

    def _world(self, rng: np.random.Generator, layout: NamoLayout) -> World:
        unit = self.unit
        width = ROOM[1]
        end = layout.bounds[2]
        robot = rng.uniform((1.2, 1.2, -np.pi), (3.0, width - 1.2, np.pi))
        goal = rng.uniform((end - 2.2, 1.5), (end - 1.5, width - 1.5))
        areas = np.array([length * wide for length, wide in layout.sizes])
        mass = self.preset.box_mass
        if mass is None:
            mass = unit**2
        boxes = Movables.from_outlines(
            [box_outline(size, unit) for size in layout.sizes],
            np.column_stack([unit * np.array(layout.places), np.zeros(len(areas))]),
            masses=mass * areas,
            fixed=[k in layout.fixed for k in range(len(areas))],
        )
        return World(
            robot=self.robot,
            robot_pose=robot * (unit, unit, 1.0),
            static=layout.static(unit),
            movables=boxes,
            goal=GoalDisc(unit * goal, unit),
        )

    def told(self, world: World) -> World:
        """The scene with the movability of the boxes known, unknown or wrong."""
        world = super().told(world)
        if self.variations.movability == "known":
            return world
        fixed = world.movables.fixed
        told = np.zeros(len(fixed), dtype=bool)
        if self.variations.movability == "wrong":
            told = np.logical_not(fixed)
        return world.believing(told)
