"""Fully specified starts, named lists of them, and fields of broken ice.

What makes ice loads compiled kernels, and only comes on first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pushplan.imports.on_demand import lazy_names
from pushplan.scenarios.scenario import Scenario, load_scenarios, save_scenarios
from pushplan.scenarios.suite import Suite, suite, suite_names, world_suite

if TYPE_CHECKING:
    from pushplan.scenarios.ice import FloeSizes, IceField, generate_ice, load_ice, save_ice

__all__ = [
    "FloeSizes",
    "IceField",
    "Scenario",
    "Suite",
    "generate_ice",
    "load_ice",
    "load_scenarios",
    "save_ice",
    "save_scenarios",
    "suite",
    "suite_names",
    "world_suite",
]

__getattr__, __dir__ = lazy_names(
    __name__, {"ice": "FloeSizes IceField generate_ice load_ice save_ice"}
)
