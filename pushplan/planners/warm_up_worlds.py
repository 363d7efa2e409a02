"""The small worlds in which policies are warmed up: data, in ``warm_up_worlds.yaml``."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from pushplan.files.safe_files import read_data
from pushplan.world import World, world_from_dict


def warm_up_worlds(of: str) -> list[World]:
    """The worlds for what is warmed up, a key of the file."""
    return [world_from_dict(world) for world in _table()[of]]


@cache
def _table() -> Mapping[str, Any]:
    table: Mapping[str, Any] = read_data(
        Path(__file__).with_suffix(".yaml"), "worlds of the warm-up"
    )
    return table
