"""From worlds to motor commands, in a robot's own loop."""

from pushplan.control import DelayedExecutor
from pushplan.runtime.command import Command, CommandStatus, RunLog
from pushplan.runtime.disturbed_policy import Disturbances, DisturbedPolicy
from pushplan.runtime.motors import Motors
from pushplan.runtime.runner import PLAN_STOP, Runner
from pushplan.runtime.state_estimator import StateEstimator
from pushplan.runtime.thread_executor import PlanningError, ThreadExecutor

__all__ = [
    "PLAN_STOP",
    "Command",
    "CommandStatus",
    "DelayedExecutor",
    "Disturbances",
    "DisturbedPolicy",
    "Motors",
    "PlanningError",
    "RunLog",
    "Runner",
    "StateEstimator",
    "ThreadExecutor",
]
