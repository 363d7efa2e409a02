"""`ShipLattice`: A* over motion primitives among floes, then made better against the prediction."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pushplan.interaction import InteractionModel
from pushplan.motion.speed_profile import turning_radius
from pushplan.motion.state_lattice.lattice_builder import LatticeBuilder
from pushplan.planners.ship_lattice.ship_lattice_call import ShipLatticeCall
from pushplan.planners.ship_lattice.ship_lattice_config import ShipLatticeConfig
from pushplan.world import PlanResult, Stop, World
from pushplan.world.checks import expect
from pushplan.world.planning_call import PlanningCall


@dataclass(frozen=True)
class ShipLattice:
    """State lattice for a vehicle of bounded turn rate in a field of things that it may push.

    After de Schaetzen et al., "Real-time navigation for autonomous surface vehicles in ice-covered
    waters" (2023), and AUTO-IceNav (arXiv 2411.17155). Use it to reach a goal line through
    many small objects; a goal disc and walls are understood too. The robot's origin stays within
    the bounds. One iteration is a batch of expanded nodes or one shortcut.

    Args:
        config: parameters.
        interaction: predicts what a path does to the objects; by default `IceInteraction` in open
            water, and `QuasiStatic` where there are walls.
    """

    config: ShipLatticeConfig = field(default_factory=ShipLatticeConfig)
    interaction: InteractionModel | None = None

    def __post_init__(self) -> None:
        expect("config", self.config, ShipLatticeConfig)
        if self.interaction is not None:
            expect("interaction", self.interaction, InteractionModel)  # type: ignore[type-abstract]

    def plan(
        self, world: World, *, stop: Stop | None = None, rng: np.random.Generator | None = None
    ) -> PlanResult:
        """Plan from ``world``; see `pushplan.world.Planner`.

        Raises:
            InvalidInputError: if the world's goal is not one for the robot.
        """
        call = PlanningCall(world, stop, rng)
        search = ShipLatticeCall(call, self.config, self.interaction)
        status = search.run() or call.stopped_status
        return call.result(
            status,
            search.plan() if status.has_plan else None,
            search.first_solution_s,
            search.iterations,
            search.expanded,
            lattice_cost=search.lattice_cost,
            shortcuts=float(search.shortcuts),
        )

    def prepare(self, world: World) -> None:
        """Make what depends on the ship alone, which the first call would do otherwise.

        That is the motion primitives and what the hull covers along them, 20 to 60 ms; it is kept
        for all planners of this process. `PlanFollower` does it at the
        start of an episode.
        """
        radius = turning_radius(world.robot, self.config.turn_fraction)
        LatticeBuilder(world, self.config, radius=radius, side=0.0).build()


def published() -> ShipLattice:
    """The lattice of AUTO-IceNav as Bench-Push uses it, see `ShipLatticeConfig.published`."""
    return ShipLattice(ShipLatticeConfig.published())


def quick() -> ShipLattice:
    """One search and nothing after it, see `ShipLatticeConfig.quick`."""
    return ShipLattice(ShipLatticeConfig.quick())
