"""Dimensions of the maze: the 2D benchmark's and the TurtleBot3 testbed's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pushplan.envs.simulators.base import Materials
from pushplan.world import Drive, RobotModel, StaticMap
from pushplan.world.checks import FloatArray


@dataclass(frozen=True)
class MazePreset:
    """One set of dimensions. Mazes are rooms with their lower left corner at the origin.

    Args:
        rooms: width and length of the room by shape [m].
        wall: half thickness of the walls [m].
        thick_lines: whether walls are rounded segments whose centre lines bound the room, or
            boxes around the free room.
        starts: fixed start x, y [m], theta [rad], by shape.
        goals: goal point by shape [m].
        goal_radius: of the goal itself [m].
        robot_radius: added to it, as the robot's centre is what has to get there [m].
        random_start: whether the start is random unless said otherwise.
        footprint: (N, 2) corners of the robot [m].
        robot_mass: [kg].
        max_speed: [m/s].
        max_turn_rate: [rad/s].
        wheel_separation: [m].
        box_size: side of the boxes [m].
        box_mass: [kg], or None for 1 kg/m² of their area.
        materials: friction and rolling.
        control_step: [s].
        max_steps: control steps until the episode is cut off.
        progress_reward: for the whole way to the goal.
        work_reward: per kg m of work on the boxes.
        window: side of the image observation [m].
        field_resolution: cells of the goal distance field [m].
    """

    rooms: Mapping[str, tuple[float, float]]
    wall: float
    thick_lines: bool
    starts: Mapping[str, tuple[float, float, float]]
    goals: Mapping[str, tuple[float, float]]
    goal_radius: float
    robot_radius: float
    random_start: bool
    footprint: tuple[tuple[float, float], ...]
    robot_mass: float
    max_speed: float
    max_turn_rate: float
    wheel_separation: float
    box_size: float
    box_mass: float | None
    materials: Materials
    control_step: float
    max_steps: int
    progress_reward: float
    work_reward: float
    window: float
    field_resolution: float

    def robot(self, drive: Drive) -> RobotModel:
        """The robot; a differential drive may also reverse at full speed."""
        return RobotModel.from_outline(
            self.footprint,
            mass=self.robot_mass,
            drive=drive,
            max_speed=self.max_speed,
            min_speed=-self.max_speed if drive is Drive.DIFFERENTIAL else 0.0,
            max_turn_rate=self.max_turn_rate,
            wheel_separation=self.wheel_separation,
            name="maze robot" if self.thick_lines else "turtlebot3",
        )

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
        t = 2.0 * self.wall
        boxes = [
            (-t, -t, width + t, 0.0),
            (-t, length, width + t, length + t),
            (-t, 0.0, 0.0, length),
            (width, 0.0, width + t, length),
            *((x - self.wall, low, x + self.wall, high) for x, low, _, high in inner),
        ]
        return StaticMap.build(
            polygons=[_rectangle(*box) for box in boxes], bounds=(0.0, 0.0, width, length)
        )


def inner_walls(shape: str, width: float, length: float) -> list[tuple[float, float, float, float]]:
    """Centre lines x1, y1, x2, y2 [m] of the walls that make the way a U or a Z."""
    if shape == "u":
        return [(width / 2, 0.0, width / 2, length * 2 / 3)]
    return [
        (width / 3, 0.0, width / 3, length * 2 / 3),
        (width * 2 / 3, length / 3, width * 2 / 3, length),
    ]


def _rectangle(x0: float, y0: float, x1: float, y1: float) -> FloatArray:
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])


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
    footprint=(
        *((0.7, -0.5), (0.7, 0.5), (0.6, 0.6), (-0.6, 0.6)),
        *((-0.7, 0.5), (-0.7, -0.5), (-0.6, -0.6), (0.6, -0.6)),
    ),
    robot_mass=1.0,
    max_speed=0.15,
    max_turn_rate=0.105,
    wheel_separation=1.0,
    box_size=1.0,
    box_mass=None,
    # those of the 2D benchmark: boxes 1.0, walls 0.5, and no grip at the bumper
    materials=Materials(robot_object=0.0, object_object=1.0, object_static=0.5, rolling_time=2.0),
    control_step=0.8,
    max_steps=400,
    progress_reward=150.0,
    work_reward=1.5,
    window=12.0,
    field_resolution=0.1,
)

TESTBED = MazePreset(
    rooms={"u": (1.575, 2.845), "z": (2.5, 2.845)},
    wall=0.025,
    thick_lines=False,
    starts={"u": (1.181, 0.394, _UP), "z": (2.106, 2.451, _DOWN)},
    goals={"u": (0.394, 0.394), "z": (0.394, 0.394)},
    goal_radius=0.15,
    robot_radius=0.15,
    random_start=True,
    footprint=((0.069, -0.0915), (0.069, 0.0915), (-0.069, 0.0915), (-0.069, -0.0915)),
    robot_mass=1.07,
    max_speed=0.2,
    max_turn_rate=0.785,
    wheel_separation=0.16,
    box_size=0.08,
    box_mass=0.1,
    materials=Materials(robot_object=0.4, object_object=0.4, object_static=0.4, rolling_time=0.5),
    control_step=0.15,
    max_steps=2000,
    progress_reward=300.0,
    work_reward=3000.0,
    window=1.2,
    field_resolution=0.02,
)

PRESETS: Mapping[str, MazePreset] = {"benchmark": BENCHMARK, "testbed": TESTBED}
