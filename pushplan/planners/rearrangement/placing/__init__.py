"""Pushing every object to a place of its own."""

from pushplan.planners.rearrangement.placing.placer import Placer

__all__ = ["Placer"]
