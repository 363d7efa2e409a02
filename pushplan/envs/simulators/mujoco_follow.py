"""Driving a robot with inertia through given poses, as nearly as its motors allow."""

from __future__ import annotations

import math

import numpy as np

from pushplan.envs.simulators.base import Simulator, straight_leg
from pushplan.world import RobotModel, Twist
from pushplan.world.checks import FloatArray

_PERIODS_PER_RADIUS = 10.0
_PATIENCE = 1.0
_LATE = 0.5


def follow_path(
    simulator: Simulator, robot: RobotModel, poses: FloatArray
) -> tuple[FloatArray, int]:
    """Sweep the robot through poses (N, 3); it stands at the first.

    A reference moves straight from pose to pose at the robot's full speed and waits where the robot
    falls behind by more than half its radius. The command is the reference's own motion plus
    feedback on the error in the robot's frame (Kanayama et al. 1990):
    v = v_r cos e_θ + k_x e_x, ω = ω_r + v_r k_y e_y + k_θ sin e_θ.

    Returns:
        (N, K, 3) object poses when the reference was at each pose, and the index of the first pose
        that could not be reached, -1 if all were: the robot was held for one second, or for as
        long as it takes to drive its own radius if that is longer.
    """
    radius = robot.circumscribed_radius
    period = radius / robot.max_speed / _PERIODS_PER_RADIUS
    patience = max(_PATIENCE, radius / robot.max_speed)
    start = simulator.object_poses
    found = np.repeat(start[None], len(poses), axis=0)
    for leg in range(1, len(poses)):
        if not _drive_leg(simulator, robot, poses[leg - 1], poses[leg], period, patience):
            found[leg:] = simulator.object_poses
            return found, leg
        found[leg] = simulator.object_poses
    return found, -1


def _drive_leg(
    simulator: Simulator,
    robot: RobotModel,
    a: FloatArray,
    b: FloatArray,
    period: float,
    patience: float,
) -> bool:
    """Move the reference from ``a`` to ``b``; False if the robot was held on the way."""
    dx, dy, turn, duration = straight_leg(robot, a, b)
    if duration == 0.0:
        return True
    middle = float(a[2]) + 0.5 * turn
    speed = (dx * math.cos(middle) + dy * math.sin(middle)) / duration
    rate = turn / duration
    done = 0.0
    waited = 0.0
    while done < duration:
        fraction = done / duration
        reference = (
            float(a[0]) + fraction * dx,
            float(a[1]) + fraction * dy,
            float(a[2]) + fraction * turn,
        )
        x, y, theta = (float(value) for value in simulator.robot_pose)
        ex = reference[0] - x
        ey = reference[1] - y
        c = math.cos(theta)
        s = math.sin(theta)
        # where the reference is in the robot's frame
        ahead = c * ex + s * ey
        left = c * ey - s * ex
        turned = math.remainder(reference[2] - theta, math.tau)
        late = math.hypot(ahead, left) > _LATE * robot.circumscribed_radius
        late |= abs(turned) > _LATE
        part = period if late else min(period, duration - done)
        if robot.slides:
            pace = 2.0 * robot.max_speed / robot.circumscribed_radius
            vx = dx / duration + pace * ex
            vy = dy / duration + pace * ey
            command = Twist(c * vx + s * vy, rate + 2.0 * pace * turned, c * vy - s * vx)
        else:
            command = _command(robot, (ahead, left, turned), speed, rate)
        simulator.step(command, part)
        if late:
            waited += part
            if waited > patience:
                return False
        else:
            done += part
            waited = 0.0
    return True


def _command(
    robot: RobotModel, error: tuple[float, float, float], speed: float, rate: float
) -> Twist:
    """Kanayama's law with gains in units of the robot's radius, within its limits."""
    ahead, left, turned = error
    radius = robot.circumscribed_radius
    pace = robot.max_speed / radius
    v = speed * math.cos(turned) + 2.0 * pace * ahead
    w = rate + 4.0 * speed / radius**2 * left + 4.0 * pace * math.sin(turned)
    top = 1.2 * robot.max_speed
    turn = 1.2 * robot.max_turn_rate
    low = min(1.2 * robot.min_speed, 0.0)
    return Twist(min(max(v, low), top), min(max(w, -turn), turn))
