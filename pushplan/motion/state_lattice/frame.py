"""The frame of a lattice: origin at the robot, first axis towards the goal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pushplan.world import GoalDisc, World
from pushplan.world.checks import FloatArray


@dataclass(frozen=True)
class Frame:
    """A turned and shifted frame."""

    x: float  # of its origin [m], world frame
    y: float  # likewise
    angle: float  # of its first axis [rad]

    @classmethod
    def towards_goal(cls, world: World) -> Frame:
        """Origin at the robot; first axis along the normal of the goal line, or to the disc."""
        goal = world.navigation_goal
        x, y, theta = (float(value) for value in world.robot_pose)
        if isinstance(goal, GoalDisc):
            dx, dy = goal.center - world.robot_pose[:2]
            return cls(x, y, float(np.arctan2(dy, dx)) if dx or dy else theta)
        return cls(x, y, float(np.arctan2(goal.normal[1], goal.normal[0])))

    @property
    def rotation(self) -> FloatArray:
        """(2, 2) its axes in the world frame, as columns."""
        c = np.cos(self.angle)
        s = np.sin(self.angle)
        return np.array([[c, -s], [s, c]])

    def from_world(self, points_world: FloatArray) -> FloatArray:
        """(N, 2) points of the world in this frame [m]."""
        points: FloatArray = (points_world - np.array([self.x, self.y])) @ self.rotation
        return points

    def heading(self, theta_world: float) -> float:
        """A heading of the world in this frame, in [-π, π) [rad]."""
        return float((theta_world - self.angle + np.pi) % (2.0 * np.pi) - np.pi)
