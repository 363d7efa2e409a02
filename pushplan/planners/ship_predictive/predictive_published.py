"""The predictive ship planner as published: the reference that ours is measured against."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from pushplan.interaction.ice_interaction import IceInteraction
from pushplan.interaction.network import IceNetwork
from pushplan.motion.time_slicing import Stopped
from pushplan.planners.ship_predictive.channel_view import channel_view
from pushplan.planners.ship_predictive.predictive_config import PredictiveConfig
from pushplan.planners.ship_predictive.published_search import PublishedSearch, timed_path
from pushplan.world import PlanResult, PlanStatus, Stop, World
from pushplan.world.checks import expect, number
from pushplan.world.planning_call import PlanningCall


@dataclass(frozen=True)
class PredictivePublished:
    """A* over a state lattice whose edges cost what a network says they do to the ice.

    After Zhong et al. 2025 (arXiv 2409.11326): an edge costs 1000 times the mean squared change of
    the patch of occupancy around it, plus its length [m for a ship of 2 m]; the predicted map is
    carried at each node, and all edges from a node are predicted in one call. The heuristic is the
    length of the Dubins path to the line. Networks, weights and data of the paper are not public:
    the network is ours, the lattice that of `LatticeConfig.published`. A path is
    there only when the search ends, so that a deadline that comes before ends without a plan.

    Args:
        change_weight: factor on the mean squared change.
        network: predicts.
    """

    change_weight: float = 1000.0
    network: IceNetwork = field(default_factory=IceNetwork)

    def __post_init__(self) -> None:
        number("change_weight", self.change_weight, low=0.0)
        expect("network", self.network, IceNetwork)

    def plan(
        self, world: World, *, stop: Stop | None = None, rng: np.random.Generator | None = None
    ) -> PlanResult:
        """Plan from ``world``; an iteration is an expanded node. There is no chance in it.

        Raises:
            InvalidInputError: if the goal is no line, something static is in the water, or the
                network cannot be read.
        """
        call = PlanningCall(world, stop, rng)
        self.network.load()
        call.arm()
        view = channel_view(world, PredictiveConfig(margin=0.0), IceInteraction())
        if view.closed is not None:
            return call.result(view.closed)
        if view.away <= 0.0:
            plan = timed_path(world, world.robot_pose[None], np.zeros(1))
            return call.result(PlanStatus.SOLVED, plan, call.elapsed)
        expanded = 0
        try:
            search = PublishedSearch(
                view, self.network, self.change_weight, lambda: call.check(expanded, math.inf)
            )
            while not search.arrived:
                if not search.expand():
                    status = view.without_path(call)
                    return call.result(status, None, math.nan, expanded, expanded)
                expanded += 1
        except Stopped:
            return call.result(call.stopped_status, None, math.nan, expanded, expanded)
        return call.result(PlanStatus.SOLVED, search.plan(), call.elapsed, expanded, expanded)
