"""Locks of files between processes, which the disks of some clusters do not have."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import IO

try:
    import fcntl
except ImportError:  # on Windows no file is ever held
    fcntl = None  # type: ignore[assignment]

_HELD = (errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES)
"""Errors that name another holder; any other, such as ENOLCK or ENOSYS, a disk without locks."""
NO_FOLLOW = getattr(os, "O_NOFOLLOW", 0)
"""Flag of `os.open` that refuses a link."""


def take_lock(file: IO[str] | int, *, shared: bool = False, posix: bool = False) -> bool | None:
    """Lock an open file for this process, without waiting.

    Args:
        file: the open file; the lock ends when it is closed.
        shared: let others share the lock.
        posix: take a lock of the kind that SQLite uses; on Linux those of `flock` do not see it.

    Returns:
        True if this process holds the lock now, False if another one does, None if there are no
        locks on the disk of the file.
    """
    if fcntl is None:
        return None
    call = fcntl.lockf if posix else fcntl.flock
    try:
        call(file, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except OSError as error:
        return False if error.errno in _HELD else None
    return True


def is_locked(path: Path, *, posix: bool = False) -> bool | None:
    """True if a process holds a file with an exclusive lock; None if its disk has no locks.

    Args:
        path: the file; one that cannot be opened is held by nobody.
        posix: as for `take_lock`.
    """
    try:
        # a pipe in its place would wait for somebody who writes
        handle = os.open(path, os.O_RDONLY | NO_FOLLOW | getattr(os, "O_NONBLOCK", 0))
    except OSError:
        return False
    try:
        # an exclusive POSIX lock needs a file that is open for writing
        free = take_lock(handle, shared=True, posix=posix)
    finally:
        os.close(handle)
    return None if free is None else not free
