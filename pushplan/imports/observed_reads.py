"""Files, modules and environment variables that code of users reads while it runs here."""

from __future__ import annotations

import contextlib
import functools
import os
import stat
import sys
import time
from collections.abc import Iterator
from importlib.util import source_from_cache
from typing import Any

from pushplan.errors import is_a_users

Reads = dict[str, object]
"""Path of a file, or ``$`` and the name of an environment variable -> its `version`."""
PREFIX = "pushplan_user_"
"""Beginning of the names of modules that are loaded from files."""
_FOLDERS = ("bin", "etc", "include", "lib", "lib64", "share")
_PREFIXES = {sys.prefix, sys.base_prefix}
_SYSTEMS = (
    *(os.path.join(prefix, folder, "") for prefix in _PREFIXES for folder in _FOLDERS),
    *("/dev/", "/etc/", "/proc/", "/run/", "/sys/"),
)
"""Folders of Python and of the system: versions stand for them, or nothing does."""
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_observers: list[tuple[int, Reads]] = []  # when each began [ns], and what it has seen
_written: set[str] = set()  # products of this process
_environment_item = os._Environ.__getitem__
_imported: set[str] = set()
_read: Reads = {}  # everything, for modules may hold it
once: Reads = {}
"""Reads that may serve later jobs of this process: of modules as they were loaded, of dry runs."""


def version(name: str) -> object:
    """A value that changes when a file is rewritten or a variable is set; None if missing."""
    if name.startswith("$"):
        return os.environ.get(name[1:])
    try:
        found = os.stat(name)
    except (OSError, ValueError):
        return None
    return found.st_mtime_ns, found.st_size


def has_changed() -> bool:
    """True if modules may hold what has changed since, and is no product of this process."""
    return any(version(name) != before for name, before in _read.items() if name not in _written)


def forget_modules() -> None:
    """Let modules of users be imported again that were imported in a context of `observing`."""
    for name in _imported & sys.modules.keys():
        if name.startswith(PREFIX) or getattr(sys.modules[name], "__file__", None) in _read:
            sys.modules.pop(name, None)
    _imported.clear()
    _read.clear()
    once.clear()


@contextlib.contextmanager
def observing(*, kept: bool = False) -> Iterator[Reads]:
    """Collect what code of users reads in a context, in any thread of this process.

    Files that are written meanwhile are products, and are left out at the end. So is a copy of the
    whole environment.

    Args:
        kept: add what was read to `once`, and all of that to contexts around this one.
    """
    _listen()
    before = {*sys.modules}
    seen: Reads = {}
    observer = (time.time_ns(), seen)
    _observers.append(observer)
    os._Environ.__getitem__ = _observed_item  # type: ignore[method-assign]
    try:
        yield seen
    finally:
        _imported.update(sys.modules.keys() - before)
        _observers[:] = [one for one in _observers if one is not observer]
        if not _observers:
            os._Environ.__getitem__ = _environment_item  # type: ignore[method-assign]
        is_copy = seen.keys() >= {f"${name}" for name in os.environ} - _written
        for name in [*seen]:
            if name in _written or (is_copy if name[0] == "$" else version(name) != seen[name]):
                del seen[name]
        _read.update(seen)
        if kept:
            once.update(seen)
            for _, outer in _observers:
                outer.update(once)


@functools.cache
def _listen() -> None:
    from pushplan import core  # most programs need none of it

    core.add_audit_hook(_hear)


def _hear(event: str, arguments: tuple[Any, ...]) -> None:
    """Note the file of an audit event of Python, or the variable that it sets."""
    if not _observers:
        return
    with contextlib.suppress(OSError, TypeError, ValueError):  # a number, or no path at all
        name = os.fsdecode(arguments[1 if event == "import" else 0])
        if event.startswith("os."):
            _written.add(f"${name}")
            return
        path = os.path.abspath(name)
        if event == "open":
            mode, flags = arguments[1:3]
            if flags & _WRITING or {*(mode or "")} & {*"wax+"}:
                _written.add(path)
                return
        elif not os.path.isabs(name) and not os.path.exists(path):
            return  # a library that the system searches for, or a database in memory
        with contextlib.suppress(ValueError):
            path = source_from_cache(path)
        if is_a_users(path) and "__pycache__" not in path and not path.startswith(_SYSTEMS):
            _note_file(path)


def _note_file(path: str) -> None:
    found = version(path)
    if found is not None and not stat.S_ISREG(os.stat(path).st_mode):
        return
    for began, seen in _observers:
        if not isinstance(found, tuple) or found[0] < began:  # else it was written meanwhile
            seen.setdefault(path, found)


def _observed_item(self: Any, key: Any) -> Any:
    """Note a variable that code of a user asks for; libraries read many that change nothing."""
    frame = sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__") in (
        "os",
        "collections.abc",
    ):
        frame = frame.f_back
    if is_a_users(frame.f_code.co_filename) and isinstance(key, str | bytes):
        name = f"${os.fsdecode(key)}"
        if name not in _written:
            for _, seen in _observers:
                seen.setdefault(name, version(name))
    return _environment_item(self, key)
