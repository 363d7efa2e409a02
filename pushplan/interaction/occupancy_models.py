"""`InteractionOccupancy`: an interaction model behind the contract of occupancy predictors."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pushplan.errors import InvalidInputError
from pushplan.interaction.interaction_model import InteractionModel
from pushplan.interaction.occupancy import OccupancyForecast, PassageBatch, patch_after
from pushplan.interaction.quasi_static import QuasiStatic

ICE_FRICTION = 1.0
"""Coulomb coefficient between hull and ice in the two-dimensional Ship-Ice."""


@dataclass(frozen=True)
class InteractionOccupancy:
    """Sweeps every passage with an interaction model and draws where the objects end up.

    With `QuasiStatic` it is the analytic predictor; with a simulator's rollout it is the truth.

    Args:
        model: the interaction model.
    """

    model: InteractionModel = field(default_factory=lambda: QuasiStatic(friction=ICE_FRICTION))

    def predict(self, batch: PassageBatch) -> OccupancyForecast:
        """Sweep the passages, one after the other; needs a batch from `make_batch`."""
        if not batch.passages:
            raise InvalidInputError(
                "an interaction model follows single objects: make the batch with `make_batch`"
            )
        after = np.empty_like(batch.patches[:, 0])
        work = np.empty(len(batch))
        for i, passage in enumerate(batch.passages):
            swept = self.model.sweep(passage.world, passage.path)
            after[i] = patch_after(batch, i, swept.object_poses[-1])
            work[i] = swept.work
        return OccupancyForecast(after, work)
