"""Motion of the objects when the robot sweeps along a path."""

from pushplan.interaction.interaction_model import Interaction, InteractionModel, SweepsMany
from pushplan.interaction.quasi_static import QuasiStatic

__all__ = ["Interaction", "InteractionModel", "QuasiStatic", "SweepsMany"]
