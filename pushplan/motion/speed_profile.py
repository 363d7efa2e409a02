"""From a geometric path to a plan with times, and what can be said before the search begins."""

from __future__ import annotations

import numpy as np

from pushplan.compiled import owned
from pushplan.motion.collision import footprint, is_free, obstacles
from pushplan.motion.keep_out import keep_out
from pushplan.motion.path_problem import SweptPath
from pushplan.world import Drive, InvalidInputError, Plan, RobotModel, World

TIGHTEST = 0.1
"""Least turning radius that plans ever use, in circumscribed radii: nearly on the spot."""

_WIDEST = 1e5
"""Greatest turning radius of vehicles that lattices are made for, in circumscribed radii."""


def turning_radius(robot: RobotModel, turn_fraction: float) -> float:
    """Least turning radius that plans use at first [m].

    A constant-speed robot cannot turn tighter than v / ω. A differential drive can, by slowing
    down; its own circumscribed radius is easy to follow, and the search halves it where there is
    no way otherwise.
    """
    if robot.drive is Drive.DIFFERENTIAL:
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


def start_margin(world: World, margin: float) -> float | None:
    """The clearance [m] that can be kept from the start on, or None if the robot overlaps.

    A robot that starts nearer to a wall than ``margin`` keeps what it has.
    """
    walls = obstacles(keep_out(world))
    for fraction in (1.0, 0.5, 0.25, 0.1, 0.0):
        shape = footprint(world.robot, fraction * margin)
        if is_free(owned(world.robot_pose), shape, walls, np.empty_like(shape.vertices)):
            return fraction * margin
    return None


def timed_plan(world: World, path: SweptPath, turn_fraction: float) -> Plan:
    """Give a path speeds and times: full speed, slower where the curvature asks for it.

    Args:
        world: the snapshot that the path starts from.
        path: poses, curvatures, predicted objects, lengths and works.
        turn_fraction: fraction of the greatest turn rate that is used.
    """
    robot = world.robot
    count = len(path.poses)
    ahead = np.append(path.curvatures[1:], 0.0)  # curvature from each pose on
    curvature = np.maximum(np.abs(ahead), 1e-12)
    fastest = turn_fraction * robot.max_turn_rate / curvature
    speeds = np.minimum(robot.max_speed, fastest)
    if robot.drive is Drive.CONSTANT_SPEED:
        speeds = np.full(count, robot.max_speed)
    # the length of an arc, where `path.lengths` has its chord
    chords = np.diff(path.lengths)
    half = np.clip(0.5 * np.abs(ahead[:-1]) * chords, 1e-9, 1.0)
    arcs = chords * np.arcsin(half) / half
    times = np.concatenate([[0.0], np.cumsum(arcs / speeds[:-1])])
    return Plan(
        times=times,
        poses=path.poses,
        speeds=speeds,
        turn_rates=speeds * ahead,
        travel_cost=robot.mass * float(path.lengths[-1]),
        interaction_cost=float(path.works[-1]),
        object_poses=path.objects,
    )
