"""What the pushing problem of one robot and box is made of."""

from __future__ import annotations

import numpy as np

from pushplan.planners.pushing.cost_kernels import Weights
from pushplan.planners.pushing.model import PushModel
from pushplan.planners.pushing.pushing_config import PushingConfig
from pushplan.world import RobotModel
from pushplan.world.checks import IntArray


def groups_of(horizon: int, moves: int) -> IntArray:
    """(N,) which command holds in each step: the first ones for one step, later ones for more."""
    ends = horizon * (np.arange(1, moves + 1) / moves) ** (1.6 if moves < horizon else 1.0)
    ends = np.maximum(np.round(ends), np.arange(1, moves + 1)).astype(np.int64)
    ends = np.minimum(ends, horizon - np.arange(moves - 1, -1, -1))
    return np.searchsorted(ends, np.arange(horizon), side="right").astype(np.int64)


def weights_of(config: PushingConfig, model: PushModel, robot: RobotModel) -> Weights:
    """Costs and scales for one robot and box."""
    stable = model.stable_curvature()
    limit = config.margin * stable if stable * model.reach > 0.02 else -1.0
    return Weights(
        length=model.reach,
        max_speed=robot.max_speed,
        half=model.bumper.half,
        curvature=limit,
        heading=config.heading,
        offset=config.offset,
        rim=config.rim,
        safe=config.safe,
        angle=config.angle,
        grip=config.grip,
        turn=config.turn,
        speed=config.speed,
        smoothness=config.smoothness,
        terminal=config.terminal,
    )
