"""Optional libraries, imported when they are needed, with one clear error where they are not."""

from __future__ import annotations

import importlib
from typing import Any

from pushplan.world import InvalidInputError, MissingDependencyError


def need(name: str) -> Any:
    """A library of the extra ``learn``.

    Raises:
        MissingDependencyError: if it is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise MissingDependencyError(
            f"training needs {name.partition('.')[0]}: pip install 'pushplan[learn]'"
        ) from error


def chosen_device(name: str) -> str:
    """A device of PyTorch by name, ``"auto"`` for a GPU where there is one.

    Raises:
        InvalidInputError: if it is not there.
    """
    torch = need("torch")
    has_gpu = bool(torch.cuda.is_available())
    if name == "auto":
        return "cuda" if has_gpu else "cpu"
    if name != "cpu" and not name.startswith("cuda"):
        raise InvalidInputError(f"device must be auto, cpu or cuda, got {name!r}")
    if name != "cpu" and not has_gpu:
        raise InvalidInputError(f"device {name!r}: PyTorch sees no GPU here, use cpu")
    return name


def hardware(device: str) -> str:
    """The machine in words, for model cards; nothing that names it."""
    import os
    import platform

    torch = need("torch")
    words = f"{os.cpu_count()}-core {platform.machine()} machine"
    return f"{words}, {torch.cuda.get_device_name()}" if device != "cpu" else words
