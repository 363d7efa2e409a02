"""`Namo`: opens closed ways by pushes that are chosen for it, one keyhole after another."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from pushplan.interaction import InteractionModel, QuasiStatic
from pushplan.motion.keyholes import KeyholeConfig, KeyholeSearch, suits_keyholes
from pushplan.motion.keyholes.keyhole_plan import keyhole_plan
from pushplan.motion.speed_profile import start_margin
from pushplan.motion.time_slicing import Stopped
from pushplan.planners.registry import make_planner
from pushplan.world import MaxIterations, Plan, Planner, PlanResult, PlanStatus, Stop, World
from pushplan.world.checked_fields import Fraction, NonNegativeInt, PositiveFraction
from pushplan.world.checks import expect
from pushplan.world.planning_call import PlanningCall
from pushplan.world.stop import DefaultBudget, StopCheck


@dataclass(frozen=True)
class NamoConfig(KeyholeConfig):
    """Parameters of `Namo`: those of its search, described in `KeyholeConfig`, and three more.

    Args:
        turn_fraction: fraction of the greatest turn rate that plans use; the rest is for tracking.
        straight_iterations: of the navigator at most, where the way is closed; at 0 it is asked
            only where no push is found.
        straight_margin: distance from walls that it keeps there, where pushes are found [R].
    """

    turn_fraction: PositiveFraction = 0.9
    straight_iterations: NonNegativeInt = 6000
    straight_margin: Fraction = 0.15


@dataclass(frozen=True)
class Namo:
    """Navigation among movable obstacles, for a robot that turns on the spot and goes back.

    Where the goal lies in the component of free space that the robot is in, the robot cannot turn
    on the spot or drive back, there are no walls or too many objects, the plan is that of the
    navigator. Elsewhere a `KeyholeSearch` looks for pushes that connect the component with that of
    the goal, at the cost l₀ + w Σ mᵢ lᵢ / m₀ and a penalty for what they cut off. The robot drives
    as a disc between pushes, and backs off after each. Where the navigator finds a cheaper plan,
    by pushing straight through with more distance from walls, that is taken.

    Use it where objects hold the doors, and a wrong push may close them for good. Without a stop
    rule it ends after a fixed number of pushes, so the same seed gives the same plan. One
    iteration is a push that is simulated.

    Args:
        config: parameters.
        interaction: predicts the objects; walls hold what is squeezed against them by default.
        navigator: plans where the way is open, and where no push is found; the push-aware planner
            by default.
    """

    config: NamoConfig = field(default_factory=NamoConfig)
    interaction: InteractionModel = field(
        default_factory=lambda: QuasiStatic(friction=0.1, static_friction=0.5)
    )
    navigator: Planner = field(default_factory=lambda: make_planner("push-aware"))

    def __post_init__(self) -> None:
        # the search needs it; its import must not take the time of the first call
        import scipy.ndimage  # noqa: F401

        expect("config", self.config, NamoConfig)
        expect("interaction", self.interaction, InteractionModel)  # type: ignore[type-abstract]
        expect("navigator", self.navigator, Planner)  # type: ignore[type-abstract]

    def plan(
        self, world: World, *, stop: Stop | None = None, rng: np.random.Generator | None = None
    ) -> PlanResult:
        """Plan from ``world``; see `pushplan.world.Planner`.

        Raises:
            InvalidInputError: if the world's goal is not one for the robot.
        """
        call = PlanningCall(world, stop, rng, DefaultBudget(self.config.default_pushes))
        world = call.world
        goal = call.world.navigation_goal
        there = goal.distance(*world.robot_pose[:2].tolist()) == 0.0
        if there or not suits_keyholes(world, self.config):
            return self.navigator.plan(world, stop=stop, rng=call.rng)
        search = KeyholeSearch(
            world, self.config, self.interaction, lambda pushes: call.check(pushes, np.inf)
        )
        plan = None
        try:
            end = search.run()
            if end is not None and end.before is not None:
                plan = keyhole_plan(world, end, self.interaction, self.config.turn_fraction)
        except Stopped:
            return call.result(call.stopped_status, iterations=search.pushes)
        if end is not None and end.before is None:
            rest = _Rest(call, search.pushes) if call.has_rule else stop
            return self.navigator.plan(world, stop=rest, rng=call.rng)
        other = self._straight(call, search.pushes, wanted=end is None)
        if end is None:
            assert other is not None
            if other.status is not PlanStatus.TIMED_OUT:
                return other
            return call.result(PlanStatus.WAY_CLOSED, iterations=search.pushes)
        weight = self.config.push_weight
        if other is not None and other.status is PlanStatus.SOLVED:
            if _cost(other.plan, weight) < _cost(plan, weight):
                return other
        blocked = start_margin(world, 0.0) is None  # the plan leads out of what it stands in
        return call.result(
            PlanStatus.PATH_ONLY if blocked else PlanStatus.SOLVED,
            plan,
            call.elapsed,
            search.pushes,
            search.expansions,
            openings=float(len(end.chain()) - 1),
        )

    def _straight(self, call: PlanningCall, pushes: int, *, wanted: bool) -> PlanResult | None:
        """Ask the navigator for a plan after some simulated pushes; None if it is not asked."""
        budget = self.config.straight_iterations
        if not (budget or wanted):
            return None
        rest: Stop = MaxIterations(budget or self.config.default_pushes)
        if call.has_rule:
            rest |= _Rest(call, pushes)
        world = call.world
        if not wanted:  # such a plan has to be worth its risk: it pushes and turns beside walls
            margin = self.config.straight_margin * world.robot.circumscribed_radius
            world = replace(world, margin=max(world.margin, margin))
        return self.navigator.plan(world, stop=rest, rng=call.rng)


def _cost(plan: Plan | None, weight: float) -> float:
    """m₀ l₀ + w Σ mᵢ lᵢ of a plan [kg m]."""
    assert plan is not None
    return plan.travel_cost + weight * plan.interaction_cost


class _Rest(Stop):
    """Rest of the stop rule of a call after some iterations."""

    def __init__(self, call: PlanningCall, iterations: int) -> None:
        self._call = call
        self._iterations = iterations

    def start(self) -> StopCheck:
        """Go on with the rule of the call."""
        return lambda iterations, cost: self._call.check(self._iterations + iterations, cost)

    @property
    def cancelled(self) -> bool:
        """True if the call was cancelled."""
        return self._call.cancelled
