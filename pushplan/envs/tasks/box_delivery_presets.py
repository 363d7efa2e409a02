"""Dimensions of Box-Delivery: the 2D benchmark's and the TurtleBot3 testbed's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np

from pushplan.envs.tasks.manipulation import ManipulationPreset
from pushplan.envs.tasks.materials import BENCHMARK_MATERIALS, TESTBED_MATERIALS
from pushplan.world import box_delivery_robot, jackal, turtlebot3_burger
from pushplan.world.checks import FloatArray
from pushplan.world.outline import grown_outline
from pushplan.world.robots import CONTACT_RADIUS, original_box_delivery_robot

LAYOUTS = ("small_empty", "small_columns", "large_columns", "large_divider")


@dataclass(frozen=True, kw_only=True)
class BoxDeliveryPreset(ManipulationPreset):
    """One set of dimensions. Rooms have their middle at the origin."""

    # length along x and width along y of the room by layout [m]
    rooms: Mapping[str, tuple[float, float]]
    receptacle: float  # side of the square receptacle in the corner at +x, +y [m]
    # pieces that fill the other corners: (3, 2) corners each about the room's corner, with the room
    # at +x and +y [m]
    corner: tuple[FloatArray, ...]
    columns: Mapping[str, int]  # greatest number of columns by layout
    column: float  # side of the square columns [m]
    column_spacing: float  # least distance between the centres of two columns [m]
    column_margin: float  # least way between a column and the walls [m]
    # length, as a fraction of the room's, and thickness of the divider [m]
    divider: tuple[float, float]
    divider_margin: float  # least distance of its centre line from the walls along it [m]
    start_margin: float  # distance of a fixed start from the wall at -x [m]
    still: float  # a robot that moves less than this in an action has not moved [m]


def _triangle(leg: float) -> tuple[FloatArray, ...]:
    return (np.array([(0.0, 0.0), (leg, 0.0), (0.0, leg)]),)


def _fillet(leg: float, grown: float) -> tuple[FloatArray, ...]:
    """Three triangles under a chain of chords, each larger by a contact radius [m]."""
    s, c = 0.5 * leg * np.sin(np.pi / 8.0), 0.5 * leg * np.cos(np.pi / 8.0)
    rim = [(0.0, leg), (s, leg - c), (leg - c, s), (leg, 0.0)]
    fan = [np.array([(0.0, 0.0), after, before]) for before, after in pairwise(rim)]
    return tuple(grown_outline(piece, grown) for piece in fan)


BENCHMARK = BoxDeliveryPreset(
    robots={"benchmark": box_delivery_robot},
    bumper=None,
    boxes={"small_empty": 10, "small_columns": 10, "large_columns": 20, "large_divider": 20},
    box_size=0.44,
    box_mass=None,
    box_spacing=0.62,
    wall=7.5,  # as far as observations reach
    materials=BENCHMARK_MATERIALS,
    control_step=0.2,
    heading_step=1.75,
    windows=dict.fromkeys(LAYOUTS, 10.0),
    field_resolution=0.1,
    progress_reward=0.2,
    rooms={
        "small_empty": (10.0, 5.0),
        "small_columns": (10.0, 5.0),
        "large_columns": (10.0, 10.0),
        "large_divider": (10.0, 10.0),
    },
    receptacle=1.5,
    corner=_triangle(0.6),
    columns={"small_columns": 3, "large_columns": 8},
    column=1.0,
    column_spacing=2.0,
    column_margin=1.6,
    divider=(0.8, 0.5),
    divider_margin=3.5,
    start_margin=0.8,
    still=0.05,
)

_BURGER = partial(turtlebot3_burger, max_speed=0.2, max_turn_rate=0.785)
_JACKAL = partial(jackal, max_speed=0.5, max_turn_rate=0.785)  # as slow as the room asks for

TESTBED = BoxDeliveryPreset(
    robots={"turtlebot3": _BURGER, "jackal": _JACKAL},
    bumper="pusher",
    boxes={"small_empty": 5, "small_columns": 5, "large_columns": 10, "large_divider": 10},
    box_size=0.08,
    box_mass=0.075,
    box_spacing=0.62 / 0.44 * 0.08,
    wall=2.1,
    materials=TESTBED_MATERIALS,
    control_step=0.2,
    heading_step=0.4,
    windows=dict.fromkeys(LAYOUTS, 2.845),
    field_resolution=0.025,
    progress_reward=0.2 / 0.2845,  # windows and large rooms are 0.2845 times as large
    rooms={
        "small_empty": (1.505, 1.55),
        "small_columns": (1.505, 1.55),
        "large_columns": (2.845, 2.845),
        "large_divider": (2.845, 2.845),
    },
    receptacle=0.3,
    corner=_triangle(0.11),
    columns={"small_columns": 3, "large_columns": 8},
    column=0.2845,
    column_spacing=0.569,
    column_margin=0.33,
    divider=(0.8, 0.1),
    divider_margin=3.5 * 0.2845,
    start_margin=0.2,
    still=0.01,
)

ORIGINAL = replace(
    BENCHMARK,
    robots={"original": original_box_delivery_robot},
    materials=replace(BENCHMARK_MATERIALS, robot_object=1.0, object_static=1.0),
    heading_step=1.25,
    corner=_fillet(1.0, CONTACT_RADIUS),
    contact_radius=CONTACT_RADIUS,
    touching=True,
)
"""As the 2D benchmark's own code has it."""

PRESETS: Mapping[str, BoxDeliveryPreset] = {
    "benchmark": BENCHMARK,
    "testbed": TESTBED,
    "original": ORIGINAL,
}
