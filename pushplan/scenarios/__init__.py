"""Fully specified starts, and named lists of them."""

from pushplan.scenarios.scenario import Scenario, load_scenarios, save_scenarios
from pushplan.scenarios.suite import Suite, suite, suite_names

__all__ = ["Scenario", "Suite", "load_scenarios", "save_scenarios", "suite", "suite_names"]
