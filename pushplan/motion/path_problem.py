"""`PathProblem` and `SweptPath`: what the compiled functions know of a problem, and of a path."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pushplan.motion.collision import ConvexObstacles, Footprint
from pushplan.world.checks import FloatArray


class PathProblem(NamedTuple):
    """Costs and constraints of a path."""

    robot_mass: float  # m₀ [kg]
    push_weight: float  # w: weight of a unit of interaction work
    turning_radius: float  # Least one [m]
    spacing: float  # Greatest distance between two poses of a path [m]
    jam_length: float
    """Added to a path's length at each pose where the robot jams [m], to tell it from any other."""
    displacement: float  # Typical sideways displacement that shortcutting tries [m]
    goal: FloatArray  # (5,) from `goal_numbers`
    footprint: Footprint  # With its margin
    walls: ConvexObstacles
    contacts: Any  # A compiled interaction model; by its type `advance_objects` is selected


class SweptPath(NamedTuple):
    """A path with the objects that it sweeps; buffers may be longer than the poses in use."""

    poses: FloatArray  # (M, 3)
    curvatures: FloatArray  # (M,) curvature of the arc that leads to each pose [1/m]
    objects: FloatArray  # (M, K, 3) where the objects are when the robot is at each pose
    lengths: FloatArray  # (M,) path length so far [m]
    works: FloatArray  # (M,) interaction work so far [kg m]


def make_swept_path(capacity: int, objects: int) -> SweptPath:
    """Empty buffers for ``capacity`` poses and ``objects`` objects."""
    return SweptPath(
        np.empty((capacity, 3)),
        np.zeros(capacity),
        np.empty((capacity, objects, 3)),
        np.zeros(capacity),
        np.zeros(capacity),
    )
