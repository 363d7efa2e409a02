"""State-lattice planning for a ship in ice."""

from pushplan.planners.ship_lattice.ship_lattice import ShipLattice, ShipLatticeConfig

__all__ = ["ShipLattice", "ShipLatticeConfig"]
