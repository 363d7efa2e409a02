"""Following a plan within the robot's limits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pushplan.control.episode_clock import EpisodeClock
from pushplan.control.executors import DelayedExecutor, ImmediateExecutor, SimulatedExecutor
from pushplan.control.leg_follower import LegFollower, Legs
from pushplan.control.limits import TwistLimiter, clamp_twist
from pushplan.control.path_follower import PathFollower, PurePursuit
from pushplan.control.progress_checker import (
    PoseProgressChecker,
    ProgressChecker,
    StallChecker,
    decrease_by,
)
from pushplan.control.recovery import PoseFollower, Recovery, waiting_twist
from pushplan.control.tracking import Progress
from pushplan.imports.on_demand import lazy_names

if TYPE_CHECKING:
    from pushplan.control.mpc import MpcConfig, MpcTracker

__all__ = [
    "DelayedExecutor",
    "EpisodeClock",
    "ImmediateExecutor",
    "LegFollower",
    "Legs",
    "MpcConfig",
    "MpcTracker",
    "PathFollower",
    "PoseFollower",
    "PoseProgressChecker",
    "Progress",
    "ProgressChecker",
    "PurePursuit",
    "Recovery",
    "SimulatedExecutor",
    "StallChecker",
    "TwistLimiter",
    "clamp_twist",
    "decrease_by",
    "waiting_twist",
]

__getattr__, __dir__ = lazy_names(__name__, {"mpc": "MpcConfig MpcTracker"})
