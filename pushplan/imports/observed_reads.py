"""Files, modules and environment variables that code of users reads while it runs here."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import os
import stat
import sys
import time
from collections.abc import Iterator
from importlib.util import source_from_cache
from pathlib import Path
from typing import Any

from pushplan.errors import is_a_users

Reads = dict[str, object]
"""Path of a file, or ``$`` and the name of an environment variable -> its `version`."""
PREFIX = "pushplan_user_"
"""Beginning of the names of modules that are loaded from files."""
_SYSTEM = ("/dev/", "/etc/", "/proc/", "/run/", "/sys/", "/usr/share/")
_PREFIXES = {sys.prefix, sys.base_prefix}
_PYTHON = [
    f"{one}/{name}/" for one in _PREFIXES for name in ("bin", "etc", "lib", "lib64", "share")
]
_EVENTS = ("open", "import", "ctypes.dlopen", "os.putenv", "os.unsetenv")
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_observers: list[tuple[int, Reads]] = []  # when each began [ns], and what it has seen
_written: set[str] = set()  # products of this process
_imported: set[str] = set()  # modules
_read: Reads = {}  # everything, for modules may hold it
_environment_item = os._Environ.__getitem__
kept: Reads = {}
"""Reads of modules while they were loaded, which serve every job of this process."""


def version(name: str | Path) -> object:
    """A key that changes when a file is rewritten or a variable is set; None if missing."""
    if isinstance(name, str) and name.startswith("$"):
        return os.environ.get(name[1:])
    try:
        found = os.stat(name)
    except (OSError, ValueError):
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino


def has_changed() -> bool:
    """True if modules may hold what has changed since, and is no product of this process."""
    return any(version(name) != before for name, before in _read.items() if name not in _written)


def forget_modules() -> None:
    """Let modules of users be imported again that were imported in a context of `observing`."""
    for name in _imported & sys.modules.keys():
        if name.startswith(PREFIX) or getattr(sys.modules[name], "__file__", None) in _read:
            sys.modules.pop(name, None)
    for known in (_imported, _read, kept):
        known.clear()


@contextlib.contextmanager
def observing(reads: Reads) -> Iterator[None]:
    """Add what code of users reads in a context, in any thread of this process.

    Files that are written meanwhile are products and do not count, nor does a copy of the whole
    environment. What is `kept` goes to contexts around this one as well.
    """
    _listen()
    before = {*sys.modules}
    seen: Reads = {}
    observer = (time.time_ns(), seen)
    _observers.append(observer)
    os._Environ.__getitem__ = _observed_item  # type: ignore[method-assign]
    try:
        yield
    finally:
        _imported.update(sys.modules.keys() - before)
        _observers[:] = [one for one in _observers if one is not observer]
        if not _observers:
            os._Environ.__getitem__ = _environment_item  # type: ignore[method-assign]
        variables = {name for name in seen if name[0] == "$"}
        if variables >= {f"${name}" for name in os.environ} - _written:  # a copy of all of them
            ignored = _written | variables
        else:
            ignored = _written - variables
        for name, known in seen.items():
            if name not in ignored and (name in variables or version(name) == known):
                reads[name] = _read[name] = known
        if reads is kept:
            for _, outer in _observers:
                outer.update(kept)


@functools.cache
def _listen() -> None:
    from pushplan import core  # most programs need none of it

    ctypes.pythonapi.PySys_AddAuditHook(ctypes.c_void_p(core.audit_hook(_hear)), None)


def _hear(event: str, arguments: tuple[Any, ...]) -> None:
    """Note the file of an audit event of Python, or the variable that it sets."""
    if event not in _EVENTS or not _observers:
        return
    with contextlib.suppress(OSError, TypeError, ValueError):  # a number, or no path at all
        name = os.fsdecode(arguments[1 if event == "import" else 0])
        if event.startswith("os."):
            _written.add(f"${name}")
        elif event == "open" and (
            arguments[2] & _WRITING or not {*(arguments[1] or "")}.isdisjoint("wax+")
        ):
            _written.add(os.path.abspath(name))
        elif event == "open" or os.sep in name:  # else the system searches for a library
            _note_file(os.path.abspath(name))


def _note_file(path: str) -> None:
    with contextlib.suppress(ValueError):
        path = source_from_cache(path)
    ours = not is_a_users(path) or path.startswith((*_SYSTEM, *_PYTHON)) or "__pycache__" in path
    found = version(path)
    if ours or (found is not None and not stat.S_ISREG(os.stat(path).st_mode)):
        return
    for began, seen in _observers:
        if not isinstance(found, tuple) or found[0] < began:  # else it was written meanwhile
            seen.setdefault(path, found)


def _observed_item(self: Any, key: Any) -> Any:
    """Note a variable that code of a user asks for; libraries read many that change nothing."""
    frame = sys._getframe(1)
    while frame.f_back and frame.f_globals.get("__name__") in ("os", "collections.abc"):
        frame = frame.f_back
    if is_a_users(frame.f_code.co_filename) and isinstance(key, str | bytes):
        name = f"${os.fsdecode(key)}"
        for _, seen in _observers:
            if name not in _written:
                seen.setdefault(name, version(name))
    return _environment_item(self, key)
