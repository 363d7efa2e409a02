"""Dimensions of Ship-Ice: the 2D benchmark's model basin, and a full-scale supply vessel."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from pushplan.envs.simulators.base import Materials, Solids
from pushplan.envs.simulators.water import Water
from pushplan.scenarios.ice import FloeSizes
from pushplan.world import Drive, RobotModel
from pushplan.world.checks import FloatArray
from pushplan.world.outline import centroid
from pushplan.world.robots import CONTACT_RADIUS

ICE_DENSITY = 900.0
"""[kg/m³], full scale."""
ICE_THICKNESS = 1.2
"""[m], full scale."""


@dataclass(frozen=True)
class ShipPreset:
    """One set of dimensions. The channel has its lower left corner at the origin; +y is ahead."""

    channel: tuple[float, float]  # width and length [m]. It has no walls.
    ice: tuple[float, float]  # y from which and to which there is ice [m]
    sizes: FloeSizes  # of the floes
    floe_density: float  # mass of a floe over its area [kg/m²]
    footprint: FloatArray  # (N, 2) corners of the ship about its origin [m]
    ship_mass: float  # as the metrics count it [kg]
    max_speed: float  # at which the ship always goes [m/s]
    max_turn_rate: float  # [rad/s]
    start_y: float  # of the ship's origin [m]
    side_margin: float  # least distance of a random start from the sides of the channel [m]
    clearance: float  # water around the hull that is free of ice at the start [m]
    goal_y: float  # of the goal line [m]
    materials: Materials  # friction, water and the third dimension
    control_step: float  # [s]
    max_steps: int  # control steps until the episode is cut off
    work_reward: float  # per kg m of work on the floes
    window: float  # side of the image observation [m]
    shift: float  # how far its middle lies ahead of the ship's origin [m]
    contact_radius: float = 0.0  # of the ship and the floes [m]
    overlaps: bool = False  # whether floes from a file may overlap

    def robot(self) -> RobotModel:
        """The ship."""
        return RobotModel.from_outline(
            self.footprint,
            mass=self.ship_mass,
            drive=Drive.CONSTANT_SPEED,
            max_speed=self.max_speed,
            max_turn_rate=self.max_turn_rate,
            contact_radius=self.contact_radius,
            name="ship",
        )

    @property
    def bounds(self) -> FloatArray:
        """(4,) x_min, y_min, x_max, y_max of the channel [m]."""
        return np.array([0.0, 0.0, *self.channel])

    @property
    def ice_bounds(self) -> FloatArray:
        """(4,) those of the ice [m]."""
        return np.array([0.0, self.ice[0], self.channel[0], self.ice[1]])


BENCHMARK = ShipPreset(
    channel=(12.0, 40.0),
    ice=(0.0, 40.0),
    sizes=FloeSizes(),
    floe_density=1.0,  # the metrics of the 2D benchmark count an object's area for its mass
    footprint=np.array(
        [
            *((1.0, 0.0), (0.9, 0.1), (0.5, 0.25), (-1.0, 0.25)),
            *((-1.0, -0.25), (0.5, -0.25), (0.9, -0.1)),
        ]
    ),
    ship_mass=1.0,
    max_speed=0.3,
    max_turn_rate=0.224,
    start_y=1.0,
    side_margin=1.0,
    clearance=0.1,
    goal_y=9.0,
    # no water in the 2D benchmark: a floe stops when nothing pushes it
    materials=Materials(robot_object=1.0, object_object=1.0, object_static=1.0),
    control_step=0.8,
    max_steps=300,
    work_reward=30.0,
    window=6.0,
    shift=2.0,
)


ORIGINAL = replace(
    BENCHMARK,
    ice=(2.0, 40.0),
    max_turn_rate=math.pi / 14.0,
    clearance=-CONTACT_RADIUS,  # its floes may touch the ship
    max_steps=20_000,  # it has no limit
    contact_radius=CONTACT_RADIUS,
    overlaps=True,
)
"""As the 2D benchmark's own code has it; its own fields are for ``ice_file``."""


def _supply_vessel(length: float, beam: float) -> FloatArray:
    """Outline of a platform supply vessel about its centroid: transom, parallel body, bow."""
    half = np.array(  # distance from the stern over length, half width over half beam
        [(0.0, 0.93), (0.07, 1.0), (0.62, 1.0), (0.80, 0.77), (0.92, 0.42), (1.0, 0.0)]
    ) * (length, beam / 2.0)
    corners = np.concatenate([half * (1.0, -1.0), half[-2::-1]])
    return corners - centroid(corners)


_LENGTH, _BEAM, _SHIP_MASS = 76.2, 18.0, 6.0e6
_FLOE_DENSITY = ICE_DENSITY * ICE_THICKNESS
_SCALE = _LENGTH / 2.0  # length of the full-scale ship over that of the model

FULL_SCALE = ShipPreset(
    channel=(200.0, 1250.0),
    ice=(150.0, 1150.0),
    sizes=FloeSizes(mean_radius=12.5, spread=0.33, least=6.0, greatest=25.0),
    floe_density=_FLOE_DENSITY,
    footprint=_supply_vessel(_LENGTH, _BEAM),
    ship_mass=_SHIP_MASS,
    max_speed=2.0,
    max_turn_rate=math.radians(45.0) / 60.0,  # 45 degrees a minute
    start_y=50.0,
    side_margin=_LENGTH / 2.0,
    clearance=4.0,
    goal_y=1200.0,
    materials=Materials(
        robot_object=0.05,
        object_object=0.35,
        object_static=0.35,
        water=Water(object_draught=ICE_THICKNESS * ICE_DENSITY / 1025.0),
        solids=Solids(
            object_height=ICE_THICKNESS,
            robot_height=8.0,
            wall_height=3.0,
            bumper_height=8.0,
            wheel_radius=1.0,
        ),
    ),
    control_step=4.0,
    max_steps=300,
    # the same reward as at model scale for the same motion of the same floes, each length larger
    work_reward=30.0 / (_FLOE_DENSITY * _SCALE**3),
    window=6.0 * _SCALE,
    shift=2.0 * _SCALE,
)

PRESETS: Mapping[str, ShipPreset] = {
    "benchmark": BENCHMARK,
    "full_scale": FULL_SCALE,
    "original": ORIGINAL,
}
