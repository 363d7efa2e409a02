"""Parameters of the ship lattice planner."""

from __future__ import annotations

from dataclasses import dataclass

from pushplan.motion.state_lattice.primitives import PrimitiveConfig
from pushplan.world.checks import choice, integer, number
from pushplan.world.errors import InvalidInputError

PRICES = ("displacement", "kinetic-energy")
GUIDES = ("estimate", "bound")


@dataclass(frozen=True)
class ShipLatticeConfig:
    """Parameters of `ShipLattice`. R is the circumscribed radius, B twice the inscribed one.

    Args:
        push_weight: w, the price of a unit of interaction work against a unit of travel work.
        price: how a floe is priced: by how far it would be pushed ("displacement"), or by the
            kinetic energy that the collision takes ("kinetic-energy", as published).
        collision_weight: α, factor on the kinetic-energy price.
        displacement: how far a floe is pushed that the hull runs over, in sums of half the beam
            and its radius.
        exponent: how the price of a floe is spread over it, see `cost_map.add_floes`.
        headings: of the lattice, 8, 16 or 32.
        variants: primitives from one heading to another one.
        shifts: lane changes to each side.
        step: of the lattice, about [B]; the turning radius is a whole number of steps.
        cells_per_step: cells of the cost map in a step of the lattice.
        turn_share: share of the greatest turn rate that plans use; the rest is for tracking.
        side: distance of the robot's origin from the bounds [B]; less where it starts nearer.
        inset: how far beyond the goal line a plan ends [R].
        horizon: how far ahead a plan goes at most [R].
        spacing: distance between the poses of a plan [R].
        guide: what the search is guided by: a "bound" below the cost to go, with which the path
            costs at most ``inflation`` times the least, or an "estimate" of it, with which it is
            found with far fewer nodes, and has cost 0 to 3 % more than the least in Ship-Ice.
        inflation: factor on the guide.
        batch: nodes expanded between two looks at the stop rule.
        searches: of the lattice, one after the other, as factors on ``push_weight``. The first path
            is there after the first one; the sweeps choose among all.
        refinement: iterations of the continuous optimisation of the best path, which cannot be
            interrupted; 0 for none.
        repairs: attempts at improving the path of the lattice, each priced by a sweep.
        sweep_ahead: how far along a path the sweeps look [R]. 0 for no sweeps: the plan is the
            first path, and predicts nothing.
    """

    push_weight: float = 1.5
    price: str = "displacement"
    collision_weight: float = 1.0
    displacement: float = 2.7
    exponent: float = -0.5
    headings: int = 16
    variants: int = 2
    shifts: int = 3
    step: float = 0.5
    cells_per_step: int = 4
    turn_share: float = 0.9
    side: float = 0.75
    inset: float = 0.2
    horizon: float = 60.0
    spacing: float = 0.15
    guide: str = "estimate"
    inflation: float = 1.2
    batch: int = 100
    searches: tuple[float, ...] = (1.0, 0.0, 0.5, 2.0, 4.0)
    refinement: int = 0
    repairs: int = 60
    sweep_ahead: float = 10.0

    def __post_init__(self) -> None:
        choice("price", self.price, PRICES)
        choice("guide", self.guide, GUIDES)
        for name in (
            "push_weight",
            "collision_weight",
            "displacement",
            "side",
            "inset",
            "sweep_ahead",
        ):
            number(name, getattr(self, name), low=0.0)
        number("exponent", self.exponent, low=-0.9, high=4.0)
        number("turn_share", self.turn_share, low=0.0, high=1.0, open_low=True)
        for name in ("step", "horizon", "spacing"):
            number(name, getattr(self, name), low=0.0, open_low=True)
        for name in ("cells_per_step", "batch"):
            integer(name, getattr(self, name), low=1)
        number("inflation", self.inflation, low=1.0)
        for name in ("repairs", "refinement"):
            integer(name, getattr(self, name), low=0)
        if not isinstance(self.searches, (tuple, list)) or len(self.searches) == 0:
            raise InvalidInputError(f"searches must be one factor or more, got {self.searches!r}")
        object.__setattr__(self, "searches", tuple(self.searches))
        for factor in self.searches:
            number("searches", factor, low=0.0)
        PrimitiveConfig(self.headings, 1.0, self.variants, self.shifts)

    @classmethod
    def quick(cls) -> ShipLatticeConfig:
        """One search and nothing after it."""
        return cls(push_weight=3.0, inflation=1.35, searches=(1.0,), repairs=0, sweep_ahead=0.0)

    @classmethod
    def published(cls) -> ShipLatticeConfig:
        """The planner of AUTO-IceNav: 8 headings, kinetic-energy price, no look at the motion."""
        return cls(
            push_weight=1.0,
            price="kinetic-energy",
            collision_weight=0.5,
            inset=0.02,
            side=0.5,
            exponent=1.0,
            headings=8,
            variants=1,
            shifts=0,
            step=0.5,
            guide="bound",
            inflation=1.0,
            searches=(1.0,),
            repairs=0,
            sweep_ahead=0.0,
        )
