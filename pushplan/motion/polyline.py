"""Plans from polylines, for planners that know only the shape of a path."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from pushplan.world import Plan, World
from pushplan.world.checks import FloatArray


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
    keep = np.concatenate([[True], lengths > 1e-9])
    path, moves, lengths = path[keep], moves[keep[1:]], lengths[keep[1:]]
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
