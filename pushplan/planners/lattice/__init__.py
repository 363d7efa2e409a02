"""State lattices: one A* kernel, motion primitives as data, and the ship planner on them."""

from pushplan.planners.lattice.astar import AStar
from pushplan.planners.lattice.build import BuiltLattice, LatticeBuilder
from pushplan.planners.lattice.config import ShipLatticeConfig
from pushplan.planners.lattice.pose_lattice import PoseLattice
from pushplan.planners.lattice.primitives import PrimitiveConfig, PrimitiveSet, primitives
from pushplan.planners.lattice.ship import ShipLattice

__all__ = [
    "AStar",
    "BuiltLattice",
    "LatticeBuilder",
    "PoseLattice",
    "PrimitiveConfig",
    "PrimitiveSet",
    "ShipLattice",
    "ShipLatticeConfig",
    "primitives",
]
