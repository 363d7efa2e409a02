"""Settings of the manipulation policies."""

from __future__ import annotations

from dataclasses import dataclass

from pushplan.world.checks import expect, integer, number


@dataclass(frozen=True)
class SubTaskConfig:
    """How candidate pushes are made and priced. Lengths are in circumscribed radii of the robot.

    Args:
        price: metres of the robot's own path that one metre of an object's path is worth, for an
            object as heavy as the robot: the w of J = l_0 + w sum(m_i l_i) / m_0.
        friction: Coulomb coefficient between robot and objects, for the prediction.
        static_friction: the same between objects and walls.
        gyration_scale: see `QuasiStatic`.
        cell: side of a cell of the lattice on which approaches are planned.
        coarse_cell: the same of the lattice on which approaches between pushes are priced.
        later: share of the price of contacts in those, as objects will have gone by then.
        nuisance: least price of carrying an object along on an approach, however light it is.
        slack: room between the bumper and the object where a push begins.
        margin: distance that approaches keep from what is static.
        turn_price: price of a turn by one radian on the spot, so that needless ones are left out.
        per_box: how many pushes are kept for each object.
        most: how many are kept for all objects together, by which the time of a plan is bounded.
        rehearsals: how many pushes are rehearsed at most before one is chosen.
        period: time between two commands [s].
        mpc: whether a push of one object along its way is driven by `PushingMpc`; else by the law
            of its prediction, as all other pushes are.
    """

    price: float = 12.0
    friction: float = 0.2
    static_friction: float = 0.45
    gyration_scale: float = 1.0
    cell: float = 0.2
    coarse_cell: float = 0.3
    later: float = 0.5
    nuisance: float = 1.0
    slack: float = 0.05
    margin: float = 0.03
    turn_price: float = 0.03
    per_box: int = 16
    most: int = 80
    rehearsals: int = 30
    period: float = 0.2
    mpc: bool = True

    def __post_init__(self) -> None:
        for name in ("price", "friction", "static_friction", "turn_price", "nuisance"):
            number(f"subtask {name}", getattr(self, name), low=0.0, high=1e6)
        for name in ("slack", "margin", "later"):
            number(f"subtask {name}", getattr(self, name), low=0.0, high=1.0)
        for name in ("cell", "coarse_cell"):
            number(f"subtask {name}", getattr(self, name), low=0.05, high=2.0)
        for name in ("gyration_scale", "period"):
            number(f"subtask {name}", getattr(self, name), low=0.0, high=1e3, open_low=True)
        integer("subtask per_box", self.per_box, low=1, high=1000)
        integer("subtask most", self.most, low=1, high=10000)
        integer("subtask rehearsals", self.rehearsals, low=1, high=1000)
        expect("subtask mpc", self.mpc, bool)
