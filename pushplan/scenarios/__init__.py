"""Fully specified starts, named lists of them, and fields of broken ice.

What makes ice loads compiled kernels, and only comes on first use.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from pushplan.scenarios.scenario import Scenario, load_scenarios, save_scenarios
from pushplan.scenarios.suite import Suite, suite, suite_names

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
]

_LAZY = ("FloeSizes", "IceField", "generate_ice", "load_ice", "save_ice")


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(import_module("pushplan.scenarios.ice"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
