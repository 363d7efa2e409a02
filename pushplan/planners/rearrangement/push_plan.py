"""One push with the route to its start, as a `Plan`: for pictures, logs and clients of a server."""

from __future__ import annotations

import numpy as np

from pushplan.control import Legs
from pushplan.geometry.angles import wrap_angle
from pushplan.planners.rearrangement.push import Push
from pushplan.world import Plan, SubTask, World
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import arc_lengths


def push_plan(world: World, route: Legs | None, push: Push) -> Plan:
    """The way to a push and the push itself, at full speed.

    A push is predicted at its end only: in between, ``object_poses`` follow the straight line from
    where the objects are, as far as the robot has pushed.

    Args:
        world: the snapshot from which the robot starts, with the objects that the push knows.
        route: to the start of the push; None if the robot is there.
        push: the push.
    """
    way = _way(world, route)
    poses = np.concatenate([way, push.poses])
    along, first = arc_lengths(poses), len(way)
    speed = world.robot.max_speed
    done = np.maximum(along - along[first], 0.0) / max(float(along[-1] - along[first]), 1e-12)
    start = world.movables.poses
    moves = push.object_poses - start
    moves[:, 2] = wrap_angle(moves[:, 2])
    return Plan(
        times=along / speed,
        poses=poses,
        speeds=np.full(len(poses), speed),
        turn_rates=np.zeros(len(poses)),
        travel_cost=world.robot.mass * float(along[-1]),
        interaction_cost=push.work,
        object_poses=start + done[:, None, None] * moves,
        subtasks=(SubTask(push.serves, first, len(poses) - 1),),
    )


def _way(world: World, route: Legs | None) -> FloatArray:
    """(N, 3) poses at the corners of a route, headed as the robot drives the leg before each."""
    here: FloatArray = world.robot_pose[None]
    if route is None or not len(route.points):
        return here
    corners = np.concatenate([here[:, :2], route.points])
    moves = np.diff(corners, axis=0)
    headings = np.arctan2(moves[:, 1], moves[:, 0])
    headings = headings + np.where(np.asarray(route.signs) < 0.0, np.pi, 0.0)
    return np.concatenate([here, np.column_stack([route.points, headings])])
