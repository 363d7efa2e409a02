"""State-lattice planning for a ship in ice."""

from pushplan.planners.ship_lattice.ship_lattice import ShipLattice
from pushplan.planners.ship_lattice.ship_lattice_config import ShipLatticeConfig

__all__ = ["ShipLattice", "ShipLatticeConfig"]
