"""The small worlds in which policies are warmed up: data, in ``warm_up_worlds.yaml``."""

from __future__ import annotations

from pathlib import Path

from pushplan.world import World
from pushplan.world.files import world_from_dict
from pushplan.world.safe_files import read_data


def warm_up_worlds(of: str) -> list[World]:
    """The worlds for what is warmed up, a key of the file."""
    data = read_data(Path(__file__).with_suffix(".yaml"), "worlds of the warm-up")
    return [world_from_dict(world) for world in data[of]]
