"""From a geometric path to a plan with times, and what can be said before the search begins."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pushplan.core import motion as core
from pushplan.motion.collision import goal_numbers, obstacles
from pushplan.motion.keep_out import keep_out
from pushplan.world import InvalidInputError, Plan, RobotModel, World
from pushplan.world.checks import FloatArray
from pushplan.world.outline import flatten
from pushplan.world.polyline import arc_lengths

TIGHTEST = 0.1
"""Least turning radius that plans ever use, in circumscribed radii: nearly on the spot."""

_WIDEST = 1e5
"""Greatest turning radius of vehicles that lattices are made for, in circumscribed radii."""


class SweptPath(NamedTuple):
    """A path with what it does to the objects."""

    poses: FloatArray  # (M, 3)
    curvatures: FloatArray  # (M,) curvature of the arc that leads to each pose [1/m]
    objects: FloatArray | None  # (M, K, 3) at each pose; None if not predicted
    lengths: FloatArray  # (M,) path length so far, at its price [m]
    works: FloatArray  # (M,) interaction work so far [kg m]


def turning_radius(robot: RobotModel, turn_fraction: float) -> float:
    """Least turning radius that plans use at first [m].

    A constant-speed robot cannot turn tighter than v / ω. A differential drive can, by slowing
    down; its own circumscribed radius is easy to follow, and the search halves it where there is
    no way otherwise.
    """
    if robot.turns_on_spot:
        return robot.circumscribed_radius
    return max(robot.turning_radius / turn_fraction, TIGHTEST * robot.circumscribed_radius)


def check_turns(robot: RobotModel) -> None:
    """Refuse a vehicle that hardly turns: pieces of its paths would be longer than any scene.

    Raises:
        InvalidInputError: naming its turning radius.
    """
    most = _WIDEST * robot.circumscribed_radius
    if not robot.turning_radius <= most:
        raise InvalidInputError(
            f"a lattice needs a turning radius of at most {most:g} m ({_WIDEST:g} times the size "
            f"of the robot), got {robot.turning_radius:g} m; push-aware plans with any"
        )


def start_margin(world: World, margin: float, pose: FloatArray | None = None) -> float | None:
    """The clearance [m] that can be kept from the start on, or None if the robot overlaps.

    A robot that starts nearer to a wall than ``margin`` keeps what it has. Of another pose (3,)
    it is what can be kept up to there.
    """
    pose = world.robot_pose if pose is None else pose
    walls = obstacles(keep_out(world))
    return core.start_margin(*flatten(world.robot.wall_parts), walls, margin, pose)


def goal_is_outside(world: World) -> bool:
    """Return True if the goal is a disc that lies outside the workspace, where no path can lead."""
    return core.goal_is_outside(goal_numbers(world.navigation_goal, 0.0), world.static.bounds)


def along_arcs(chords: FloatArray, curvatures: FloatArray) -> FloatArray:
    """(N,) lengths [m] of arcs with some chords (N,) [m] and curvatures (N,) [1/m]."""
    half = np.clip(0.5 * np.abs(curvatures) * chords, 1e-9, 1.0)
    return chords * np.arcsin(half) / half


def timed_plan(
    world: World, path: SweptPath, turn_fraction: float, chords: FloatArray | None = None
) -> Plan:
    """Give a path speeds and times: full speed, slower where curvature or accelerations ask for it.

    Steps against the heading are driven back; those of infinite curvature turn on the spot. A
    constant-speed robot drives at its speed. The plan begins with the robot's twist.

    Args:
        world: the snapshot that the path starts from.
        path: poses, curvatures, predicted objects, lengths and works.
        turn_fraction: fraction of the greatest turn rate that is used.
        chords: (N - 1,) distances between the poses [m]; by the lengths of the path if None.
    """
    robot = world.robot
    count = len(path.poses)
    assert world.robot_twist is not None
    vx, vy, omega = (float(value) for value in world.robot_twist)
    theta = float(world.robot_pose[2])
    times, speeds, turn_rates = np.empty((3, count))
    lengths = path.lengths
    if world.price is not None:  # in those a metre counts by its price
        lengths = arc_lengths(path.poses)
    chords = np.diff(lengths) if chords is None else chords
    limits = core.SpeedLimits(
        size=robot.circumscribed_radius,
        max_speed=robot.max_speed,
        min_speed=robot.min_speed,
        turn_rate=turn_fraction * robot.max_turn_rate,
        max_acceleration=robot.max_acceleration,
        max_turn_acceleration=robot.max_turn_acceleration,
        can_stop=robot.can_stop,
        driven_speed=vx * math.cos(theta) + vy * math.sin(theta),
        driven_turn_rate=omega,
    )
    velocity = np.array([vx, vy]) if robot.slides else None
    core.fill_speed_profile(
        path.poses, path.curvatures, chords, limits, velocity, times, speeds, turn_rates
    )
    return Plan(
        times=times,
        poses=path.poses,
        speeds=speeds,
        turn_rates=turn_rates,
        travel_cost=robot.mass * float(lengths[-1]),
        interaction_cost=float(path.works[-1]),
        object_poses=path.objects,
    )
