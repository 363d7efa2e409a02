"""Predictive tracking of a path."""

from pushplan.control.mpc.tracker import MpcConfig, MpcTracker

__all__ = ["MpcConfig", "MpcTracker"]
