"""Files of compiled kernels: where they are, and reading and writing them without harm."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import logging
import os
import tempfile
from pathlib import Path
from typing import NamedTuple

from numba import config
from numba.core.caching import UserWideCacheLocator, _CacheLocator

_LOG = logging.getLogger(__name__)
_DIGEST = hashlib.sha256().digest_size
_damaged: set[Path] = set()  # folders that are known to hold damaged files


class Folders(NamedTuple):
    """Folders of the kernel cache."""

    read: tuple[Path, ...]  # Folders that are looked through, in order
    write: Path | None  # The one that is written to, None if none can be


def find_folders(source: str) -> Folders:
    """Find the folders for the kernels of a source file.

    They are, in this order, the folder that `NUMBA_CACHE_DIR` names, alone if it is set;
    `__pycache__` beside the source; the user's folder for caches.

    Args:
        source: path of the file.
    """
    return _folders(os.path.dirname(os.path.abspath(source)), str(config.CACHE_DIR or ""))


def read(path: Path) -> bytes | None:
    """Read a file that `write` wrote; None if there is none or it is damaged."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    if hashlib.sha256(content[_DIGEST:]).digest() != content[:_DIGEST]:
        _warn_damaged(path.parent)
        return None
    return content[_DIGEST:]


def write(path: Path, content: bytes) -> None:
    """Write a file at once, with its digest, so that nobody reads a part of it."""
    handle, name = tempfile.mkstemp(prefix=path.stem, suffix=".tmp", dir=path.parent)
    try:
        with open(handle, "wb") as file:
            file.write(hashlib.sha256(content).digest() + content)
        os.chmod(name, 0o644)
        os.replace(name, path)
    except OSError:
        remove(Path(name))
        raise


def remove(path: Path) -> None:
    """Remove a file if it is there and may be removed."""
    with contextlib.suppress(OSError):
        path.unlink()


@functools.cache
def warn_once(message: str) -> None:
    """Log a warning, each one once a process."""
    _LOG.warning(message)


def _warn_damaged(folder: Path) -> None:
    """Log a warning, one a process however many files in however many folders are damaged."""
    if not _damaged:
        _LOG.warning("the cache of kernels in %s is damaged, and compiled anew", folder)
    _damaged.add(folder)


@functools.cache
def _folders(package: str, chosen: str) -> Folders:
    source = os.path.join(package, "kernels.py")
    inside = _CacheLocator.get_suitable_cache_subpath(source)
    if chosen:
        candidates = [Path(chosen) / inside]
    else:
        user = Path(UserWideCacheLocator(read, source).get_cache_path())
        candidates = [Path(package) / "__pycache__", user]
    for folder in candidates:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=folder).close()
        except OSError as error:
            problem = error
        else:
            return Folders(tuple(candidates), folder)
    where = chosen or problem.filename
    warn_once(f"compiled kernels are not kept, {where} cannot be written to: {problem.strerror}")
    return Folders(tuple(candidates), None)
