"""Pushing one box along a path: contact model, predictive control, execution, identification.

The model is quasi-static pushing of a convex box by a bumper under Coulomb friction; the controller
a predictive one that keeps the box on the bumper. See docs/pushing.md.
"""

from typing import TYPE_CHECKING, Any

from pushplan.planners.pushing.parameters import (
    PushParameters,
    pressure_radius,
    spread_of,
    stable_curvature,
)

if TYPE_CHECKING:
    from pushplan.planners.pushing.approach import Approach, best_offset, find_approach
    from pushplan.planners.pushing.bumper import Bumper, Face, face_towards
    from pushplan.planners.pushing.executor import (
        ExecutorConfig,
        PushExecutor,
        PushPhase,
        PushStatus,
        PushTask,
    )
    from pushplan.planners.pushing.fit import PushFit, fit_push_model, identify
    from pushplan.planners.pushing.kernel_warmup import warm_up
    from pushplan.planners.pushing.log import PushLog, push_log
    from pushplan.planners.pushing.model import ContactMode, ContactReport, PushModel, PushState
    from pushplan.planners.pushing.mpc import PushingMpc
    from pushplan.planners.pushing.path import PushPath
    from pushplan.planners.pushing.pushing_config import PushingConfig
    from pushplan.planners.pushing.reference import NonlinearPushingMpc

__all__ = [
    "Approach",
    "Bumper",
    "ContactMode",
    "ContactReport",
    "ExecutorConfig",
    "Face",
    "NonlinearPushingMpc",
    "PushExecutor",
    "PushFit",
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
    "fit_push_model",
    "identify",
    "pressure_radius",
    "push_log",
    "spread_of",
    "stable_curvature",
    "warm_up",
]

_LAZY = {
    "approach": ("Approach", "best_offset", "find_approach"),
    "bumper": ("Bumper", "Face", "face_towards"),
    "pushing_config": ("PushingConfig",),
    "executor": ("ExecutorConfig", "PushExecutor", "PushPhase", "PushStatus", "PushTask"),
    "fit": ("PushFit", "fit_push_model", "identify"),
    "log": ("PushLog", "push_log"),
    "model": ("ContactMode", "ContactReport", "PushModel", "PushState"),
    "mpc": ("PushingMpc",),
    "path": ("PushPath",),
    "reference": ("NonlinearPushingMpc",),
    "kernel_warmup": ("warm_up",),
}
_HOMES = {name: module for module, names in _LAZY.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import compiled kernels and solvers when they are first asked for."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
