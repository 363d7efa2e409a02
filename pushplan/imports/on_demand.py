"""Modules that are imported when they are first needed; one line says what a missing one needs."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from importlib import import_module
from typing import Any

from pushplan.errors import MissingDependencyError, UnknownNameError

_LIBRARIES = {
    "pictures": "PIL",
    "completion": "argcomplete",
    "sim": "rich gymnasium mujoco pymunk",
    "learned": "onnxruntime",
    "plots": "imageio_ffmpeg jinja2 matplotlib",
    "ros": "mcap rosbags",
    "parquet": "pyarrow",
    "cluster": "distributed",
    "train": "h5py minari moviepy onnx stable_baselines3 tensorboard torch",
}
EXTRAS = {library: extra for extra, names in _LIBRARIES.items() for library in names.split()}
"""Library -> the extra of pushplan that brings it."""


def need(module: str) -> Any:
    """Import a module: a library of an extra, or one of ours that needs such a library.

    Raises:
        MissingDependencyError: if the library is not installed; it names the extra.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        told = missing(error)
        if told is None:
            raise
        raise told from error


def missing(error: BaseException) -> MissingDependencyError | None:
    """Our error in place of one about a missing library of an extra; None for others."""
    if not isinstance(error, ModuleNotFoundError):
        return None
    library = (error.name or "").partition(".")[0]
    if library not in EXTRAS:
        return None
    return MissingDependencyError(
        f"this needs {library}: pip install 'pushplan[{EXTRAS[library]}]'"
    )


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


class Registered(MutableMapping[str, str]):
    """A table of ``"module:name"`` texts, and after it what installed distributions add to it.

    They are searched when a name is asked for that is not of the package's own table, or all are.

    Args:
        group: of their entry points, such as those of policies.
        own: the table of this package; its names cannot be taken.
    """

    def __init__(self, group: str, own: Mapping[str, str]) -> None:
        self._group: str | None = group  # None once it has been searched
        self._known = dict(own)

    def _all(self) -> dict[str, str]:
        if self._group is not None:
            for point in sorted(
                _entry_points().select(group=self._group), key=lambda one: one.name
            ):
                self._known.setdefault(point.name, point.value)
            self._group = None
        return self._known

    def __getitem__(self, name: str) -> str:
        if name in self._known:  # our own names need no search of what is installed
            return self._known[name]
        return self._all()[name]

    def __setitem__(self, name: str, value: str) -> None:
        self._known[name] = value

    def __delitem__(self, name: str) -> None:
        del self._all()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._all())

    def __len__(self) -> int:
        return len(self._all())


@functools.cache
def _entry_points() -> Any:
    from importlib.metadata import entry_points  # most programs need none of it

    return entry_points()


def look_up(kind: str, table: Mapping[str, str], name: object) -> Any:
    """Import what a name stands for in a table of ``"module:name"`` texts.

    Raises:
        UnknownNameError: if it is not in the table; the message calls it a ``kind``.
        MissingDependencyError: if a library that it needs is not installed.
    """
    if not isinstance(name, str) or name not in table:  # a list, say, cannot be asked for
        raise UnknownNameError(kind, name, table)
    module, _, attribute = table[name].partition(":")
    return getattr(need(module), attribute)
