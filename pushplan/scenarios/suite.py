"""Named lists of scenarios. Which suites there are is data: ``data/suites.yaml``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import yaml

from pushplan.scenarios.scenario import Scenario
from pushplan.world import SchemaError, UnknownNameError
from pushplan.world.checks import integer
from pushplan.world.files import SCHEMA
from pushplan.world.safe_files import read_data


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


def world_suite(
    folder: str | Path,
    *,
    simulator: str = "pymunk",
    preset: str = "benchmark",
    episodes: int | None = None,
    first_seed: int = 0,
) -> Suite:
    """The world files of a folder as a suite of task ``"room"``, in the order of their names.

    Args:
        folder: holds ``.yaml``, ``.yml`` and ``.json`` files; those without the schema of worlds,
            such as maps, are left out.
        simulator: of all of them.
        preset: ``"benchmark"``, or ``"testbed"``, which has heights.
        episodes: number of scenarios; one for each file if None. With more, each round through the
            files has the next seed.
        first_seed: of the first round.

    Raises:
        SchemaError: if there is no such folder, it holds no world, or a file cannot be read.
        InvalidInputError: if a number is out of range.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise SchemaError(f"folder of worlds {folder}: no such folder")
    paths = sorted(one for one in folder.iterdir() if one.suffix in (".yaml", ".yml", ".json"))
    worlds = [one for one in paths if _is_world(one)]
    if not worlds:
        raise SchemaError(
            f"folder of worlds {folder}: no .yaml, .yml or .json file in it says schema: {SCHEMA}"
        )
    count = len(worlds) if episodes is None else integer("episodes", episodes, low=1)
    first = integer("first_seed", first_seed, low=0)
    scenarios = (
        Scenario(
            "room",
            simulator,
            preset,
            {"world_file": str(worlds[i % len(worlds)])},
            first + i // len(worlds),
        )
        for i in range(count)
    )
    return Suite(folder.resolve().name, 1, tuple(scenarios))


def _is_world(path: Path) -> bool:
    data = read_data(path, "world file")
    return isinstance(data, Mapping) and data.get("schema") == SCHEMA


@cache
def _table() -> Mapping[str, Any]:
    text = resources.files("pushplan.scenarios").joinpath("data/suites.yaml").read_text("utf-8")
    table: Mapping[str, Any] = yaml.safe_load(text)
    return table
