"""Compiled kernels on disk: one file for each kernel, form, signature and processor.

The name of a file is a digest of all that its content depends on, so there is no index that two
processes could write at once, and a kernel is compiled anew when one that it calls has changed.
"""

from __future__ import annotations

import contextlib
import pickle
import sys
import time
from typing import Any, TextIO

from numba.core.caching import NullCache
from numba.core.serialize import dumps

from pushplan.compiled.cache_files import Folders, find_folders, read, remove, warn_once, write
from pushplan.compiled.fingerprint import fingerprint, source_digest
from pushplan.compiled.pipeline import rebuilt, reduced
from pushplan.files.file_locks import is_locked, take_lock

_PATIENCE = 300.0  # time that a process waits for another that compiles the same kernel [s]
_POLL = 0.05  # [s]


class KernelCache(NullCache):
    """The files of one form of one kernel."""

    def __init__(self, kernel: Any, form: str) -> None:
        """Open nothing yet.

        Args:
            kernel: the dispatcher.
            form: "inner" or "outer".
        """
        self._kernel = kernel
        self._form = form
        self._lock: TextIO | None = None

    @property
    def cache_path(self) -> str:
        """The folder that it writes to; empty where there is none."""
        return str(self._folders.write or "")

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load what was compiled for a signature; if nothing was, lock its place."""
        target_context.refresh()
        name = self._name(sig, target_context.codegen())
        found = self._load(name, target_context)
        if found is None and self._wait():
            found = self._load(name, target_context)
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Write what was compiled for a signature."""
        folder = self._folders.write
        if folder is None or data.library.has_dynamic_globals:
            return
        name = self._name(sig, data.codegen)
        try:
            write(folder / name, dumps(reduced(data)))
        except OSError as error:
            warn_once(f"compiled kernels are not kept: {error}")
            return
        current = ".".join(name.split(".")[:-2])
        for path in folder.glob(f"{self._stem}.*.nbc"):
            if not path.name.startswith(current):  # of another version of the code
                remove(path)

    def release(self) -> None:
        """Let other processes go on."""
        if self._lock is not None:
            self._lock.close()
            self._lock = None

    def holds_current(self) -> bool:
        """Return True if the cache has a kernel of the current code, for any types of arguments."""
        pattern = f"{self._stem}.{source_digest(self._kernel)[:12]}.*.nbc"
        return any(next(folder.glob(pattern), None) for folder in self._folders.read)

    def is_locked(self) -> bool:
        """Return True if a process holds the kernel's lock, to compile it."""
        folder = self._folders.write
        return folder is not None and is_locked(folder / f"{self._stem}.lock") is True

    @property
    def _folders(self) -> Folders:
        return find_folders(self._kernel.py_func.__code__.co_filename)

    @property
    def _stem(self) -> str:
        function = self._kernel.py_func
        name = f"{function.__module__.rpartition('.')[2]}.{function.__qualname__}"
        python = "".join(map(str, sys.version_info[:2]))
        return f"{name.replace('<', '').replace('>', '')}-{self._form}-py{python}"

    def _name(self, sig: Any, target: Any) -> str:
        signature = tuple(getattr(sig, "args", sig))
        key = fingerprint(self._kernel, signature, target, self._form)
        return f"{self._stem}.{source_digest(self._kernel)[:12]}.{key[:24]}.nbc"

    def _load(self, name: str, target_context: Any) -> Any:
        for folder in self._folders.read:
            content = read(folder / name)
            if content is not None:
                with contextlib.suppress(ImportError, AttributeError):  # a class moved since then
                    return rebuilt(pickle.loads(content), target_context)
        return None

    def _wait(self) -> bool:
        """Lock the kernel, and say whether another process held it until now."""
        folder = self._folders.write
        if folder is None or self._lock is not None:
            return False
        try:
            self._lock = (folder / f"{self._stem}.lock").open("a")
        except OSError:
            return False
        # on a disk without locks two processes may compile the same kernel, and both are right
        waited = False
        until = time.monotonic() + _PATIENCE
        while take_lock(self._lock) is False and time.monotonic() < until:
            waited = True
            time.sleep(_POLL)
        return waited
