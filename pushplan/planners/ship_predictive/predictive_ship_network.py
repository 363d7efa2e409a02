"""`PredictiveShipNetwork`: through ice by a network that predicts what each path does to it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import ClassVar

import numpy as np

from pushplan.interaction.ice_interaction import IceInteraction
from pushplan.interaction.network import IceNetwork
from pushplan.planners.ship_predictive.map_propagator import MapPropagator
from pushplan.planners.ship_predictive.predictive_call import plan_call
from pushplan.planners.ship_predictive.predictive_config import PredictiveConfig
from pushplan.world import PlanResult, Stop, World
from pushplan.world.checks import expect
from pushplan.world.planning_call import PlanningCall

NETWORK_CONFIG = PredictiveConfig(arc=0.4, curvatures=2, width=6, widest=24, sparse=0)
"""Fewer and longer pieces than by default, as the network takes longer to predict one."""


@dataclass(frozen=True)
class PredictiveShipNetwork:
    """`PredictiveShip` with a network that predicts occupancy and work from occupancy.

    The ice is carried as a map, which the network changes piece by piece; the pieces of a layer
    of the beam are predicted eight in a call. Use it where only an occupancy map is known, or to
    compare.

    Args:
        config: parameters.
        network: predicts; the shipped weights by default.
        interaction: sweeps the plan that is returned, for its prediction; the search does not
            use it.
    """

    warm_up_iterations: ClassVar[int] = 30
    """After which it has used all of its kernels."""

    config: PredictiveConfig = NETWORK_CONFIG
    network: IceNetwork = field(default_factory=IceNetwork)
    interaction: IceInteraction = field(default_factory=IceInteraction)

    def __post_init__(self) -> None:
        expect("config", self.config, PredictiveConfig)
        expect("network", self.network, IceNetwork)
        expect("interaction", self.interaction, IceInteraction)

    def plan(
        self, world: World, *, stop: Stop | None = None, rng: np.random.Generator | None = None
    ) -> PlanResult:
        """Plan from ``world``; see `pushplan.world.Planner`. There is no chance in it.

        Raises:
            InvalidInputError: if the goal is no line, something static is in the water, or the
                network cannot be read.
        """
        call = PlanningCall(world, stop, rng)
        self.network.load()
        call.arm()
        propagator = partial(MapPropagator, network=self.network)
        return plan_call(call, self.config, self.interaction, propagator)
