"""What the pushing problem of one robot and box is made of."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pushplan.control.mpc.horizon import Horizon, make_horizon
from pushplan.planners.pushing.bumper import faces_of
from pushplan.planners.pushing.clearance_kernels import clearance_problem
from pushplan.planners.pushing.cost_kernels import Weights, assembly_memory
from pushplan.planners.pushing.model import PushModel
from pushplan.planners.pushing.push_kernels import Faces, PushingMemory
from pushplan.planners.pushing.pushing_config import PushingConfig
from pushplan.world import RobotModel
from pushplan.world.checks import FloatArray, IntArray
from pushplan.world.outline import convex_outline

_NEARER = 1e-6  # what is nearer than the clearance already may come this much nearer [R]


def groups_of(horizon: int, moves: int) -> IntArray:
    """(N,) which command holds in each step: the first ones for one step, later ones for more."""
    ends = horizon * (np.arange(1, moves + 1) / moves) ** (1.6 if moves < horizon else 1.0)
    ends = np.maximum(np.round(ends), np.arange(1, moves + 1)).astype(np.int64)
    ends = np.minimum(ends, horizon - np.arange(moves - 1, -1, -1))
    return np.searchsorted(ends, np.arange(horizon), side="right").astype(np.int64)


def weights_of(config: PushingConfig, robot: RobotModel, half: float) -> Weights:
    """Costs for one robot, whose bumper has half a width [m]; length and curvature are missing."""
    return Weights(
        length=0.0,
        max_speed=robot.max_speed,
        half=half,
        curvature=-1.0,
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


def face_tables(models: Sequence[PushModel], scores: FloatArray, margin: float) -> Faces:
    """The sides of a box as the kernels read them, from a model for each."""
    stable = [(model.stable_curvature(), model.reach) for model in models]
    return Faces(
        scores,
        np.array([model.contact for model in models]),
        np.array([model.face.normal for model in models]),
        np.array([margin * limit if limit * reach > 0.02 else -1.0 for limit, reach in stable]),
    )


def pushing_horizon(robot: RobotModel, config: PushingConfig) -> Horizon:
    """Memory for commands, which outlasts a path."""
    return make_horizon(robot, (0, 1), config.horizon, config.moves)


def pushing_memory(
    robot: RobotModel, outline: FloatArray, config: PushingConfig, horizon: Horizon
) -> tuple[PushingMemory, list[PushModel]]:
    """Parameters and memory of the kernels, and the contact model of each face.

    Args:
        robot: that pushes.
        outline: (N, 2) convex, counter-clockwise corners of the box, origin at the centroid [m].
        config: parameters.
        horizon: of `pushing_horizon`.
    """
    outline = convex_outline("outline", outline)
    faces, scores = faces_of(outline)
    models = [PushModel(robot, outline, config.parameters, face) for face in faces]
    size = robot.circumscribed_radius
    memory = PushingMemory(
        horizon,
        weights_of(config, robot, models[0].bumper.half),
        face_tables(models, scores, config.margin),
        assembly_memory(config.horizon, horizon.program.hessian, horizon.program.gradient),
        clearance_problem(robot, outline, config.clearance * size, _NEARER * size),
        groups_of(config.horizon, config.moves),
        config.reach,
        config.delay,
        config.observer_gain,
        np.zeros(1, dtype=np.int64),
        np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
        *(np.zeros(count) for count in (6, 6, 6, 6, 3, 6)),
    )
    return memory, models
