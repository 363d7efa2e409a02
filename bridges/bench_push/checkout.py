"""Modules of ``benchnpin`` that its package in the registry lacks, from the original's repository.

Runs in the virtual environment of ``benchnpin``.
"""

from __future__ import annotations

import importlib.abc
import importlib.util
import sys
import types
from importlib.machinery import ModuleSpec, SourceFileLoader
from pathlib import Path


class Checkout(importlib.abc.MetaPathFinder):
    """Finds in a checkout what the installed package does not have; what it has stays as it is.

    The repository has had two names, and so have its imports: ``benchnpin`` and ``benchpush``.

    Args:
        folder: of the checkout.
    """

    def __init__(self, folder: Path) -> None:
        self._roots = [folder / name for name in ("benchpush", "benchnpin")]
        self._roots = [root for root in self._roots if root.is_dir()]
        if not self._roots:
            raise SystemExit(f"{folder} has no folder benchpush or benchnpin: not the original's")

    def find_spec(self, fullname: str, path: object = None, target: object = None) -> object:
        """The place of a module, if the checkout has it."""
        package, *rest = fullname.split(".")
        if package != "benchnpin" or not rest:
            return None
        for root in self._roots:
            place = root.joinpath(*rest)
            if place.is_dir():
                return ModuleSpec(fullname, None, is_package=True)  # of no folder: see below
            if (file := place.with_suffix(".py")).is_file():
                loader = _Renamed(fullname, str(file))
                return importlib.util.spec_from_file_location(fullname, file, loader=loader)
        return None


class _Renamed(SourceFileLoader):
    """Reads ``benchpush`` as ``benchnpin``, the name of the package that is installed.

    Packages of a checkout have no folder of their own, so that Python's own loader finds no file.
    """

    def path_stats(self, path: str) -> dict:
        raise OSError  # no compiled file, which may be of the other name

    def get_data(self, path: str) -> bytes:
        data = super().get_data(path)
        return data.replace(b"benchpush", b"benchnpin") if path.endswith(".py") else data


def take_from(folder: Path) -> None:
    """Import from a checkout what is not installed."""
    sys.meta_path.append(Checkout(folder))


def supply(module: str, **names: object) -> None:
    """A module with these names, where theirs cannot be imported and is not called."""
    try:
        importlib.import_module(module)
    except ImportError:
        found = types.ModuleType(module)
        vars(found).update(names)
        sys.modules[module] = found
