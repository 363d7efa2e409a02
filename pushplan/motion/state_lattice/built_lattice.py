"""A lattice among the things of one world, and its frame: origin at the robot, x to the goal."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from pushplan.core import motion as core
from pushplan.motion.state_lattice.primitives import PrimitiveSet
from pushplan.world import GoalDisc, World
from pushplan.world.checks import FloatArray, IntArray


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


class PoseLattice(NamedTuple):
    """A lattice of H headings over rows ahead and columns across it.

    Node (h, u, v) has the number (h * rows + u) * columns + v. Lengths are in metres and places in
    steps, unless stated otherwise; costs are in metres of travel.
    """

    rows: int
    columns: int
    step: float  # Distance of neighbouring places [m]
    cells: int  # Cells of the map in a step
    corner: IntArray  # (2,) cell of the map on which the node of row 0 and column 0 lies
    first: IntArray  # (H + 1,) where the primitives of each heading start
    ends: IntArray  # (P, 3) rows, columns [steps] and heading at the end of each primitive
    lengths: FloatArray  # (P,) [m]
    boxes: FloatArray
    """(P, 4) least and greatest row and column of the robot's origin along each primitive."""
    run_first: IntArray  # (P + 1,) where the runs of each primitive start
    runs: IntArray
    """(R, 2) first cell and last cell + 1 of the cells that it newly covers, in columns, as offsets
    in the flattened sums below; the map is so large that no swath leaves it."""
    cost_sums: FloatArray
    """(map columns * (map rows + 1),) sums of the costs of each column before each row [m]."""
    blocked_sums: FloatArray
    """The same for cells that must not be covered; (0,) where there are none."""
    stride: int  # Map rows + 1
    planes: FloatArray  # (B, 3) a, b, c: the robot's origin keeps a u + b v <= c [steps]
    goal: FloatArray
    """(4,) 0 and the row of the goal line; or 1, row, column and radius of the goal disc."""
    row_bounds: FloatArray  # (H, rows) length of the path from each row and heading to the line [m]
    place_costs: FloatArray
    """(rows, columns) bound or estimate of the cost from each place to the line [m]."""
    inflation: float  # Factor on both


@dataclass(frozen=True)
class BuiltLattice:
    """A lattice among the things of one world."""

    lattice: PoseLattice
    frame: Frame  # in which it lies; its origin is the robot
    motions: PrimitiveSet  # its primitives
    start: tuple[int, int, float]  # row, column and heading [rad] of the robot
    arrives: bool  # True if the goal of the lattice is that of the world, not one before it

    @cached_property
    def graph(self) -> core.PoseLattice:
        """The lattice as the core searches it."""
        return core.PoseLattice(*self.lattice)

    def node(self, heading: int, row: int, column: int) -> int:
        """Number of a node."""
        return (heading * self.lattice.rows + row) * self.lattice.columns + column

    def finish(self, world: World) -> tuple[FloatArray, FloatArray]:
        """A point (2,) [m] and the normal (2,) of the line where paths of this lattice end."""
        normal = self.frame.rotation[:, 0]
        ahead = (self.lattice.goal[1] - self.start[0]) * self.lattice.step
        return world.robot_pose[:2] + ahead * normal, normal

    @property
    def size(self) -> int:
        """Number of nodes."""
        return self.motions.config.headings * self.lattice.rows * self.lattice.columns
