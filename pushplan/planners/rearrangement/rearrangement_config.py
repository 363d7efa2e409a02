"""Settings of the manipulation policies."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from pushplan.world import UnknownNameError
from pushplan.world.checks import expect, integer, number


@dataclass(frozen=True)
class RearrangementConfig:
    """Settings of candidate pushes and their costs. Lengths are in circumscribed radii.

    Args:
        work_weight: metres of the robot's own path that one metre of an object's path is worth, for
            an object as heavy as the robot: the w of J = l_0 + w sum(m_i l_i) / m_0.
        friction: Coulomb coefficient between robot and objects, for the prediction.
        static_friction: the same between objects and walls.
        gyration_scale: see `QuasiStatic`.
        cell: side of a cell of the lattice on which approaches are planned.
        coarse_cell: the same for the cost of approaches between pushes.
        later_fraction: of the cost of contacts in those, as objects will have gone by then.
        contact_cost: least cost of carrying an object along on an approach, however light it is.
        slack: clearance between the bumper and the object where a push begins.
        margin: distance that approaches keep from what is static.
        turn_cost: cost of a turn by one radian on the spot, so that needless ones are left out.
        per_object: how many pushes are kept for each object.
        max_pushes: how many are kept for all together, by which the time of a plan is bounded.
        max_simulations: how many pushes are simulated before one is chosen.
        response: time in which an error of heading or place is driven off [s]; longer than the
            robot's delay.
        mpc: whether a push of one object along its path is driven by `PushingMpc`; else by the
            controller of its prediction, as all other pushes are.
    """

    work_weight: float = 12.0
    friction: float = 0.2
    static_friction: float = 0.45
    gyration_scale: float = 1.0
    cell: float = 0.2
    coarse_cell: float = 0.3
    later_fraction: float = 0.5
    contact_cost: float = 1.0
    slack: float = 0.05
    margin: float = 0.03
    turn_cost: float = 0.03
    per_object: int = 16
    max_pushes: int = 80
    max_simulations: int = 30
    response: float = 0.2
    mpc: bool = True

    def __post_init__(self) -> None:
        for name in ("work_weight", "friction", "static_friction", "turn_cost", "contact_cost"):
            number(f"rearrangement {name}", getattr(self, name), low=0.0, high=1e6)
        for name in ("slack", "margin", "later_fraction"):
            number(f"rearrangement {name}", getattr(self, name), low=0.0, high=1.0)
        for name in ("cell", "coarse_cell"):
            number(f"rearrangement {name}", getattr(self, name), low=0.05, high=2.0)
        for name in ("gyration_scale", "response"):
            number(f"rearrangement {name}", getattr(self, name), low=0.0, high=1e3, open_low=True)
        integer("rearrangement per_object", self.per_object, low=1, high=1000)
        integer("rearrangement max_pushes", self.max_pushes, low=1, high=10000)
        integer("rearrangement max_simulations", self.max_simulations, low=1, high=1000)
        expect("rearrangement mpc", self.mpc, bool)

    @classmethod
    def of(cls, **changes: Any) -> RearrangementConfig:
        """The default settings with some fields changed.

        Raises:
            UnknownNameError: if there is no such field.
        """
        names = [field.name for field in fields(cls)]
        for name in changes:
            if name not in names:
                raise UnknownNameError("setting of rearrangement", name, names)
        return cls(**changes)
