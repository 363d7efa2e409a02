"""`KinodynamicRRT`: a random tree of drivable arcs, made cheaper until the stop rule fires."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pushplan.interaction import InteractionModel, QuasiStatic
from pushplan.motion.dubins_warm_start import is_far, set_aside_drive
from pushplan.motion.local_windows import warm_start
from pushplan.motion.path_improver import Candidate, PathImprover
from pushplan.motion.path_search_config import PathSearchConfig
from pushplan.motion.random_tree.tree_paths import TreePaths
from pushplan.motion.speed_profile import turning_radius
from pushplan.world import Drive, PlanResult, PlanStatus, Stop, World
from pushplan.world.checks import expect
from pushplan.world.planning_call import PlanningCall
from pushplan.world.stop import DefaultBudget


@dataclass(frozen=True)
class KinodynamicRRTConfig(PathSearchConfig):
    """Parameters of `KinodynamicRRT`, all of them described in `PathSearchConfig`."""


@dataclass(frozen=True)
class KinodynamicRRT:
    """Kinodynamic RRT for a robot with bounded turn rate that may push what is in its way.

    A tree of arcs grows from the robot, first with the objects as obstacles, then with only what
    is static (LaValle and Kuffner 2001, on OMPL); targets are drawn mostly around a coarse path
    that already trades length for pushing. The first path is shortcut at random with Dubins
    curves, each candidate at the cost m₀ l₀ + w Σ mᵢ lᵢ that the interaction model predicts; the
    cheapest path over all trees is returned when the stop rule fires. Constant-speed robots turn
    no tighter than v / ω; differential drives slow down in tight turns.

    Use it where a first plan is needed in milliseconds and the world is two-dimensional with
    convex objects. Without a stop rule it returns after a fixed number of iterations, so the same
    seed gives the same plan.

    Args:
        config: parameters.
        interaction: predicts the objects; a model without a compiled form is slow here.
    """

    config: KinodynamicRRTConfig = field(default_factory=KinodynamicRRTConfig)
    interaction: InteractionModel = field(default_factory=QuasiStatic)

    def __post_init__(self) -> None:
        expect("config", self.config, KinodynamicRRTConfig)
        expect("interaction", self.interaction, InteractionModel)  # type: ignore[type-abstract]

    def plan(
        self, world: World, *, stop: Stop | None = None, rng: np.random.Generator | None = None
    ) -> PlanResult:
        """Plan from ``world``; see `pushplan.world.Planner`.

        One iteration is an edge or a shortcut.

        Raises:
            InvalidInputError: if the world's goal is not one for the robot.
        """
        call = PlanningCall(world, stop, rng, DefaultBudget(self.config.default_iterations))
        radius = turning_radius(world.robot, self.config.turn_fraction)
        improver = PathImprover(call, self.config, self.interaction, radius)
        trees = TreePaths(improver)
        status = improver.begin()
        if status is None:
            trees.look_ahead()
            robot = improver.world.robot
            parks = improver.pose_goal is not None and robot.drive is Drive.CAR
            if parks or robot.slides or is_far(improver) or len(improver.lead.pieces):
                warm_start(improver)
            status = _search(improver, trees) or call.stopped_status
        return improver.result(status, trees=float(trees.trees))


def _search(improver: PathImprover, trees: TreePaths) -> PlanStatus | None:
    """Grow and shortcut until the stop rule fires; None where there is no plan by then."""
    while not improver.stopped():
        if trees.boxed_in:
            return PlanStatus.START_BLOCKED
        _one_round(improver, trees)
        if trees.sealed:
            return PlanStatus.GOAL_UNREACHABLE
        if not improver.solved:
            if improver.spare is None:
                set_aside_drive(improver)
            trees.change_start()
            trees.relax()
            if len(improver.lead.pieces):
                warm_start(improver)
    return PlanStatus.SOLVED if improver.falls_back() else None


def _one_round(improver: PathImprover, trees: TreePaths) -> None:
    """A path around the objects and one among them; the cheaper is worked out further."""
    config = improver.config
    cheaper: Candidate | None = None
    for candidate in trees.grow_two(config.push_weight):
        improver.shortcut(candidate)
        if cheaper is None or candidate.cost < cheaper.cost:
            cheaper = candidate
    if cheaper is not None:
        improver.work_out(cheaper)
