"""Fields of broken ice: generated, or read from a file."""

from pushplan.scenarios.floe_sizes import FloeSizes
from pushplan.scenarios.ice_field import IceField
from pushplan.scenarios.ice_files import load_ice, save_ice
from pushplan.scenarios.ice_generator import generate_ice

__all__ = ["FloeSizes", "IceField", "generate_ice", "load_ice", "save_ice"]
