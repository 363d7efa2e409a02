"""Simulators: each holds bodies, steps, and reports a `World`. None of them names a task."""

from pushplan.envs.simulators.base import Materials, Simulator, SimulatorState

__all__ = ["Materials", "Simulator", "SimulatorState"]
