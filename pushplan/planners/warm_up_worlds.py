"""The small worlds in which policies are warmed up: data, in ``warm_up_worlds.yaml``."""

from __future__ import annotations

from pathlib import Path

from pushplan.files.safe_files import read_data
from pushplan.world import World, world_from_dict


def warm_up_worlds(of: str) -> list[World]:
    """The worlds for what is warmed up, a key of the file."""
    data = read_data(Path(__file__).with_suffix(".yaml"), "worlds of the warm-up")
    return [world_from_dict(world) for world in data[of]]
