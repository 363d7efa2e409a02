"""Settings of the manipulation policies, and the table of pushes that they try."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pushplan.files.safe_files import read_data
from pushplan.interaction import QuasiStatic
from pushplan.world import UnknownNameError
from pushplan.world.checked_fields import (
    CheckedFields,
    Fraction,
    Limits,
    NonNegativeFloat,
    NonNegativeInt,
    OneOf,
    PositiveFloat,
    PositiveInt,
)
from pushplan.world.checks import expect

SHIFTS = (0.0, 0.4, -0.4, 0.75, -0.75)
"""Places of the robot's middle beside the object, in half widths of the bumper."""


@dataclass(frozen=True)
class PushPrimitive(CheckedFields):
    """Pushes of one object: every combination of lean, shift and gain.

    Args:
        controller: ``"line"`` drives straight ahead, across an open edge of a clearance area;
            ``"path"`` steers the object along its shortest path to the goal; ``"arc"`` drives short
            arcs, ahead and back, that only relocate the object.
        leans: headings of the robot against the edge's normal, or the start of the path [deg].
        shifts: places of the robot's middle left of the object's [half widths of the bumper].
        gains: of the pushing controller that follows the path.
        clearance: distance that the path keeps from what is static [half widths of the bumper]; 0
            for 0.75 radii of the object.
        deep: the path goes to the middle of a receptacle instead of its nearest place.
        partners: by how many of its neighbours, the nearest ones, the path leads past, to take one
            along.
        frictions: coefficients between robot and object with which it has to succeed as well, see
            `RearrangementConfig`.
        below: an object that has so many pushes already is left out.
    """

    controller: Annotated[str, OneOf(("line", "path", "arc"))]
    leans: tuple[float, ...] = (0.0,)
    shifts: tuple[float, ...] = SHIFTS
    gains: tuple[float, ...] = (1.5,)
    clearance: NonNegativeFloat = 1.08
    deep: bool = False
    partners: NonNegativeInt = 0
    frictions: tuple[float, ...] = ()
    below: NonNegativeInt = 2

    field_prefix: ClassVar[str] = "push primitive "


def _shipped() -> tuple[PushPrimitive, ...]:
    rows = read_data(Path(__file__).with_name("push_primitives.yaml"), "table of pushes")
    lists = ("leans", "shifts", "gains", "frictions")
    return tuple(
        PushPrimitive(**row | {name: tuple(row[name]) for name in lists if name in row})
        for row in rows
    )


PRIMITIVES = _shipped()
"""The table, simplest first."""


@dataclass(frozen=True)
class RearrangementConfig(CheckedFields):
    """Settings of candidate pushes and their costs. Lengths are in circumscribed radii.

    Args:
        work_weight: metres of the robot's own path that one metre of an object's path is worth, for
            an object as heavy as the robot: the w of J = l_0 + w sum(m_i l_i) / m_0.
        friction: Coulomb coefficient between robot and objects, for the prediction.
        static_friction: the same between objects and walls.
        gyration_scale: factor on the radius of the objects' limit surface; see
            `pushplan.interaction.QuasiStatic`.
        grip: friction between robot and objects that is counted on where an object goes to a place
            of its own: it gives the curves on which the object does not slip.
        later_fraction: of the cost of contacts in those, as objects will have gone by then.
        contact_cost: least cost of carrying an object along on an approach, however light it is.
        target_cost: what is added to it for the object that is to be pushed.
        around_cost: the same where that has spoilt the push, so that the route leads around it.
        per_object: how many pushes are kept for each object.
        max_pushes: how many are kept for all together, by which the time of a plan is bounded.
        max_simulations: how many pushes are simulated before one is chosen.
        max_rollouts: after how many simulated pushes a choice is made among those that are known,
            unless a stop rule is given; searches for relocations have limits of their own.
        max_searches: how many objects relocations are searched for before one is chosen.
        max_pause: for how long the robot stands where a time limit has interrupted a choice, while
            the search for a better push goes on in the next steps [s].
        response: time in which an error of heading or place is driven off [s]; longer than the
            robot's delay.
        mpc: a push of one object along its path is driven by `PushingMpc`; else by the
            controller of its prediction, as all other pushes are.
        order: in which objects are brought to places of their own: ``"gtsp"`` by the shortest
            tour, ``"nearest"`` first, or at ``"random"``.
        max_failures: after so many a push waits until something else has been done.
        max_relocations: after so many an object waits until something else has been done.
        position_noise: standard deviation of the places that are seen, after filtering [m]; the
            robot is not placed more precisely, and objects have to be clear of the goal's edge by
            twice as much.
        heading_noise: the same of the headings [rad].
        max_rounds: how often pushes that have failed are tried anew before what is left is given
            up.
        primitives: the table of pushes that are tried.
    """

    work_weight: Annotated[float, Limits(0.0, 1e6)] = 12.0
    friction: Annotated[float, Limits(0.0, 1e6)] = 0.2
    static_friction: Annotated[float, Limits(0.0, 1e6)] = 0.0
    gyration_scale: PositiveFloat = 1.0
    grip: Annotated[float, Limits(0.0, 10.0, open_low=True)] = 0.4
    later_fraction: Fraction = 0.5
    contact_cost: Annotated[float, Limits(0.0, 1e6)] = 1.0
    target_cost: NonNegativeFloat = 5.0
    around_cost: NonNegativeFloat = 50.0
    per_object: Annotated[int, Limits(1, 1000)] = 16
    max_pushes: Annotated[int, Limits(1, 10_000)] = 80
    max_simulations: Annotated[int, Limits(1, 1000)] = 30
    max_rollouts: PositiveInt = 1000
    max_searches: PositiveInt = 6
    max_pause: NonNegativeFloat = 3.0
    response: Annotated[float, Limits(0.0, 1e3, open_low=True)] = 0.2
    mpc: bool = True
    order: Annotated[str, OneOf(("gtsp", "nearest", "random"))] = "gtsp"
    max_failures: PositiveInt = 3
    max_relocations: PositiveInt = 12
    position_noise: NonNegativeFloat = 0.0
    heading_noise: NonNegativeFloat = 0.0
    max_rounds: NonNegativeInt = 6
    primitives: tuple[PushPrimitive, ...] = PRIMITIVES

    field_prefix: ClassVar[str] = "rearrangement "

    @classmethod
    def of(cls, *, interaction: QuasiStatic | None = None, **changes: Any) -> RearrangementConfig:
        """The default settings with some fields changed.

        Args:
            interaction: gives friction and gyration.
            changes: other fields.

        Raises:
            UnknownNameError: if there is no such field.
        """
        names = [field.name for field in fields(cls)]
        for name in changes:
            if name not in names:
                raise UnknownNameError("setting of rearrangement", name, names)
        if interaction is not None:
            model = expect("interaction", interaction, QuasiStatic)
            for name in ("friction", "static_friction", "gyration_scale"):
                changes.setdefault(name, getattr(model, name))
        return cls(**changes)
