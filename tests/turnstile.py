"""Let a test of clocks run while no other worker of the same run is in a test."""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class Turnstile:
    """Two file locks: many tests share the hall, or one has it alone.

    Whoever waits for the hall holds the gate, so that nobody else enters meanwhile.

    Args:
        folder: of the lock files, the same for all workers of a run.
    """

    def __init__(self, folder: Path) -> None:
        self._gate = (folder / "gate").open("w")
        self._hall = (folder / "hall").open("w")

    @contextmanager
    def passed(self, alone: bool) -> Iterator[None]:
        """Be in the hall, alone or with others."""
        fcntl.flock(self._gate, fcntl.LOCK_EX)
        fcntl.flock(self._hall, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
        fcntl.flock(self._gate, fcntl.LOCK_UN)
        try:
            yield
        finally:
            fcntl.flock(self._hall, fcntl.LOCK_UN)
