"""From a geometric path to a plan with times, and what can be said before the search begins."""

from __future__ import annotations

import math

import numpy as np

from pushplan.core import motion as core
from pushplan.motion.collision import footprint, obstacles
from pushplan.motion.keep_out import keep_out
from pushplan.motion.swept_path import SweptPath
from pushplan.world import Drive, GoalDisc, InvalidInputError, Plan, RobotModel, World
from pushplan.world.checks import BoolArray, FloatArray
from pushplan.world.polyline import goes_back

TIGHTEST = 0.1
"""Least turning radius that plans ever use, in circumscribed radii: nearly on the spot."""

_WIDEST = 1e5
"""Greatest turning radius of vehicles that lattices are made for, in circumscribed radii."""
_FRACTIONS = (1.0, 0.5, 0.25, 0.1, 0.0)
"""Fractions of the margin that are tried in turn where a robot starts near a wall."""


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
    for fraction in _FRACTIONS:
        shape = footprint(world.robot, fraction * margin)
        if core.CollisionChecker(shape, walls).is_free(world.robot_pose):
            return fraction * margin
    return None


def goal_is_outside(world: World) -> bool:
    """Return True if the goal is a disc that lies outside the workspace, where no path can lead."""
    goal = world.navigation_goal
    bounds = world.static.bounds
    if not isinstance(goal, GoalDisc):
        return False
    nearest = np.clip(goal.center, bounds[:2], bounds[2:])
    return goal.distance(float(nearest[0]), float(nearest[1])) > 0.0


def along_arcs(chords: FloatArray, curvatures: FloatArray) -> FloatArray:
    """(N,) lengths [m] of arcs with some chords (N,) [m] and curvatures (N,) [1/m]."""
    half = np.clip(0.5 * np.abs(curvatures) * chords, 1e-9, 1.0)
    return chords * np.arcsin(half) / half


def timed_plan(
    world: World, path: SweptPath, turn_fraction: float, chords: FloatArray | None = None
) -> Plan:
    """Give a path speeds and times: full speed, slower where curvature or accelerations ask for it.

    Steps against the heading are driven back; those of infinite curvature turn on the spot. A
    constant-speed robot drives at its speed.

    Args:
        world: the snapshot that the path starts from.
        path: poses, curvatures, predicted objects, lengths and works.
        turn_fraction: fraction of the greatest turn rate that is used.
        chords: (N - 1,) distances between the poses [m]; by ``path.lengths`` if None.
    """
    robot = world.robot
    count = len(path.poses)
    ahead = np.append(path.curvatures[1:], 0.0)  # curvature from each pose on
    on_spot = np.isinf(ahead)
    signs = np.sign(ahead)
    ahead[on_spot] = 0.0
    speeds = robot.max_speed * np.ones(count)
    turn_rate = turn_fraction * robot.max_turn_rate
    back = goes_back(path.poses, robot.circumscribed_radius)
    back &= robot.min_speed < 0.0
    speeds[back] = robot.min_speed
    if robot.can_stop:
        fastest = turn_rate / np.maximum(np.abs(ahead), 1e-12)
        speeds = np.clip(speeds, -fastest, fastest)
    extents = along_arcs(np.diff(path.lengths) if chords is None else chords, ahead[:-1])
    spot = on_spot[:-1]
    extents[spot] = np.abs(np.diff(path.poses[:, 2])[spot])
    rates = np.where(on_spot, signs * turn_rate, speeds)
    if robot.can_stop:
        rates[:-1] = _eased(world, rates[:-1], extents, ahead[:-1], spot)
    speeds = np.where(on_spot, 0.0, rates)
    times = np.concatenate([[0.0], np.cumsum(extents / np.abs(rates[:-1]))])
    return Plan(
        times=times,
        poses=path.poses,
        speeds=speeds,
        turn_rates=np.where(on_spot, rates, speeds * ahead),
        travel_cost=robot.mass * float(path.lengths[-1]),
        interaction_cost=float(path.works[-1]),
        object_poses=path.objects,
    )


def _eased(
    world: World, rates: FloatArray, extents: FloatArray, curvatures: FloatArray, spot: BoolArray
) -> FloatArray:
    """Slow down where a step would change speed or turn rate faster than the robot can.

    A change between two steps takes half the time of both. Where direction or kind of motion
    changes, each step takes its half of that. The plan begins with the robot's twist, if known.

    Args:
        world: gives the robot.
        rates: (N,) speed of each step [m/s], or turn rate on the spot [rad/s].
        extents: (N,) length [m], or angle [rad].
        curvatures: (N,) curvature [1/m].
        spot: (N,) which steps turn on the spot.

    Returns:
        (N,) the rates, none faster.
    """
    robot = world.robot
    turning = robot.max_turn_acceleration
    if (math.isinf(robot.max_acceleration) and math.isinf(turning)) or not len(rates):
        return rates
    # half of the turn acceleration is for changes of speed on an arc, half for changes of curvature
    most = np.minimum(robot.max_acceleration, 0.5 * turning / np.maximum(np.abs(curvatures), 1e-12))
    most[spot] = turning
    limits = np.abs(rates)
    between = 0.5 * (extents[1:] + extents[:-1])
    changes = np.maximum(np.abs(np.diff(curvatures)), 1e-12)
    allowed = np.sqrt(0.5 * turning * between / changes)
    limits[1:] = np.minimum(limits[1:], allowed)
    limits[:-1] = np.minimum(limits[:-1], allowed)
    parted = (np.sign(rates[1:]) != np.sign(rates[:-1])) | (spot[1:] != spot[:-1])
    alone = np.sqrt(0.5 * most * extents)
    limits[1:][parted] = np.minimum(limits[1:], alone[1:])[parted]
    limits[:-1][parted] = np.minimum(limits[:-1], alone[:-1])[parted]
    gains = np.where(parted, math.inf, np.minimum(most[1:], most[:-1]) * between)
    if world.robot_twist is not None:
        vx, vy, omega = (float(value) for value in world.robot_twist)
        theta = float(world.robot_pose[2])
        now = vx * math.cos(theta) + vy * math.sin(theta)
        if spot[0]:
            now = omega
        now = max(now * float(np.sign(rates[0])), 0.0)
        limits[0] = min(limits[0], _after(now, 0.5 * most[0] * extents[0]))
    found = limits.tolist()
    steps = [(i, i + 1) for i in range(len(gains))]
    for before, after in (*steps, *((after, before) for before, after in reversed(steps))):
        gain = gains[min(before, after)]
        found[after] = min(found[after], _after(found[before], gain))
    eased: FloatArray = np.copysign(found, rates)
    return eased


def _after(rate: float, gain: float) -> float:
    """The rate of a step after one of ``rate``; ``gain`` is acceleration times distance."""
    return 0.5 * (rate + math.sqrt(rate * rate + 4.0 * gain))
