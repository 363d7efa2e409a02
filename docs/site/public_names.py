"""The public names of pushplan, from each package's ``__all__``, and where each is described."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Iterator
from functools import cache
from types import ModuleType
from typing import Any

import pushplan

FIRST = ("world", "planners", "envs", "evaluation", "metrics", "scenarios")
"""Packages whose pages come first; a name that two of them give is described at the first that
defines it."""


@cache
def packages() -> tuple[str, ...]:
    """Every package of pushplan with public names, in the order of its pages."""
    found = [one.name for one in pkgutil.iter_modules(pushplan.__path__) if one.ispkg]
    ordered = [*FIRST, *(name for name in sorted(found) if name not in FIRST)]
    return tuple(name for name in ordered if names_of(name))


@cache
def names_of(package: str) -> tuple[str, ...]:
    """The public names of ``pushplan.package``."""
    return tuple(getattr(importlib.import_module(f"pushplan.{package}"), "__all__", ()))


def value_of(package: str, name: str) -> Any:
    """What a public name stands for."""
    return getattr(importlib.import_module(f"pushplan.{package}"), name)


@cache
def homes() -> dict[str, str]:
    """Public name -> the package at which it is described."""
    found: dict[str, str] = {}
    for package in packages():
        for name in names_of(package):
            module = getattr(value_of(package, name), "__module__", None) or ""
            if name not in found or module.startswith(f"pushplan.{package}."):
                found[name] = package
    return found


def directive_of(value: Any) -> str:
    """The directive that describes a value; "data" for what has no docstring of its own."""
    if inspect.isclass(value):
        return "autoexception" if issubclass(value, BaseException) else "autoclass"
    return "autofunction" if callable(value) and hasattr(value, "__name__") else "data"


def comment_on(package: str, name: str) -> str:
    """The text below a constant or a type alias in the module that it stands in."""
    from sphinx.pycode import ModuleAnalyzer

    root = importlib.import_module(f"pushplan.{package}")
    for module in (root.__name__, *_modules(root)):
        said = ModuleAnalyzer.for_module(module).find_attr_docs().get(("", name))
        if said:
            return "\n".join(said).strip()
    return ""


def _modules(root: ModuleType) -> Iterator[str]:
    for one in pkgutil.walk_packages(root.__path__, f"{root.__name__}."):
        yield one.name
