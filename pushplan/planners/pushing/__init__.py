"""Pushing one box along a path: contact model and predictive control.

The model is quasi-static pushing of a convex box by a bumper under Coulomb friction; the controller
a predictive one that keeps the box on the bumper. See docs/pushing.md.
"""

from pushplan.planners.pushing.bumper import Bumper, Face, face_towards, faces_of
from pushplan.planners.pushing.mpc import PushingMpc
from pushplan.planners.pushing.parameters import (
    PushingConfig,
    PushParameters,
    pressure_radius,
    spread_of,
    stable_curvature,
)
from pushplan.planners.pushing.path import PushPath
from pushplan.planners.pushing.push_model import PushModel, PushState

__all__ = [
    "Bumper",
    "Face",
    "PushModel",
    "PushParameters",
    "PushPath",
    "PushState",
    "PushingConfig",
    "PushingMpc",
    "face_towards",
    "faces_of",
    "pressure_radius",
    "spread_of",
    "stable_curvature",
]
