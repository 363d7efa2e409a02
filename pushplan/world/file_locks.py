"""Whether another process holds a lock file."""

from __future__ import annotations

from pathlib import Path

try:
    import fcntl
except ImportError:  # on Windows no file is ever held
    fcntl = None  # type: ignore[assignment]


def is_locked(path: Path) -> bool:
    """Whether some process holds a file with an exclusive `flock`; not where it cannot be read."""
    if fcntl is None:
        return False
    try:
        with path.open() as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False
