"""Cost of running over a floe, before anything is known about the path."""

from __future__ import annotations

import numpy as np

from pushplan.motion.state_lattice.cost_map import FloeCosts
from pushplan.planners.ship_lattice.ship_lattice_config import ShipLatticeConfig
from pushplan.world import World

_SOFT = 0.05  # keeps the cost of a cell finite at the edge of a floe where the exponent is negative
_DISPLACEMENT = 2.7
"""Distance by which a floe that the hull runs over is pushed, in half beams plus floe radii."""


def floe_costs(
    config: ShipLatticeConfig,  # says what a floe costs
    world: World,
    cell: float,  # side of a cell of the map [m]
) -> FloeCosts:
    """Costs of all floes of a world."""
    floes = world.movables
    robot = world.robot
    half = max(robot.inscribed_radius, 0.1 * robot.circumscribed_radius)
    areas = floes.contact_areas
    radii = np.sqrt(areas / np.pi)
    if config.floe_cost == "kinetic-energy":
        ship = robot.mass
        masses = floes.masses
        energy = ship * masses * (masses + 2.0 * ship) / (2.0 * (ship + masses) ** 2)
        # the published map gives this to the middle of a floe and less to its edge:
        # the mean of 1 - d²/(r + 1/2)² over a disc of r cells
        cells = radii / cell
        mean = 1.0 - 0.5 * (cells / (cells + 0.5)) ** 2
        middle = config.collision_weight * energy / (0.5 * ship) * cell / half
        soft = float(np.mean((1.0 + 0.5 / np.maximum(cells, 0.1)) ** 2 - 1.0))
        return FloeCosts(middle * mean * areas / cell**2, areas, config.exponent, soft)
    pushed = _DISPLACEMENT * (half + radii)
    weight = config.push_weight / robot.mass
    return FloeCosts(weight * floes.masses * pushed, areas, config.exponent, _SOFT)
