"""Settings of the manipulation policies."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated, Any, ClassVar

from pushplan.planners.rearrangement.primitives import PRIMITIVES, PushPrimitive
from pushplan.planners.rearrangement.relocation_config import RELOCATION, RelocationConfig
from pushplan.world import UnknownNameError
from pushplan.world.checked_fields import (
    CheckedFields,
    Fraction,
    Limits,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    PositiveFraction,
    PositiveInt,
)


@dataclass(frozen=True)
class RearrangementConfig(CheckedFields):
    """Settings of candidate pushes and their costs. Lengths are in circumscribed radii.

    Args:
        work_weight: metres of the robot's own path that one metre of an object's path is worth, for
            an object as heavy as the robot: the w of J = l_0 + w sum(m_i l_i) / m_0.
        friction: Coulomb coefficient between robot and objects, for the prediction.
        static_friction: the same between objects and walls.
        gyration_scale: see `QuasiStatic`.
        step: distance between two commands of a predicted push.
        curvature: of the robot's path where it steers most [1 / circumscribed radius].
        cell: side of a cell of the lattice on which approaches are planned.
        later_fraction: of the cost of contacts in those, as objects will have gone by then.
        far: cost of getting to what cannot be got to later [diagonals of the map].
        contact_cost: least cost of carrying an object along on an approach, however light it is.
        target_cost: what is added to it for the object that is to be pushed.
        around_cost: the same where that has spoilt the push, so that the route leads around it.
        arm: how far a turn by one radian carries an object along.
        slack: clearance between the bumper and the object where a push begins.
        margin: distance that approaches keep from what is static.
        turn_cost: cost of a turn by one radian on the spot, so that needless ones are left out.
        early: how far before something goes wrong a push ends that does not get home.
        detour: how much farther than the nearest edge of an area one may be that an object is
            pushed across [times the distance].
        per_object: how many pushes are kept for each object.
        max_pushes: how many are kept for all together, by which the time of a plan is bounded.
        max_steps: how many steps a predicted push has at most.
        max_simulations: how many pushes are simulated before one is chosen.
        max_rollouts: after how many simulated pushes a choice is made among those that are known,
            unless a stop rule is given; searches for relocations have limits of their own.
        max_searches: how many objects relocations are searched for before one is chosen.
        response: time in which an error of heading or place is driven off [s]; longer than the
            robot's delay.
        mpc: whether a push of one object along its path is driven by `PushingMpc`; else by the
            controller of its prediction, as all other pushes are.
        progress: by which an object has to get on in the time in which the robot could drive a
            radius, or turn by 0.15 rad.
        retreat: how far the robot backs off where it is stuck.
        max_failures: after so many a push waits until something else has been done.
        max_relocations: after so many an object waits until something else has been done.
        position_noise: standard deviation of the places that are seen, after filtering [m]; the
            robot is not placed more precisely, and objects have to be clear of the goal's edge by
            twice as much.
        heading_noise: the same of the headings [rad].
        max_rounds: how often pushes that have failed are tried anew before what is left is given
            up.
        primitives: the table of pushes that are tried.
        relocation: settings of the search for relocations.
    """

    work_weight: Annotated[float, Limits(0.0, 1e6)] = 12.0
    friction: Annotated[float, Limits(0.0, 1e6)] = 0.2
    static_friction: Annotated[float, Limits(0.0, 1e6)] = 0.0
    gyration_scale: Annotated[float, Limits(0.0, 1e3, open_low=True)] = 1.0
    step: PositiveFraction = 0.08
    curvature: PositiveFloat = 1.5
    cell: Annotated[float, Limits(0.05, 2.0)] = 0.2
    later_fraction: Fraction = 0.5
    far: PositiveFloat = 5.0
    contact_cost: Annotated[float, Limits(0.0, 1e6)] = 1.0
    target_cost: NonNegativeFloat = 5.0
    around_cost: NonNegativeFloat = 50.0
    arm: NonNegativeFloat = 0.8
    slack: Fraction = 0.05
    margin: Fraction = 0.03
    turn_cost: Annotated[float, Limits(0.0, 1e6)] = 0.03
    early: NonNegativeFloat = 0.6
    detour: Annotated[float, Limits(1.0)] = 1.3
    per_object: Annotated[int, Limits(1, 1000)] = 16
    max_pushes: Annotated[int, Limits(1, 10_000)] = 80
    max_steps: Annotated[int, Limits(1, 100_000)] = 5000
    max_simulations: Annotated[int, Limits(1, 1000)] = 30
    max_rollouts: PositiveInt = 1000
    max_searches: PositiveInt = 6
    response: Annotated[float, Limits(0.0, 1e3, open_low=True)] = 0.2
    mpc: bool = True
    progress: PositiveFloat = 0.05
    retreat: PositiveFloat = 0.3
    max_failures: PositiveInt = 3
    max_relocations: PositiveInt = 12
    position_noise: NonNegativeFloat = 0.0
    heading_noise: NonNegativeFloat = 0.0
    max_rounds: NonNegativeInt = 6
    primitives: tuple[PushPrimitive, ...] = PRIMITIVES
    relocation: RelocationConfig = RELOCATION

    field_prefix: ClassVar[str] = "rearrangement "

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
