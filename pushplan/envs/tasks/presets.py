"""Presets of the tasks: `presets.yaml` has the numbers and says what they mean."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from pkgutil import resolve_name
from types import SimpleNamespace
from typing import Any

from pushplan.envs.simulators.base import Materials, Solids, Water
from pushplan.files.safe_files import read_data
from pushplan.world import Drive, RobotModel


class Preset(SimpleNamespace):
    """One set of dimensions of a task, under the names of the file."""

    name: str
    materials: Materials

    def robot(self, name: str, drive: Drive, **options: Any) -> RobotModel:
        """One of the ``robots`` of the file, with further options of its maker.

        The drive counts unless the file gives the robot one of its own.
        """
        entry = {"drive": drive, **self.robots[name]}
        entry.pop("bumper", None)
        robot: RobotModel = resolve_name(entry.pop("make"))(**entry, **options)
        return robot


@cache
def _table() -> Mapping[str, Any]:
    table: Mapping[str, Any] = read_data(Path(__file__).with_suffix(".yaml"), "presets")
    return table


def read_presets(task: str) -> dict[str, Preset]:
    """The presets of a task by name, in the order of the file."""
    return {
        name: Preset(**{**values, "name": name, "materials": _materials(values["materials"])})
        for name, values in _table()[task].items()
    }


def _materials(values: Mapping[str, Any]) -> Materials:
    classes = {"solids": Solids, "water": Water}
    layers = {name: kind(**values[name]) for name, kind in classes.items() if name in values}
    return Materials(**{**values, **layers})


SOLIDS: Mapping[str, Solids] = {
    name: Solids(**values) for name, values in _table()["solids"].items()
}
"""The third dimension of the testbed, by robot."""
