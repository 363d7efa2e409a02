"""One push with the route to its start, as a `Plan`: for pictures, logs and clients of a server."""

from __future__ import annotations

import numpy as np

from pushplan.control import Legs
from pushplan.geometry.angles import wrap_angle
from pushplan.planners.rearrangement.goal_kernels import REMOVED
from pushplan.planners.rearrangement.push import Push
from pushplan.world import Plan, SubTask, World
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import arc_lengths, goes_back, step_lengths

_INSIDE = 0.7  # inscribed over circumscribed radius of a box
_STILL = 1e-6  # a step that is shorter turns on the spot [circumscribed radii]


def push_plan(world: World, route: Legs | None, push: Push) -> Plan:
    """The way to a push and the push itself, at full speed and turn rate.

    A push is predicted at its end only: in between, ``object_poses`` follow the straight line from
    where the objects are, as far as the robot has pushed. An object that leaves the world ends in
    front of the robot.

    Args:
        world: the snapshot from which the robot starts, with the objects that the push knows.
        route: to the start of the push; None if the robot is there.
        push: the push.
    """
    robot, way = world.robot, _way(world, route)
    poses = np.concatenate([way, push.poses])
    along, first = arc_lengths(poses), len(way)
    lengths, turns = step_lengths(poses), wrap_angle(np.diff(poses[:, 2]))
    fastest = np.where(goes_back(poses, robot.circumscribed_radius), -1.0, 1.0) * robot.max_speed
    on_spot = lengths < _STILL * robot.circumscribed_radius
    steps = np.maximum(lengths / robot.max_speed, np.abs(turns) / robot.max_turn_rate)
    moving = steps > 0.0
    speeds, turn_rates = fastest, np.zeros(len(poses))
    speeds[:-1][moving] = np.sign(fastest[:-1][moving]) * lengths[moving] / steps[moving]
    speeds[:-1][on_spot] = 0.0
    turn_rates[:-1][moving] = turns[moving] / steps[moving]
    done = np.maximum(along - along[first], 0.0) / max(float(along[-1] - along[first]), 1e-12)
    start = world.movables.poses
    ends = np.array(push.object_poses)
    gone = ends[:, 0] >= 0.5 * REMOVED
    ahead = np.max(robot.vertices[:, 0]) + _INSIDE * world.movables.radii[gone]
    x, y, theta = poses[-1]
    ends[gone, 0], ends[gone, 1] = x + ahead * np.cos(theta), y + ahead * np.sin(theta)
    moves = ends - start
    moves[:, 2] = wrap_angle(moves[:, 2])
    return Plan(
        times=np.concatenate([[0.0], np.cumsum(steps)]),
        poses=poses,
        speeds=speeds,
        turn_rates=turn_rates,
        travel_cost=robot.mass * float(along[-1]),
        interaction_cost=push.work,
        object_poses=start + done[:, None, None] * moves,
        subtasks=(SubTask(push.serves, first, len(poses) - 1),),
    )


def _way(world: World, route: Legs | None) -> FloatArray:
    """(N, 3) poses before and after each turn on the spot of a route, from where the robot is."""
    poses = [np.array(world.robot_pose)]
    if route is not None:
        for point, sign in zip(route.points, route.signs, strict=True):
            move = point - poses[-1][:2]
            heading = np.arctan2(move[1], move[0]) + (np.pi if sign < 0.0 else 0.0)
            poses += [np.array([*poses[-1][:2], heading]), np.array([*point, heading])]
    return np.array(poses)
