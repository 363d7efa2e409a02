"""`PredictiveShip` and `PredictiveShipNetwork`: through ice by looking at what it will do."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from pushplan.interaction.ice import IceInteraction
from pushplan.interaction.network import IceNetwork
from pushplan.planners.arguments import check_call
from pushplan.planners.ship_predictive.call import plan_call
from pushplan.planners.ship_predictive.floes import FloeCarrier
from pushplan.planners.ship_predictive.ice_scene import Scene
from pushplan.planners.ship_predictive.maps import MapCarrier
from pushplan.planners.ship_predictive.predictive_config import PredictiveConfig
from pushplan.world import PlanResult, Stop, World
from pushplan.world.checks import expect


@dataclass(frozen=True)
class PredictiveShip:
    """Minimises m₀ l₀ + w Σ mᵢ lᵢ, with the floes pushed along each path that it looks at.

    After Zhong et al. 2025 (arXiv 2409.11326), whose edge costs come from the predicted change of
    the ice, carried along the path; here the prediction is that of a contact model, and the cost is
    what the metrics measure. A table of costs to go over the ice as it lies guides a beam of
    arcs (see `beam.Beam`). Use it where the positions of the floes are known.

    Plans keep the ship's origin half a beam inside the sides of the channel, nearer only as far as
    a turn from where it starts needs the room. A goal line that is very far away is approached
    (`PredictiveConfig.farthest`). Without a stop rule the effort is fixed; with one the beam is
    widened until the rule fires. An iteration is one predicted piece of path.

    Args:
        config: parameters.
        interaction: predicts the floes.
    """

    warm_up_iterations: ClassVar[int] = 30
    """After which it has used all of its kernels."""

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
        began = time.perf_counter()
        check_call(world, stop, rng)
        return plan_call(world, self.config, self.interaction, FloeCarrier, stop, began)


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

    config: PredictiveConfig = field(default_factory=lambda: PredictiveConfig(widest=24, sparse=0))
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
        began = time.perf_counter()
        check_call(world, stop, rng)
        self.network.load()

        def carrier(scene: Scene) -> MapCarrier:
            return MapCarrier(scene, self.network)

        return plan_call(world, self.config, self.interaction, carrier, stop, began)
