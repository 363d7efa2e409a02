"""Processes that a worker has started, found in ``/proc``: on Linux alone."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from pushplan.evaluation.run.job_limits import WORKER_VARIABLE


def descendants(pid: int) -> Iterator[int]:
    """Processes that a process started, and those that they started (Linux)."""
    for file in Path(f"/proc/{pid}/task").glob("*/children"):
        with contextlib.suppress(OSError):
            for child in map(int, file.read_text().split()):
                yield child
                yield from descendants(child)


def marked(mark: str) -> Iterator[int]:
    """Processes in whose environment a worker has begun (Linux)."""
    entry = f"{WORKER_VARIABLE}={mark}".encode()
    for file in Path("/proc").glob("[0-9]*/environ"):
        with contextlib.suppress(OSError):
            if entry in file.read_bytes():
                yield int(file.parent.name)


def process_group(pid: int) -> int | None:
    """The process group of a process that runs; None if it has ended."""
    with contextlib.suppress(OSError):
        state, _, group = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[:3]
        return None if state in "ZX" else int(group)
    return None


def memory_kb(pids: Iterable[int]) -> float:
    """Memory of processes that is no file on a disk, shared or not [KiB].

    Files in memory that they hold open count where they are more than what is mapped of such.
    """
    private = shared = 0
    files: dict[tuple[int, int], float] = {}
    for pid in pids:
        with contextlib.suppress(OSError):
            for line in Path(f"/proc/{pid}/status").read_text().splitlines():
                private += int(line.split()[1]) if line.startswith("RssAnon") else 0
                shared += int(line.split()[1]) if line.startswith("RssShmem") else 0
            for handle in Path(f"/proc/{pid}/fd").iterdir():
                if os.readlink(handle).startswith(("/memfd:", "/dev/shm/")):
                    found = handle.stat()
                    files[found.st_dev, found.st_ino] = found.st_blocks / 2
    return private + max(shared, sum(files.values()))
