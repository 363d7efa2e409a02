"""`BuiltLattice`: a lattice among the things of one world."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from pushplan.core import motion as core
from pushplan.motion.state_lattice.frame import Frame
from pushplan.motion.state_lattice.pose_lattice import PoseLattice
from pushplan.motion.state_lattice.primitive_set import PrimitiveSet
from pushplan.world import World
from pushplan.world.checks import FloatArray


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
