"""The policies `mppi` and `cem`."""

from __future__ import annotations

from collections.abc import Sequence

from pushplan.interaction import InteractionModel
from pushplan.planners.mppi.costs import RolloutCost
from pushplan.planners.mppi.mppi import Mppi
from pushplan.planners.mppi.mppi_config import MppiConfig
from pushplan.planners.mppi.mppi_policy import MppiPolicy
from pushplan.world import Stop


def mppi(
    config: MppiConfig | None = None,
    interaction: InteractionModel | None = None,
    stop: Stop | None = None,
    costs: Sequence[RolloutCost] = (),
) -> MppiPolicy:
    """Model predictive path integral control: samples weighted by exp(-cost / temperature)."""
    return MppiPolicy(Mppi(config or MppiConfig(), interaction, costs), stop)


def cem(
    config: MppiConfig | None = None,
    interaction: InteractionModel | None = None,
    stop: Stop | None = None,
    costs: Sequence[RolloutCost] = (),
) -> MppiPolicy:
    """The cross-entropy method: mean and spread of the best samples, over three iterations."""
    return mppi(
        config or MppiConfig(update="cem", samples=64, iterations=3), interaction, stop, costs
    )
