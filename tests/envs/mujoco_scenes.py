"""Scenes for the tests of the MuJoCo simulator."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from pushplan.envs.simulators.base import Materials, Solids, Water
from pushplan.envs.simulators.mujoco_simulator import MujocoSimulator
from pushplan.world import (
    Drive,
    GoalDisc,
    GoalLine,
    Movables,
    RobotModel,
    StaticMap,
    World,
)

SIDE = 0.08
SQUARE = 0.5 * SIDE * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
CHASSIS = np.array([(-0.069, -0.0915), (0.069, -0.0915), (0.069, 0.0915), (-0.069, 0.0915)])
BUMPER = np.array([(0.069, -0.11), (0.085, -0.1), (0.085, 0.1), (0.069, 0.11)])
FRONT = 0.085

SOLIDS = Solids(
    object_height=SIDE, robot_height=0.19, wall_height=0.2, bumper_height=0.06, wheel_radius=0.033
)
GROUND = Materials(
    robot_object=0.4,
    object_object=0.4,
    object_static=0.4,
    rolling_time=0.5,
    object_ground=0.4,
    solids=SOLIDS,
)
JACKAL_GROUND = replace(GROUND, solids=Solids(0.08, 0.25, 0.3, 0.1, wheel_radius=0.098))
STILL_WATER = Water(object_draught=0.0, object_form_drag=0.0, object_skin_drag=0.0)
SEA = Materials(
    robot_object=0.05,
    object_object=0.0,
    object_static=0.0,
    water=Water(),
    solids=Solids(
        object_height=1.2, robot_height=8.0, wall_height=3.0, bumper_height=8.0, wheel_radius=1.0
    ),
)


def turtlebot(**changes):
    limits = {
        "parts": (CHASSIS, BUMPER),
        "mass": 1.07,
        "drive": Drive.DIFFERENTIAL,
        "max_speed": 0.22,
        "min_speed": -0.22,
        "max_turn_rate": 2.84,
        "wheel_separation": 0.16,
        "name": "turtlebot3",
    }
    return RobotModel(**{**limits, **changes})


def jackal():
    x, y = 0.255, 0.215
    return turtlebot(
        parts=(np.array([(-x, -y), (x, -y), (x, y), (-x, y)]),),
        mass=17.0,
        max_speed=2.0,
        min_speed=-2.0,
        max_turn_rate=4.0,
        wheel_separation=0.376,
        name="jackal",
    )


def room(
    boxes=(), *, pose=(0.0, 0.0, 0.0), half=1.5, wheeled=(), robot=None, twists=None, walls=()
):
    """A walled room around the origin with cubes of 8 cm."""
    boxes = np.asarray(boxes, dtype=float).reshape(-1, 3)
    h, t = half, 0.05
    around = [
        ((-h - t, -h - t), (h + t, -h)),
        ((-h - t, h), (h + t, h + t)),
        ((-h - t, -h), (-h, h)),
        ((h, -h), (h + t, h)),
        *walls,
    ]
    return World(
        robot=robot or turtlebot(),
        robot_pose=np.asarray(pose, dtype=float),
        static=StaticMap.build(
            polygons=[[(a, b), (c, b), (c, d), (a, d)] for (a, b), (c, d) in around],
            bounds=(-h, -h, h, h),
        ),
        movables=Movables.from_outlines(
            [SQUARE] * len(boxes),
            boxes,
            masses=np.full(len(boxes), 0.1),
            wheeled=np.isin(np.arange(len(boxes)), wheeled),
            twists=twists,
        ),
        goal=GoalDisc(np.array([0.7 * h, 0.7 * h]), 0.15),
    )


def cluttered(seed, count=8, half=0.6, **changes):
    """Boxes in two rings around the robot in a small room."""
    rng = np.random.default_rng(seed)
    angles = np.linspace(0.0, 2.0 * math.pi, count, endpoint=False) + rng.uniform(0.0, 1.0)
    radii = 0.3 + 0.12 * (np.arange(count) % 2)
    boxes = np.stack([radii * np.cos(angles), radii * np.sin(angles), angles], axis=1)
    return room(boxes, half=half, **changes)


def ship(**changes):
    outline = [(-38.1, -8.4), (-33, -9), (9, -9), (23, -7), (32, -3.8), (38.1, 0)]
    outline += [(32, 3.8), (23, 7), (9, 9), (-33, 9), (-38.1, 8.4)]
    limits = {
        "mass": 6.0e6,
        "drive": Drive.DIFFERENTIAL,
        "max_speed": 2.0,
        "max_turn_rate": 0.013,
        "name": "ship",
    }
    return RobotModel.from_outline(outline, **{**limits, **changes})


def floe(radius, corners=7):
    angles = 2.0 * math.pi * np.arange(corners) / corners
    return radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def sea(floes=(), twists=None, *, pose=(0.0, 0.0, 0.0), radius=12.0, robot_twist=None):
    """Open water with heptagonal floes of one radius at (K, 3) poses."""
    floes = np.asarray(floes, dtype=float).reshape(-1, 3)
    return World(
        robot=ship(),
        robot_pose=np.asarray(pose, dtype=float),
        static=StaticMap.build(bounds=(-500.0, -500.0, 500.0, 500.0)),
        movables=Movables.from_outlines(
            [floe(radius)] * len(floes), floes, density=1080.0, twists=twists
        ),
        goal=GoalLine([0.0, 400.0], [0.0, 1.0]),
        robot_twist=robot_twist,
    )


def built(world, materials=GROUND, options=None):
    simulator = MujocoSimulator(options)
    simulator.build(world, materials)
    return simulator


def without_drag(materials=SEA, **changes):
    return replace(materials, water=STILL_WATER, **changes)
