"""Motion of the objects when the robot sweeps along a path."""

from pushplan.interaction.contact_parameters import ContactParameters, support_gyration
from pushplan.interaction.identification import ObservedPush, find_pushes, identify
from pushplan.interaction.interaction_model import Interaction, InteractionModel, SweepsMany
from pushplan.interaction.quasi_static import QuasiStatic

__all__ = [
    "ContactParameters",
    "Interaction",
    "InteractionModel",
    "ObservedPush",
    "QuasiStatic",
    "SweepsMany",
    "find_pushes",
    "identify",
    "support_gyration",
]
