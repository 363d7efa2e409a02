"""Names that stand for what is imported when it is first asked for."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import Any

from pushplan.world.errors import UnknownNameError
from pushplan.world.libraries import need


def lazy_names(
    package: str, homes: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Make a package's ``__getattr__`` and ``__dir__``, so that it costs what is asked of it.

    Args:
        package: the package's ``__name__``.
        homes: module, below the package -> the names that live there, with spaces between.
    """
    modules = {name: home for home, names in homes.items() for name in names.split()}

    def load(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(need(f"{package}.{modules[name]}"), name)

    return load, lambda: list(sys.modules[package].__all__)


def look_up(kind: str, table: Mapping[str, str], name: object) -> Any:
    """Import what a name stands for in a table of ``"module:name"`` texts.

    Raises:
        UnknownNameError: if it is not in the table; the message calls it a ``kind``.
        MissingDependencyError: if a library that it needs is not installed.
    """
    if not isinstance(name, str) or name not in table:
        raise UnknownNameError(kind, name, table)
    module, _, attribute = table[name].partition(":")
    return getattr(need(module), attribute)
