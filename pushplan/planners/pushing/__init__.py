"""Pushing one box along a path: contact model, predictive control, execution, identification.

The model is quasi-static pushing of a convex box by a bumper under Coulomb friction; the controller
a predictive one that keeps the box on the bumper. See docs/pushing.md.
"""

from typing import Any

from pushplan.planners.pushing.approach import Approach, best_offset, find_approach
from pushplan.planners.pushing.bumper import Bumper, Face, face_towards
from pushplan.planners.pushing.executor import (
    ExecutorConfig,
    PushExecutor,
    PushPhase,
    PushStatus,
    PushTask,
)
from pushplan.planners.pushing.kernel_warmup import warm_up
from pushplan.planners.pushing.model import ContactMode, ContactReport, PushModel, PushState
from pushplan.planners.pushing.mpc import PushingMpc
from pushplan.planners.pushing.parameters import (
    PushParameters,
    pressure_radius,
    spread_of,
    stable_curvature,
)
from pushplan.planners.pushing.path import PushPath
from pushplan.planners.pushing.push_log import PushLog, push_log
from pushplan.planners.pushing.pushing_config import PushingConfig

__all__ = [
    "Approach",
    "Bumper",
    "ContactMode",
    "ContactReport",
    "ExecutorConfig",
    "Face",
    "PushExecutor",
    "PushLog",
    "PushModel",
    "PushParameters",
    "PushPath",
    "PushPhase",
    "PushState",
    "PushStatus",
    "PushTask",
    "PushingConfig",
    "PushingMpc",
    "best_offset",
    "face_towards",
    "find_approach",
    "pressure_radius",
    "push_log",
    "spread_of",
    "stable_curvature",
    "warm_up",
]

_LAZY = {
    "NonlinearPushingMpc": "reference",
    "PushFit": "fit",
    "fit_push_model": "fit",
    "identify": "fit",
}
"""What needs CasADi or SciPy's optimisers, and the module of each."""


def __getattr__(name: str) -> Any:
    """Import what needs a large library when it is first asked for."""
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(f"{__name__}.{_LAZY[name]}"), name)
