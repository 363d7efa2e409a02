"""One fully specified start of an episode."""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pushplan.errors import short
from pushplan.files.safe_files import known_keys, read_data
from pushplan.files.safe_yaml import dump
from pushplan.imports.named_objects import absolute
from pushplan.world import SchemaError
from pushplan.world.checks import integer

SCHEMA = "pushplan-scenarios/1"
"""Name and version of the file format; files of another version are refused."""

Value = bool | int | float | str
_KEYS = ("task", "simulator", "preset", "variations", "seed", "name")
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")
_OWN_TASK = re.compile(r"[^\x00-\x1f\x7f]{1,1000}:[A-Za-z_][A-Za-z0-9_]*")
_OWN_NAME = re.compile(r"([^/\x00-\x1f\x7f]{1,200}/)?[^/\x00-\x1f\x7f]{1,200}")


class Variations(Mapping[str, Value]):
    """An immutable, hashable mapping from names to plain values, in the order of the names."""

    def __init__(self, values: Mapping[str, Value]) -> None:
        self._items = tuple(sorted(values.items()))

    def __getitem__(self, key: str) -> Value:
        return dict(self._items)[key]

    def __iter__(self) -> Iterator[str]:
        return iter(key for key, _ in self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __hash__(self) -> int:
        return hash(self._items)

    def __repr__(self) -> str:
        return repr(dict(self._items))


@dataclass(frozen=True)
class Scenario:
    """A start that always gives the same scene.

    Args:
        task: such as ``"maze"``, or a class of a user as ``"file.py:Class"``, whose path becomes
            absolute, or ``"module:Class"``.
        simulator: such as ``"pymunk"``.
        preset: set of dimensions, ``"benchmark"`` or ``"testbed"``.
        variations: what departs from the preset, by name; each task lists its own.
        seed: of the layout, not negative.
        name: what it is called in results: ``"corner"``, or ``"SUITE/corner"`` as one of the
            scenarios that a suite counts as one setting (`Suite.as_one_setting`). By default
            results name what it is made of.

    Raises:
        SchemaError: if a name is no plain word or a variation is no plain finite value. Whether
            a name exists is checked where the environment is made.
    """

    task: str
    simulator: str = "pymunk"
    preset: str = "benchmark"
    variations: Mapping[str, Value] = field(default_factory=dict)
    seed: int = 0
    name: str = ""

    def __post_init__(self) -> None:
        for key in ("task", "simulator", "preset"):
            value = getattr(self, key)
            own = key == "task" and isinstance(value, str) and _OWN_TASK.fullmatch(value)
            if not own and not (isinstance(value, str) and _NAME.fullmatch(value)):
                raise SchemaError(f"scenario.{key} must be a plain name, got {short(value)}")
        object.__setattr__(self, "task", absolute(self.task))
        if not isinstance(self.variations, Mapping):
            raise SchemaError(
                f"scenario.variations must be a mapping, got {short(self.variations)}"
            )
        for name, value in self.variations.items():
            if not isinstance(name, str):
                raise SchemaError(f"the name of a variation must be a text, got {short(name)}")
            if not isinstance(value, bool | int | float | str) or (
                isinstance(value, float) and not math.isfinite(value)
            ):
                raise SchemaError(
                    f"variation {short(name)} must be a truth value, a finite number or a text, "
                    f"got {short(value)}"
                )
        object.__setattr__(self, "variations", Variations(self.variations))
        object.__setattr__(self, "seed", integer("scenario.seed", self.seed, low=0))
        if self.name and not (isinstance(self.name, str) and _OWN_NAME.fullmatch(self.name)):
            raise SchemaError(
                f"scenario.name must be NAME or SUITE/NAME, on one line, got {short(self.name)}"
            )

    @property
    def key(self) -> str:
        """Short text that tells scenarios apart and is the same everywhere."""
        if self.name:
            return f"{self.name}-{self.seed}"
        text = json.dumps(dict(self.variations), sort_keys=True)
        digest = hashlib.sha256(text.encode()).hexdigest()[:8]
        return f"{self.task.rpartition(':')[2]}-{self.simulator}-{self.preset}-{digest}-{self.seed}"

    def to_dict(self) -> dict[str, Any]:
        """The scenario as plain values, ready for JSON or YAML."""
        return {
            "task": self.task,
            "simulator": self.simulator,
            "preset": self.preset,
            "variations": dict(self.variations),
            "seed": self.seed,
            **({"name": self.name} if self.name else {}),
        }

    @classmethod
    def from_dict(cls, data: object) -> Scenario:
        """Read what `to_dict` wrote; all but ``task`` may be left out.

        Raises:
            SchemaError: an unknown or missing key, or a value of the wrong kind.
        """
        known_keys("scenario", data, _KEYS, ("task",))
        assert isinstance(data, Mapping)
        return cls(**data)


def save_scenarios(scenarios: Iterable[Scenario], path: str | Path) -> None:
    """Write scenarios to a YAML file; `load_scenarios` gives them back equal."""
    data = {"schema": SCHEMA, "scenarios": [scenario.to_dict() for scenario in scenarios]}
    Path(path).write_text(dump(data), encoding="utf-8")


def load_scenarios(path: str | Path) -> tuple[Scenario, ...]:
    """Read a file of scenarios.

    Raises:
        SchemaError: if the file is missing, not YAML, or off the schema.
    """
    data = read_data(path, "scenario file")
    known_keys(f"scenario file {path}", data, ("schema", "scenarios"), ("schema", "scenarios"))
    if data["schema"] != SCHEMA:
        raise SchemaError(f"this pushplan reads schema {SCHEMA!r}, got {short(data['schema'])}")
    if not isinstance(data["scenarios"], list):
        raise SchemaError(f"{path}: scenarios must be a list")
    return tuple(Scenario.from_dict(item) for item in data["scenarios"])
