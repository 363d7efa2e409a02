"""Dimensions of the maze: the 2D benchmark's and the TurtleBot3 testbed's."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from pushplan.envs.simulators.base import Materials
from pushplan.envs.tasks.layout import rectangle, walls_around
from pushplan.envs.tasks.materials import BENCHMARK_MATERIALS, TESTBED_MATERIALS
from pushplan.world import (
    BUMPERS,
    Drive,
    InvalidInputError,
    RobotModel,
    StaticMap,
    maze_robot,
    turtlebot3_burger,
)
from pushplan.world.checks import choice
from pushplan.world.robots import CONTACT_RADIUS, original_maze_robot


@dataclass(frozen=True)
class MazePreset:
    """One set of dimensions. Mazes are rooms with their lower left corner at the origin."""

    rooms: Mapping[str, tuple[float, float]]  # width and length of the room by shape [m]
    wall: float  # half thickness of the walls [m]
    # whether walls are rounded segments whose centre lines bound the room, or boxes around the free
    # room
    thick_lines: bool
    starts: Mapping[str, tuple[float, float, float]]  # fixed start x, y [m], theta [rad], by shape
    goals: Mapping[str, tuple[float, float]]  # goal point by shape [m]
    goal_radius: float  # of the goal itself [m]
    robot_radius: float  # added to it, as the robot's centre is what has to get there [m]
    random_start: bool  # whether the start is random unless said otherwise
    max_speed: float  # [m/s]
    max_turn_rate: float  # [rad/s]
    box_size: float  # side of the boxes [m]
    box_mass: float | None  # [kg], or None for 1 kg/m² of their area
    materials: Materials  # friction and rolling
    control_step: float  # [s]
    max_steps: int  # control steps until the episode is cut off
    progress_reward: float  # for the whole way to the goal
    work_reward: float  # per kg m of work on the boxes
    window: float  # side of the image observation [m]
    field_resolution: float  # cells of the goal distance field [m]
    # makes the robot, which has no bumpers; None for the TurtleBot3 with one of them
    body: Callable[..., RobotModel] | None = None
    contact_radius: float = 0.0  # of the boxes [m]
    touching: bool = False  # whether boxes may start in touch with the robot

    def robot(self, drive: Drive, bumper: str | None = None) -> RobotModel:
        """The robot; a differential drive may also reverse at full speed.

        Args:
            drive: how it may move.
            bumper: one of `pushplan.world.BUMPERS`; the preset's own robot if None.

        Raises:
            InvalidInputError: if there is no such bumper, or the robot cannot carry one.
        """
        limits = {"max_speed": self.max_speed, "max_turn_rate": self.max_turn_rate}
        if self.body is None:
            return turtlebot3_burger("none" if bumper is None else bumper, drive, **limits)
        if choice("bumper", "none" if bumper is None else bumper, BUMPERS) != "none":
            raise InvalidInputError(
                f"bumper {bumper!r} does not fit the robot of this preset (valid: none)"
            )
        return self.body(drive, **limits)

    def static(self, shape: str) -> StaticMap:
        """The walls of the room and inside it."""
        width, length = self.rooms[shape]
        inner = inner_walls(shape, width, length)
        if self.thick_lines:
            around = [
                (0.0, 0.0, width, 0.0),
                (width, 0.0, width, length),
                (width, length, 0.0, length),
                (0.0, length, 0.0, 0.0),
            ]
            return StaticMap.build(
                segments=[*around, *inner], radii=self.wall, bounds=(0.0, 0.0, width, length)
            )
        bounds = (0.0, 0.0, width, length)
        inside = [rectangle(x - self.wall, low, x + self.wall, high) for x, low, _, high in inner]
        return StaticMap.build(
            polygons=[*walls_around(bounds, 2.0 * self.wall), *inside], bounds=bounds
        )


def inner_walls(shape: str, width: float, length: float) -> list[tuple[float, float, float, float]]:
    """Centre lines x1, y1, x2, y2 [m] of the walls that make the way a U or a Z."""
    if shape == "u":
        return [(width / 2, 0.0, width / 2, length * 2 / 3)]
    return [
        (width / 3, 0.0, width / 3, length * 2 / 3),
        (width * 2 / 3, length / 3, width * 2 / 3, length),
    ]


_UP, _DOWN = np.pi / 2.0, -np.pi / 2.0

BENCHMARK = MazePreset(
    rooms={"u": (15.0, 15.0), "z": (20.0, 20.0)},
    wall=0.5,
    thick_lines=True,
    starts={"u": (11.25, 3.75, _UP), "z": (16.66, 16.66, _DOWN)},
    goals={"u": (3.75, 3.75), "z": (3.33, 3.33)},
    goal_radius=1.0,
    robot_radius=0.86,
    random_start=False,
    max_speed=0.15,
    max_turn_rate=0.105,
    box_size=1.0,
    box_mass=None,
    materials=BENCHMARK_MATERIALS,
    control_step=0.8,
    max_steps=400,
    progress_reward=150.0,
    work_reward=1.5,
    window=12.0,
    field_resolution=0.1,
    body=maze_robot,
)

ORIGINAL = replace(
    BENCHMARK,
    goal_radius=1.0,
    robot_radius=0.6,
    max_turn_rate=np.pi / 30.0,
    max_steps=20_000,  # it has no limit
    body=original_maze_robot,
    contact_radius=CONTACT_RADIUS,
    touching=True,
)
"""As the 2D benchmark's own code has it."""

TESTBED = MazePreset(
    rooms={"u": (1.575, 2.845), "z": (2.5, 2.845)},
    wall=0.025,
    thick_lines=False,
    starts={"u": (1.181, 0.394, _UP), "z": (2.106, 2.451, _DOWN)},
    goals={"u": (0.394, 0.394), "z": (0.394, 0.394)},
    goal_radius=0.15,
    robot_radius=0.15,
    random_start=True,
    max_speed=0.2,
    max_turn_rate=0.785,
    box_size=0.08,
    box_mass=0.1,
    materials=TESTBED_MATERIALS,
    control_step=0.15,
    max_steps=2000,
    progress_reward=300.0,
    work_reward=3000.0,
    window=1.2,
    field_resolution=0.02,
)

PRESETS: Mapping[str, MazePreset] = {
    "benchmark": BENCHMARK,
    "testbed": TESTBED,
    "original": ORIGINAL,
}
