"""Named lists of scenarios. Which suites there are is data: ``data/suites.yaml``."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from pushplan.files.safe_files import known_keys, read_data
from pushplan.scenarios.scenario import Scenario
from pushplan.world import SchemaError, UnknownNameError
from pushplan.world.checks import integer
from pushplan.world.stored.world_files import SCHEMA


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

    @property
    def starts(self) -> list[Scenario]:
        """The scenarios without their seeds, each once."""
        return list(dict.fromkeys(replace(one, seed=0) for one in self.scenarios))

    def as_one_setting(self) -> Suite:
        """The suite with scenarios named ``SUITE/NAME``, which results count as one setting.

        The name is the scenario's own, else that of its world file, with folders where two
        files have one name. A suite that differs in seeds only is one setting as it is.
        """
        places = {start: _place(start) for start in self.starts}
        if len(places) == 1 and not any(one.name or _FILE in one.variations for one in places):
            return self
        ends = Counter(place[i:] for place in places.values() for i in range(len(place)))
        names = {}
        for start, place in places.items():
            alone = [place[i:] for i in range(len(place)) if ends[place[i:]] == 1]
            names[start] = "-".join(alone[-1] if alone else (place[-1], _digest(start)))
        suite = re.sub(_ODD, "_", self.name)
        scenarios = (
            replace(one, name=f"{suite}/{names[replace(one, seed=0)]}") for one in self.scenarios
        )
        return replace(self, scenarios=tuple(scenarios))


_FILE = "world_file"  # the variation that names a file
_ODD = r"[/\x00-\x1f\x7f]"  # characters that are none of a name


def _digest(start: Scenario) -> str:
    return replace(start, name="").key.split("-")[-2]


def _place(start: Scenario) -> tuple[str, ...]:
    """Return the origin of a scenario: the folders of its world file and the file, or its name."""
    if start.name:
        return (start.name.split("/")[-1],)
    if _FILE not in start.variations:
        return (start.key.removesuffix("-0"),)
    parts = Path(str(start.variations[_FILE])).resolve().with_suffix("").parts
    return tuple(re.sub(_ODD, "_", part) for part in parts)


def distinct(suites: Sequence[Suite]) -> tuple[Suite, ...]:
    """Suites of one's own as one setting each; those that share a name get a number too."""
    known: dict[str, list[Scenario]] = {}
    found = []
    for given in suites:
        one = given
        number = 1
        if given.name.split("[")[0] not in _table():
            one = given.as_one_setting()
            while known.setdefault(one.name, one.starts) != one.starts:
                number += 1
                one = replace(given, name=f"{given.name}-{number}").as_one_setting()
        found.append(one)
    return tuple(found)


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
    keys = ("episodes", "starts", "version")
    entry = known_keys(f"suite {name!r}", table[name], keys, keys)
    count = entry["episodes"]
    if episodes is not None:
        count = integer("episodes", episodes, low=1, high=MOST_EPISODES)
    first = integer("first_seed", first_seed, low=0)
    starts = [Scenario.from_dict(start) for start in entry["starts"]]
    scenarios = tuple(
        replace(starts[i % len(starts)], seed=first + i // len(starts)) for i in range(count)
    )
    return Suite(name, entry["version"], scenarios)


def seeds_of(start: Scenario, episodes: int) -> Suite:
    """A scenario with its seed and those that follow, as a suite with the name of its task."""
    count = integer("episodes", episodes, low=1, high=MOST_EPISODES)
    seeds = range(start.seed, start.seed + count)
    name = start.task.rpartition(":")[2]
    return Suite(name, 1, tuple(replace(start, seed=seed) for seed in seeds))


def world_suite(
    worlds: str | Path | Sequence[str | Path],
    *,
    simulator: str = "pymunk",
    preset: str = "benchmark",
    episodes: int = 1,
    first_seed: int = 0,
) -> Suite:
    """World files as a suite of task ``"room"``, which results count as one setting.

    Args:
        worlds: a folder, of whose ``.yaml``, ``.yml`` and ``.json`` files those with the schema
            of worlds are taken in the order of their names; a file; or a list of these.
        simulator: of all of them.
        preset: ``"benchmark"``, or ``"testbed"``, which has heights.
        episodes: number of scenarios of each file; each round through the files has the next seed.
        first_seed: of the first round.

    Raises:
        SchemaError: if there is no such folder, it holds no world, or a file cannot be read.
        InvalidInputError: if a number is out of range.
    """
    given = [Path(one) for one in ([worlds] if isinstance(worlds, str | Path) else worlds)]
    files = [str(file) for one in given for file in _world_files(one)]
    first = integer("first_seed", first_seed, low=0)
    scenarios = tuple(
        Scenario("room", simulator, preset, {_FILE: file}, seed)
        for seed in range(first, first + integer("episodes", episodes, low=1, high=MOST_EPISODES))
        for file in files
    )
    name = given[0].resolve().stem if len(given) == 1 else "worlds"
    return Suite(name, 1, scenarios).as_one_setting()


def _world_files(given: Path) -> list[Path]:
    if given.is_file() and _is_world(given):
        return [given]
    if not given.exists():
        raise SchemaError(f"worlds {given}: no such file or folder")
    inside = sorted(given.iterdir()) if given.is_dir() else []
    worlds = [one for one in inside if one.suffix in (".yaml", ".yml", ".json") and _is_world(one)]
    if not worlds:
        raise SchemaError(
            f"folder of worlds {given}: no .yaml, .yml or .json file in it says schema: {SCHEMA}"
        )
    return worlds


def _is_world(path: Path) -> bool:
    data = read_data(path, "world file")
    return isinstance(data, Mapping) and data.get("schema") == SCHEMA


MOST_EPISODES = 100_000
"""Of a suite in one study: more scenarios would take minutes to list."""


@cache
def _table() -> Mapping[str, Any]:
    table: Mapping[str, Any] = read_data(Path(__file__).parent / "data" / "suites.yaml", "suites")
    return table
