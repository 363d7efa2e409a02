"""A `pushplan.world.World` as what a policy observes. No simulator, no Gymnasium."""

from pushplan.observation.builder import ObservationBuilder
from pushplan.observation.channels import CHANNELS, ImageObservation
from pushplan.observation.state import StateObservation

__all__ = ["CHANNELS", "ImageObservation", "ObservationBuilder", "StateObservation"]
