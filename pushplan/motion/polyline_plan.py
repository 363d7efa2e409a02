"""Plans from polylines, for planners that know only the shape of a path."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from pushplan.core import motion as core
from pushplan.geometry.angles import wrap_angle
from pushplan.motion.collision import footprint, obstacles
from pushplan.world import Plan, PlanResult, PlanStatus, World
from pushplan.world.checks import FloatArray
from pushplan.world.planning_call import PlanningCall

_FINE = 0.02  # distance of poses that are checked [circumscribed radii]


def polyline_plan(world: World, points: FloatArray, spacing: float) -> Plan:
    """A plan at full speed along straight pieces; it predicts nothing about the objects.

    Args:
        world: the snapshot; the plan starts at its robot.
        points: (N, 2) corners from the robot to the goal [m].
        spacing: greatest distance between two poses [m].
    """
    pieces = [points[:1]]
    for a, b in pairwise(points):
        steps = max(1, int(np.ceil(float(np.hypot(*(b - a))) / spacing)))
        pieces.append(a + (b - a) * (np.arange(1, steps + 1) / steps)[:, None])
    path = np.concatenate(pieces)
    moves = np.diff(path, axis=0)
    lengths = np.hypot(moves[:, 0], moves[:, 1])
    keep = np.concatenate([[True], lengths > 1e-8 * spacing])
    path = path[keep]
    moves = moves[keep[1:]]
    lengths = lengths[keep[1:]]
    if len(moves):
        headings = np.arctan2(moves[:, 1], moves[:, 0])
        headings = np.append(headings, headings[-1])
    else:
        headings = world.robot_pose[2:]
    speed = world.robot.max_speed
    return Plan(
        times=np.concatenate([[0.0], np.cumsum(lengths) / speed]),
        poses=np.column_stack([path, headings]),
        speeds=np.full(len(path), speed),
        turn_rates=np.zeros(len(path)),
        travel_cost=world.robot.mass * float(lengths.sum()),
    )


def polyline_status(world: World, plan: Plan) -> PlanStatus:
    """Say whether the robot can drive a plan as it stands: `SOLVED`, or else `PATH_ONLY`.

    It can where the plan begins at the robot's pose, turns no faster than the robot, and its
    footprint, at poses a fiftieth of its circumscribed radius apart, touches nothing static.
    """
    robot = world.robot
    poses = plan.poses
    moves = np.diff(poses, axis=0)
    off = poses[0] - world.robot_pose
    turns = np.abs(wrap_angle(moves[:, 2]))
    lasts = np.diff(plan.times)
    fast = turns > robot.max_turn_rate * lasts + 1e-9
    lengths = np.hypot(moves[:, 0], moves[:, 1])
    fast |= turns * robot.min_turning_radius > lengths + 1e-9
    fast |= (turns > 1e-9) & math.isfinite(robot.max_turn_acceleration)  # all at once, at a corner
    near = 1e-9 * robot.circumscribed_radius
    if np.abs(off[:2]).max() > near or abs(math.remainder(off[2], math.tau)) > 1e-9 or fast.any():
        return PlanStatus.PATH_ONLY
    step = _FINE * robot.circumscribed_radius
    counts = np.maximum(np.ceil(lengths / step), 1.0).astype(np.int64)
    first = np.repeat(np.arange(len(moves)), counts)
    fraction = (np.arange(len(first)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[
        first
    ]
    dense = np.concatenate([poses[first] + fraction[:, None] * moves[first], poses[-1:]])
    checker = core.CollisionChecker(footprint(robot), obstacles(world.static))
    if checker.first_blocked(dense) < len(dense):
        return PlanStatus.PATH_ONLY
    return PlanStatus.SOLVED


def polyline_result(
    call: PlanningCall,
    points: FloatArray,  # (N, 2) corners of the path that was found [m]
    spacing: float,  # distance between the poses of its plan [R]
    iterations: int,
) -> PlanResult:
    """The result of a planner whose paths are polylines."""
    world = call.world
    plan = polyline_plan(world, points, spacing * world.robot.circumscribed_radius)
    return call.result(polyline_status(world, plan), plan, call.elapsed, iterations)
