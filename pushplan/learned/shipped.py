"""Trained policies that come with the package, by name."""

from __future__ import annotations

import functools
from importlib import resources
from pathlib import Path

from pushplan.world import UnknownNameError


@functools.lru_cache(maxsize=1)
def _shipped() -> dict[str, Path]:
    folder = Path(str(resources.files("pushplan.learned"))) / "weights"
    return {path.stem: path for path in sorted(folder.glob("*.onnx"), key=lambda path: path.stem)}


def learned_names() -> tuple[str, ...]:
    """The names of the shipped networks, such as ``maze-ppo``."""
    return tuple(_shipped())


def weights_of(name: str) -> Path:
    """The file of a shipped network.

    Raises:
        UnknownNameError: if there is none of that name.
    """
    if name not in _shipped():
        raise UnknownNameError("learned policy", name, learned_names())
    return _shipped()[name]
