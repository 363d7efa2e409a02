"""`PredictiveShip` and `PredictiveShipNetwork`: through ice by predicting what paths do to it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from pushplan.interaction.ice_interaction import IceInteraction
from pushplan.interaction.network import IceNetwork
from pushplan.planners.ship_predictive.beam_search import StatePropagator
from pushplan.planners.ship_predictive.channel_view import ChannelView
from pushplan.planners.ship_predictive.map_propagator import FloePropagator, MapPropagator
from pushplan.planners.ship_predictive.predictive_call import plan_call
from pushplan.planners.ship_predictive.predictive_config import PredictiveConfig
from pushplan.world import PlanResult, Stop, World
from pushplan.world.checks import expect
from pushplan.world.planning_call import PlanningCall


@dataclass(frozen=True)
class PredictiveShip:
    """Minimises m₀ l₀ + w Σ mᵢ lᵢ, with the floes pushed along each path that it looks at.

    After Zhong et al. 2025 (arXiv 2409.11326), whose edge costs come from the predicted change of
    the ice, carried along the path; here the prediction is that of a contact model, and the cost is
    what the metrics measure. A table of costs to go over the ice as it lies guides a beam of
    arcs (see `BeamSearch`). Use it where the positions of the floes are known.

    Plans keep the ship's origin half a beam, and the margin of the world, inside the sides of the
    channel, nearer only as far as a turn from where it starts needs the space. A goal line that is
    very far away is approached (`PredictiveConfig.farthest`). Without a stop rule the effort is
    fixed; with one the beam is widened until the rule fires. An iteration is one predicted piece of
    path.

    Args:
        config: parameters.
        interaction: predicts the floes.
    """

    config: PredictiveConfig = field(default_factory=PredictiveConfig)
    interaction: IceInteraction = field(default_factory=IceInteraction)

    def __post_init__(self) -> None:
        expect("config", self.config, PredictiveConfig)
        expect("interaction", self.interaction, IceInteraction)

    def plan(
        self, world: World, *, stop: Stop | None = None, rng: np.random.Generator | None = None
    ) -> PlanResult:
        """Plan from ``world``; see `pushplan.world.Planner`. There is no chance in it.

        Raises:
            InvalidInputError: if the goal is no line, or something static is in the water.
        """
        call = PlanningCall(world, stop, rng)
        return plan_call(call, self.config, self.interaction, self._propagator(call))

    def _propagator(self, call: PlanningCall) -> Callable[[ChannelView], StatePropagator[Any]]:
        """Makes what carries the ice along the paths of a call."""
        return FloePropagator


NETWORK_CONFIG = PredictiveConfig(arc=0.4, curvatures=2, width=6, widest=24, sparse=0)
"""Fewer and longer pieces than by default, as the network takes longer to predict one."""


@dataclass(frozen=True)
class PredictiveShipNetwork(PredictiveShip):
    """`PredictiveShip` with a network that predicts occupancy and work from occupancy.

    The ice is carried as a map, which the network changes piece by piece; the pieces of a layer
    of the beam are predicted eight in a call. Use it where only an occupancy map is known, or to
    compare. A network that cannot be read is an `InvalidInputError` of ``plan``.

    Args:
        config: parameters.
        interaction: sweeps the plan that is returned, for its prediction; the search does not
            use it.
        network: predicts; the shipped weights by default.
    """

    config: PredictiveConfig = NETWORK_CONFIG
    network: IceNetwork = field(default_factory=IceNetwork)

    def __post_init__(self) -> None:
        super().__post_init__()
        expect("network", self.network, IceNetwork)

    def _propagator(self, call: PlanningCall) -> Callable[[ChannelView], StatePropagator[Any]]:
        """Makes maps of the ice; what a process loads once does not count against a deadline."""
        self.network.load()
        call.arm()
        return partial(MapPropagator, network=self.network)
