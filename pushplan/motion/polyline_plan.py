"""Plans from polylines, for planners that know only the shape of a path."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from pushplan.core import motion as core
from pushplan.geometry.angles import wrap_angle
from pushplan.motion.collision import footprint, obstacles
from pushplan.motion.keep_out import keep_out
from pushplan.motion.speed_profile import along_arcs, turning_radius
from pushplan.world import GoalPose, NavigationGoal, Plan, PlanResult, PlanStatus, World
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
    """Classify a plan: can the robot drive it, and does it reach the goal?

    Returns:
        `PATH_ONLY` unless the plan begins at the robot's pose, turns no faster than the robot, and
        its footprint, at poses a fiftieth of its circumscribed radius apart, touches nothing
        static. Else `SOLVED`, or `APPROXIMATE` where the plan does not end in the goal of the
        robot, at its heading if it has one.
    """
    robot = world.robot
    poses = plan.poses
    moves = np.diff(poses, axis=0)
    off = poses[0] - world.robot_pose
    turns = np.abs(wrap_angle(moves[:, 2]))
    lasts = np.diff(plan.times)
    fast = turns > robot.max_turn_rate * lasts + 1e-9
    fast |= turns * robot.min_turning_radius > plan.speeds[:-1] * lasts + 1e-9
    fast |= (turns > 1e-9) & math.isfinite(robot.max_turn_acceleration)  # all at once, at a corner
    near = 1e-9 * robot.circumscribed_radius
    if np.abs(off[:2]).max() > near or abs(math.remainder(off[2], math.tau)) > 1e-9 or fast.any():
        return PlanStatus.PATH_ONLY
    if blocked_pose(world, poses) is not None:
        return PlanStatus.PATH_ONLY
    if _arrives(world, poses[-1]):
        return PlanStatus.SOLVED
    return PlanStatus.APPROXIMATE


def _arrives(world: World, pose: FloatArray) -> bool:
    """Return True if a pose (3,) is in the goal of the robot but for rounding, or there is none."""
    goal = world.goal
    if not isinstance(goal, NavigationGoal):
        return True
    if isinstance(goal, GoalPose) and abs(goal.heading_error(pose[2])) > goal.heading_tolerance:
        return False
    return goal.distance(*pose[:2].tolist()) <= 1e-6 * world.robot.circumscribed_radius


def blocked_pose(world: World, poses: FloatArray) -> FloatArray | None:
    """(3,) the first pose at which a robot that drives from pose to pose touches something static.

    Between the poses (N, 3) it is looked at a fiftieth of its circumscribed radius apart. None
    where it touches nothing.
    """
    moves = np.diff(poses, axis=0)
    moves[:, 2] = wrap_angle(moves[:, 2])
    size = world.robot.circumscribed_radius
    ways = np.maximum(np.hypot(moves[:, 0], moves[:, 1]), size * np.abs(moves[:, 2]))
    counts = np.maximum(np.ceil(ways / (_FINE * size)), 1.0).astype(np.int64)
    first = np.repeat(np.arange(len(moves)), counts)
    begins = np.cumsum(counts) - counts
    fraction = (np.arange(len(first)) - begins[first]) / counts[first]
    dense = np.concatenate([poses[first] + fraction[:, None] * moves[first], poses[-1:]])
    checker = core.CollisionChecker(footprint(world.robot), obstacles(world.static))
    index = checker.first_blocked(dense)
    if index == len(dense):
        return None
    blocked: FloatArray = dense[index]
    return blocked


def polyline_result(
    call: PlanningCall,
    points: FloatArray,  # (N, 2) corners of the path that was found [m]
    spacing: float,  # distance between the poses of its plan [R]
    iterations: int,
) -> PlanResult:
    """The result of a planner whose paths are polylines, with the status of `polyline_status`."""
    world = call.world
    spacing = spacing * world.robot.circumscribed_radius
    plan = polyline_plan(world, points, spacing)
    goal = world.navigation_goal
    if isinstance(goal, GoalPose) and not goal.reached_by(plan.poses[-1]):
        plan = _ended_at(world, goal, plan, spacing) or plan
    first = math.nan
    if _arrives(world, plan.poses[-1]):
        first = call.elapsed
    return call.result(polyline_status(world, plan), plan, first, iterations)


def _ended_at(world: World, goal: GoalPose, plan: Plan, spacing: float) -> Plan | None:
    """A plan with an end at the goal's heading, driven at full speed; None if there is none.

    A differential drive goes to the goal and turns on the spot, the shorter way if it can; where
    it has no room for that, and for other drives, a curve of Dubins leads into the pose, or one of
    Reeds and Shepp where a car may reverse.
    """
    robot = world.robot
    kept, ending, curvatures = core.end_at_pose(
        goal=np.array([2.0, *goal.center, goal.radius, goal.heading]),
        tolerance=goal.heading_tolerance,
        path=np.ascontiguousarray(plan.poses),
        footprint=footprint(robot),
        walls=obstacles(keep_out(world)),
        size=robot.circumscribed_radius,
        on_spot=robot.turns_on_spot,
        curves_back=robot.curves_back,
        reverses=robot.min_speed < 0.0,
        radius=turning_radius(robot, 1.0),
        spacing=spacing,
    )
    if not kept:
        return None
    poses = np.concatenate([plan.poses[:kept], ending])
    moves = np.diff(poses[kept - 1 :], axis=0)
    on_spot = np.isinf(curvatures)
    turns = np.copysign(robot.max_turn_rate, curvatures)
    curvatures = np.where(on_spot, 0.0, curvatures)
    lengths = along_arcs(np.hypot(moves[:, 0], moves[:, 1]), curvatures)
    most = robot.max_turn_rate
    speeds = np.full(len(moves), robot.max_speed)
    if robot.can_stop:
        speeds = np.minimum(speeds, most / np.maximum(np.abs(curvatures), 1e-12))
    lasts = np.where(on_spot, np.abs(moves[:, 2]) / most, lengths / speeds)
    speeds[on_spot] = 0.0
    rates = np.where(on_spot, turns, speeds * curvatures)
    before = kept - 1
    return Plan(
        times=np.concatenate([plan.times[:kept], plan.times[before] + np.cumsum(lasts)]),
        poses=poses,
        speeds=np.concatenate([plan.speeds[:before], speeds, speeds[-1:]]),
        turn_rates=np.concatenate([plan.turn_rates[:before], rates, rates[-1:]]),
        travel_cost=robot.mass * float(plan.arc_lengths[before] + lengths.sum()),
    )
