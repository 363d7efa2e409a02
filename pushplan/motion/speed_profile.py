"""From a geometric path to a plan with times, and what can be said before the search begins."""

from __future__ import annotations

import numpy as np

from pushplan.compiled import owned
from pushplan.motion.collision import footprint, is_free, obstacles
from pushplan.motion.keep_out import keep_out
from pushplan.motion.path_problem import SweptPath
from pushplan.world import Drive, GoalDisc, InvalidInputError, Plan, RobotModel, World
from pushplan.world.polyline import goes_back

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


def goal_is_outside(world: World) -> bool:
    """Whether the goal is a disc that lies outside the workspace, where no path can lead."""
    goal, bounds = world.navigation_goal, world.static.bounds
    if not isinstance(goal, GoalDisc):
        return False
    nearest = np.clip(goal.center, bounds[:2], bounds[2:])
    return goal.distance(float(nearest[0]), float(nearest[1])) > 0.0


def timed_plan(world: World, path: SweptPath, turn_fraction: float) -> Plan:
    """Give a path speeds and times: full speed, slower where the curvature asks for it.

    Steps against the heading are driven back; those of infinite curvature turn on the spot.

    Args:
        world: the snapshot that the path starts from.
        path: poses, curvatures, predicted objects, lengths and works.
        turn_fraction: fraction of the greatest turn rate that is used.
    """
    robot = world.robot
    count = len(path.poses)
    ahead = np.append(path.curvatures[1:], 0.0)  # curvature from each pose on
    on_spot, signs = np.isinf(ahead), np.sign(ahead)
    ahead[on_spot] = 0.0
    curvature = np.maximum(np.abs(ahead), 1e-12)
    turn_rate = turn_fraction * robot.max_turn_rate
    fastest = turn_rate / curvature
    speeds = np.minimum(robot.max_speed, fastest)
    if robot.drive is Drive.CONSTANT_SPEED:
        speeds = np.full(count, robot.max_speed)
    back = goes_back(path.poses, robot.circumscribed_radius)
    back &= robot.min_speed < 0.0
    speeds[back] = np.maximum(robot.min_speed, -fastest[back])
    turn_rates = np.where(on_spot, signs * turn_rate, speeds * ahead)
    # the length of an arc, where `path.lengths` has its chord
    chords = np.diff(path.lengths)
    half = np.clip(0.5 * np.abs(ahead[:-1]) * chords, 1e-9, 1.0)
    arcs = chords * np.arcsin(half) / half
    spot = on_spot[:-1]
    lasts = np.divide(arcs, np.abs(speeds[:-1]), where=~spot, out=np.zeros(count - 1))
    lasts[spot] = np.abs(np.diff(path.poses[:, 2])[spot]) / turn_rate
    speeds[on_spot] = 0.0
    times = np.concatenate([[0.0], np.cumsum(lasts)])
    return Plan(
        times=times,
        poses=path.poses,
        speeds=speeds,
        turn_rates=turn_rates,
        travel_cost=robot.mass * float(path.lengths[-1]),
        interaction_cost=float(path.works[-1]),
        object_poses=path.objects,
    )
