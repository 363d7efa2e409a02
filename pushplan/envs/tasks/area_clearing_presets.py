"""Dimensions of Area-Clearing: the 2D benchmark's and the TurtleBot3 testbed's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

from pushplan.envs.tasks.manipulation import ManipulationPreset
from pushplan.envs.tasks.materials import BENCHMARK_MATERIALS, TESTBED_MATERIALS
from pushplan.world import area_clearing_robot, turtlebot3_burger
from pushplan.world.robots import CONTACT_RADIUS, original_area_clearing_robot


@dataclass(frozen=True)
class ClearingLayout:
    """One room, with its middle and that of the clearance area at the origin."""

    outer: tuple[float, float]  # half the width and half the length of the room [m]
    area: tuple[float, float]  # half the width and half the length of the clearance area [m]
    walls: float = 0.0  # distance of the walls beside the area from the middle [m]; 0 for none
    columns: tuple[tuple[float, float], ...] = ()  # (x, y) of the middles of columns [m]

    def scaled(self, scale: float) -> ClearingLayout:
        """The same layout with every length multiplied by ``scale``."""
        return ClearingLayout(
            (self.outer[0] * scale, self.outer[1] * scale),
            (self.area[0] * scale, self.area[1] * scale),
            self.walls * scale,
            tuple((x * scale, y * scale) for x, y in self.columns),
        )


@dataclass(frozen=True, kw_only=True)
class AreaClearingPreset(ManipulationPreset):
    """One set of dimensions."""

    layouts: Mapping[str, ClearingLayout]  # by name
    column: float  # side of the square columns [m]
    inner_wall: float  # thickness of the walls beside the area [m]
    box_margin: float  # least distance of a box's centre from the edge of the area at the start [m]
    start_margin: float  # distance of the robot's start from the lower edge of the area [m]


_LAYOUTS: Mapping[str, ClearingLayout] = {
    "clear": ClearingLayout((8.0, 8.0), (5.0, 5.0)),
    "clear_small": ClearingLayout((6.0, 6.0), (4.0, 4.0)),
    "walled": ClearingLayout((8.0, 8.0), (5.0, 5.0), walls=6.0),
    "walled_with_columns": ClearingLayout(
        (12.0, 12.0), (7.5, 8.0), walls=8.0, columns=((0.0, -5.0), (0.0, 0.0), (0.0, 5.0))
    ),
}
LAYOUTS = tuple(_LAYOUTS)
_WINDOWS = {"clear": 24.0, "clear_small": 12.0, "walled": 24.0, "walled_with_columns": 24.0}

BENCHMARK = AreaClearingPreset(
    robots={"benchmark": area_clearing_robot},
    bumper=None,
    boxes=dict.fromkeys(LAYOUTS, 10),
    box_size=1.0,
    box_mass=None,
    box_spacing=1.5,
    wall=18.0,  # as far as observations reach
    materials=BENCHMARK_MATERIALS,
    control_step=0.2,
    heading_step=1.5,
    windows=_WINDOWS,
    field_resolution=0.1,
    progress_reward=0.2,
    layouts=_LAYOUTS,
    column=2.0,
    inner_wall=0.2,
    box_margin=1.0,
    start_margin=1.0,
)

_WALL_RADIUS = 0.1

ORIGINAL = replace(
    BENCHMARK,
    robots={"original": original_area_clearing_robot},
    layouts={
        name: replace(one, outer=(one.outer[0] - _WALL_RADIUS, one.outer[1] - _WALL_RADIUS))
        for name, one in _LAYOUTS.items()
    },
    materials=replace(BENCHMARK_MATERIALS, object_static=0.99),
    column=2.0 + 2.0 * _WALL_RADIUS,
    inner_wall=0.2 + 2.0 * _WALL_RADIUS,
    contact_radius=CONTACT_RADIUS,
    touching=True,
)
"""As the 2D benchmark's own code has it; all that is static is larger by its contact radius."""

SCALE = 0.08
"""Length in the testbed of a metre in the benchmark, whose 1 m boxes become 8 cm cubes."""

TESTBED = replace(
    BENCHMARK,
    robots={"turtlebot3": partial(turtlebot3_burger, max_speed=0.2, max_turn_rate=0.785)},
    bumper="pusher",
    box_size=SCALE,
    box_mass=0.075,
    box_spacing=1.5 * SCALE,
    wall=18.0 * SCALE,
    materials=TESTBED_MATERIALS,
    heading_step=1.5 * SCALE,
    windows={name: side * SCALE for name, side in _WINDOWS.items()},
    field_resolution=0.01,
    progress_reward=0.2 / SCALE,  # the same for the same motion
    layouts={name: layout.scaled(SCALE) for name, layout in _LAYOUTS.items()},
    column=2.0 * SCALE,
    inner_wall=0.2 * SCALE,
    box_margin=SCALE,
    start_margin=SCALE,
)

PRESETS: Mapping[str, AreaClearingPreset] = {
    "benchmark": BENCHMARK,
    "testbed": TESTBED,
    "original": ORIGINAL,
}
