"""Named lists of scenarios. Which suites there are is data: ``data/suites.yaml``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from typing import Any

import yaml

from pushplan.scenarios.scenario import Scenario
from pushplan.world import UnknownNameError
from pushplan.world.checks import integer


@dataclass(frozen=True)
class Suite:
    """A list of scenarios with a name and a version.

    Args:
        name: such as ``"maze-2d-5"``.
        version: grows when the scenarios of a suite change, so that results stay comparable.
        scenarios: in the order in which they are run.
    """

    name: str
    version: int
    scenarios: tuple[Scenario, ...]

    def __len__(self) -> int:
        return len(self.scenarios)


def suite_names() -> tuple[str, ...]:
    """Names of all suites."""
    return tuple(sorted(_table()))


def suite(name: str, *, episodes: int | None = None, first_seed: int = 0) -> Suite:
    """A suite by name.

    Args:
        name: one of `suite_names`.
        episodes: number of scenarios; the suite's own number if None.
        first_seed: seed of the first scenario; the others count up from it. A suite with several
            starts goes through all of them with each seed.

    Raises:
        UnknownNameError: if there is no such suite.
        InvalidInputError: if a number is out of range.
    """
    table = _table()
    if not isinstance(name, str) or name not in table:
        raise UnknownNameError("suite", name, table)
    entry = table[name]
    count = entry["episodes"] if episodes is None else integer("episodes", episodes, low=1)
    first = integer("first_seed", first_seed, low=0)
    starts = [Scenario.from_dict(start) for start in entry["starts"]]
    scenarios = tuple(
        replace(starts[i % len(starts)], seed=first + i // len(starts)) for i in range(count)
    )
    return Suite(name, entry["version"], scenarios)


@cache
def _table() -> Mapping[str, Any]:
    text = resources.files("pushplan.scenarios").joinpath("data/suites.yaml").read_text("utf-8")
    table: Mapping[str, Any] = yaml.safe_load(text)
    return table
