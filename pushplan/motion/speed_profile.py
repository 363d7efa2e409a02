"""From a geometric path to a plan with times, and what can be said before the search begins."""

from __future__ import annotations

import math

import numpy as np

from pushplan.core import motion as core
from pushplan.geometry.angles import wrap_angle
from pushplan.motion.collision import footprint, obstacles
from pushplan.motion.keep_out import keep_out
from pushplan.motion.swept_path import SweptPath
from pushplan.world import GoalDisc, InvalidInputError, Plan, RobotModel, World
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import arc_lengths

TIGHTEST = 0.1
"""Least turning radius that plans ever use, in circumscribed radii: nearly on the spot."""

_WIDEST = 1e5
"""Greatest turning radius of vehicles that lattices are made for, in circumscribed radii."""
_STRAIGHT = 1e-12  # length [m], curvature [1/m] or change of bearing [rad] that counts as none
_FRACTIONS = (1.0, 0.5, 0.25, 0.1, 0.0)
"""Fractions of the margin that are tried in turn where a robot starts near a wall."""


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
    for fraction in _FRACTIONS:
        shape = footprint(world.robot, fraction * margin)
        if core.CollisionChecker(shape, walls).is_free(pose):
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
    if robot.slides:
        times, speeds, turn_rates = _sliding_profile(
            robot, path.poses, turn_fraction * robot.max_turn_rate, np.array([vx, vy])
        )
    else:
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
        core.fill_speed_profile(
            path.poses, path.curvatures, chords, limits, times, speeds, turn_rates
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


def _sliding_profile(
    robot: RobotModel, poses: FloatArray, turn_rate: float, velocity: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times [s], speeds [m/s] and turn rates [rad/s] of an omnidirectional robot, (N,) each.

    It drives straight from pose to pose (N, 3) and turns meanwhile, beginning with a velocity (2,)
    [m/s]. Half of its acceleration changes the speed, half the direction or the turn rate. Where
    turns on the spot begin too suddenly for it, the whole plan is slower.
    """
    moves = np.diff(poses[:, :2], axis=0)
    turns = np.abs(np.diff(poses[:, 2]))
    lengths = np.hypot(moves[:, 0], moves[:, 1])
    on_spot = (lengths == 0.0) & (turns > 0.0)
    rates = np.full(len(moves), robot.max_speed)
    turns_too = turns > 0.0
    rates[turns_too] = np.minimum(
        robot.max_speed, turn_rate * lengths[turns_too] / turns[turns_too]
    )
    if len(moves) and min(robot.max_acceleration, robot.max_turn_acceleration) < math.inf:
        between = 0.5 * (lengths[1:] + lengths[:-1])
        bearings = np.arctan2(moves[:, 1], moves[:, 0]) - poses[1:, 2]  # in the body frame
        swings = np.maximum(np.abs(wrap_angle(np.diff(bearings))), _STRAIGHT)
        curvatures = np.diff(poses[:, 2]) / np.maximum(lengths, _STRAIGHT)
        changes = np.maximum(np.abs(np.diff(curvatures)), _STRAIGHT)
        acceleration = math.sqrt(0.5) * robot.max_acceleration
        turning = 0.5 * robot.max_turn_acceleration
        gains = np.minimum(acceleration, turning / np.maximum(np.abs(curvatures), _STRAIGHT))
        allowed = np.sqrt(np.minimum(acceleration / swings, turning / changes) * between)
        rates[1:] = np.minimum(rates[1:], allowed)
        rates[:-1] = np.minimum(rates[:-1], allowed)
        first = max(float(moves[0] @ velocity) / max(float(lengths[0]), _STRAIGHT), 0.0)
        rates[0] = min(rates[0], math.sqrt(first**2 + gains[0] * float(lengths[0])))
        gained = 2.0 * np.minimum(gains[1:], gains[:-1]) * between
        for i in range(len(gained)):
            rates[i + 1] = min(rates[i + 1], math.sqrt(rates[i] ** 2 + gained[i]))
        for i in reversed(range(len(gained))):
            rates[i] = min(rates[i], math.sqrt(rates[i + 1] ** 2 + gained[i]))
    lasts = np.where(on_spot, turns / turn_rate, lengths / np.maximum(rates, 1e-12))
    rates[on_spot] = 0.0
    spins = np.diff(poses[:, 2]) / np.maximum(lasts, 1e-12)
    jumps = np.abs(np.diff(spins)) / np.maximum(lasts[1:] + lasts[:-1], 1e-12)
    sudden = 2.0 * float(jumps.max(initial=0.0)) / robot.max_turn_acceleration
    slower = math.sqrt(max(1.0, sudden))
    times = np.concatenate([[0.0], slower * np.cumsum(lasts)])
    last = rates[-1:] if len(rates) else np.array([robot.max_speed])
    return times, np.append(rates, last) / slower, np.append(spins, 0.0) / slower
