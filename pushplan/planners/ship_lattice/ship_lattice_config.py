"""Parameters of the ship lattice planner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Self

from pushplan.motion.state_lattice.lattice_config import LatticeConfig
from pushplan.world.checked_fields import (
    Each,
    Limits,
    NonNegativeFloat,
    NonNegativeInt,
    OneOf,
)

FLOE_COSTS = ("displacement", "kinetic-energy")


@dataclass(frozen=True)
class ShipLatticeConfig(LatticeConfig):
    """Parameters of `ShipLattice`, beside those of its lattice. R and B as in `LatticeConfig`.

    Args:
        push_weight: w, the cost of a unit of interaction work against a unit of travel work.
        floe_cost: by how far a floe would be pushed ("displacement"), or by the kinetic energy
            that the collision takes ("kinetic-energy", as published).
        collision_weight: α, factor on the kinetic-energy cost.
        exponent: how the cost of a floe is spread over it, see `FloeCosts`.
        side: distance of the robot's origin from the bounds [B]; less where it starts nearer.
        searches: of the lattice, one after the other, as factors on ``push_weight``. The first path
            is there after the first one; the sweeps choose among all.
        shortcuts: random changes of the path of the lattice that are tried, each with a sweep.
        sweep_horizon: how far along a path the sweeps look [R]. 0 for no sweeps: the plan is the
            first path, and predicts nothing.
    """

    push_weight: NonNegativeFloat = 1.5
    floe_cost: Annotated[str, OneOf(FLOE_COSTS)] = "displacement"
    collision_weight: NonNegativeFloat = 1.0
    exponent: Annotated[float, Limits(-0.9, 4.0)] = -0.5
    side: NonNegativeFloat = 0.75
    searches: Annotated[tuple[float, ...], Each(Limits(0.0))] = (1.0, 0.0, 0.5, 2.0, 4.0)
    shortcuts: NonNegativeInt = 60
    sweep_horizon: NonNegativeFloat = 10.0

    @classmethod
    def quick(cls) -> Self:
        """One search and nothing after it."""
        return cls(push_weight=3.0, inflation=1.35, searches=(1.0,), shortcuts=0, sweep_horizon=0.0)

    @classmethod
    def published(cls, **others: Any) -> Self:
        """AUTO-IceNav's lattice as Bench-Push uses it: kinetic-energy cost, nothing after it."""
        return super().published(
            push_weight=1.0,
            floe_cost="kinetic-energy",
            collision_weight=0.5,
            side=0.5,
            exponent=1.0,
            searches=(1.0,),
            shortcuts=0,
            sweep_horizon=0.0,
            **others,
        )
