"""Fully specified starts, named lists of them, fields of broken ice, offices and rearrangements.

What makes them only comes on first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pushplan.imports.on_demand import lazy_names
from pushplan.scenarios.scenario import Scenario, load_scenarios, save_scenarios
from pushplan.scenarios.suite import Suite, suite, suite_names, world_suite

if TYPE_CHECKING:
    from pushplan.scenarios.ice_field import FloeSizes, IceField
    from pushplan.scenarios.ice_files import load_ice, save_ice
    from pushplan.scenarios.ice_generator import generate_ice
    from pushplan.scenarios.office import generate_office
    from pushplan.scenarios.rearrangement import generate_rearrangement, load_relopush

__all__ = [
    "FloeSizes",
    "IceField",
    "Scenario",
    "Suite",
    "generate_ice",
    "generate_office",
    "generate_rearrangement",
    "load_ice",
    "load_relopush",
    "load_scenarios",
    "save_ice",
    "save_scenarios",
    "suite",
    "suite_names",
    "world_suite",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "ice_field": "FloeSizes IceField",
        "ice_files": "load_ice save_ice",
        "ice_generator": "generate_ice",
        "office": "generate_office",
        "rearrangement": "generate_rearrangement load_relopush",
    },
)
