"""From a chain of pushes to a plan: drives with turns on the spot, pushes, and back off them."""

from __future__ import annotations

import math

import numpy as np

from pushplan.interaction import InteractionModel
from pushplan.motion.keyholes.keyhole_search import KeyholeEnd
from pushplan.motion.speed_profile import SweptPath, timed_plan
from pushplan.world import GoalPose, Plan, World
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import arc_lengths, step_lengths

_SPACING = 0.15  # distance between the poses of a drive [circumscribed radii]
_TURN = 0.1  # angle between those of a turn [rad]


def keyhole_plan(
    world: World, end: KeyholeEnd, interaction: InteractionModel, turn_fraction: float
) -> Plan:
    """The plan that carries out some pushes and drives on to the goal.

    Args:
        world: the scene now.
        end: after the last push; the goal is reached from there.
        interaction: predicts the objects along all of it.
        turn_fraction: fraction of the greatest turn rate that is used.
    """
    poses, curvatures = _driven(world, end)
    found = interaction.sweep(world, poses)
    objects = found.object_poses
    works = np.zeros(len(poses))
    if len(world.movables):
        works[1:] = np.cumsum(step_lengths(objects) @ world.movables.masses)
    return timed_plan(
        world, SweptPath(poses, curvatures, objects, arc_lengths(poses), works), turn_fraction
    )


def _driven(world: World, end: KeyholeEnd) -> tuple[FloatArray, FloatArray]:
    """(N, 3) poses of the robot, and (N,) curvatures of what leads to each of them."""
    spacing = _SPACING * world.robot.circumscribed_radius
    track = _Track(world.robot_pose, spacing)
    first, *pushes = end.chain()
    track.follow(first.path)
    for push in pushes:
        track.drive(push.drive)
        track.turn(float(push.path[0, 2]))
        track.follow(push.path)
    track.drive(end.state.path_to_goal())
    goal = world.goal
    if isinstance(goal, GoalPose):
        track.drive(np.array([track.poses[-1][:2], goal.center]))
        track.turn(goal.heading)
    return np.array(track.poses), np.array(track.curvatures)


class _Track:
    """Poses one after another, with turns on the spot where the heading changes."""

    def __init__(self, pose: FloatArray, spacing: float) -> None:
        self.poses = [np.array(pose)]
        self.curvatures = [0.0]
        self._spacing = spacing

    def turn(self, heading: float) -> None:
        """Turn on the spot to a heading [rad], the shorter way."""
        x, y, theta = self.poses[-1].tolist()
        angle = math.remainder(heading - theta, math.tau)
        count = math.ceil(abs(angle) / _TURN - 1e-9)
        for i in range(1, count + 1):
            self.poses.append(np.array([x, y, theta + angle * i / count]))
            self.curvatures.append(math.copysign(math.inf, angle))

    def drive(self, corners: FloatArray) -> None:
        """Drive ahead along a polyline (N, 2) that begins here."""
        for corner in corners[1:]:
            x, y, _ = self.poses[-1].tolist()
            away = corner - (x, y)
            length = float(np.hypot(*away))
            if length < 1e-6:
                continue
            self.turn(math.atan2(away[1], away[0]))
            heading = self.poses[-1][2]
            count = math.ceil(length / self._spacing)
            for i in range(1, count + 1):
                self._go(np.array([x, y]) + away * i / count, heading)

    def follow(self, path: FloatArray) -> None:
        """Go straight through poses (N, 3) of one heading that begin here, ahead or back."""
        heading = self.poses[-1][2]
        for pose in path[1:]:
            self._go(pose[:2], heading)

    def _go(self, place: FloatArray, heading: float) -> None:
        self.poses.append(np.array([*place, heading]))
        self.curvatures.append(0.0)
