"""Presets of the tasks: `presets.yaml` has the numbers, a class beside each task their meaning."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any, TypeVar

from pushplan.envs.simulators.base import Materials, Solids
from pushplan.envs.simulators.water import Water
from pushplan.world.safe_files import read_data

T = TypeVar("T")


@cache
def _table() -> Mapping[str, Any]:
    table: Mapping[str, Any] = read_data(Path(__file__).with_suffix(".yaml"), "presets")
    return table


def read_presets(
    task: str, kind: Callable[..., T], **readers: Callable[[Any], Any]
) -> dict[str, T]:
    """The presets of a task by name, in the order of the file.

    Args:
        task: its name.
        kind: the class of the presets.
        readers: make the value of a field of what the file has; else lists become tuples.
    """
    return {
        name: build(kind, values, materials=_materials, **readers)
        for name, values in _table()[task].items()
    }


def build(kind: Callable[..., T], values: Mapping[str, Any], **readers: Callable[[Any], Any]) -> T:
    """An object of its fields in the file; arguments as in `read_presets`."""
    return kind(**{name: readers.get(name, _plain)(value) for name, value in values.items()})


def _plain(value: Any) -> Any:
    if isinstance(value, list):
        return tuple(map(_plain, value))
    if isinstance(value, dict):
        return {name: _plain(each) for name, each in value.items()}
    return value


_materials = partial(build, Materials, solids=partial(build, Solids), water=partial(build, Water))

SOLIDS: Mapping[str, Solids] = {
    name: build(Solids, values) for name, values in _table()["solids"].items()
}
"""The third dimension of the testbed, by robot."""
