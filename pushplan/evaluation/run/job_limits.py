"""Limits on what one job may use, time and memory, and (on Linux) the processes that it starts."""

from __future__ import annotations

import contextlib
import faulthandler
import os
import resource
import signal
import threading
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import FrameType

from pushplan.world import InvalidInputError

MEMORY_MB = 4000.0
"""Memory of a worker beyond which a job fails, unless something else is asked for [MB]."""
WORKER_VARIABLE = "PUSHPLAN_WORKER"
"""Set in the environment of a worker process."""
THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMBA_NUM_THREADS",
)
"""Set to 1 in a worker: parallel workers that each use all cores slow each other down."""


class EpisodeTimeout(BaseException):
    """Raised inside a job that takes too long.

    Not an `Exception`, so that a policy which catches those does not swallow it.
    """


_LONGEST_S = 1e8  # years; a timer takes no more than a C integer holds


@contextlib.contextmanager
def soft_limit(seconds: float | None) -> Iterator[None]:
    """Raise `EpisodeTimeout` in the body after this much wall-clock time.

    Works in the main thread of a process and between two instructions of Python: code that
    never returns to the interpreter has to be ended from outside. Elsewhere it does nothing.
    """
    if seconds is None or threading.current_thread() is not threading.main_thread():
        yield
        return

    def expire(signum: int, frame: FrameType | None) -> None:
        raise EpisodeTimeout

    previous = signal.signal(signal.SIGALRM, expire)
    signal.setitimer(signal.ITIMER_REAL, min(seconds, _LONGEST_S))
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, previous)


@contextlib.contextmanager
def hard_limit(seconds: float | None) -> Iterator[None]:
    """End this whole process after this much wall-clock time, even if the GIL is held.

    For workers of an executor that cannot end them itself. A thread that needs no interpreter
    prints where the process hangs and exits.
    """
    if seconds is None:
        yield
        return
    faulthandler.dump_traceback_later(seconds, exit=True)
    try:
        yield
    finally:
        faulthandler.cancel_dump_traceback_later()


def check_limits(workers: int, memory_mb: float | None) -> None:
    """Refuse to start workers under limits of the shell that would make policies fail.

    Raises:
        InvalidInputError: if there are too few file descriptors, or less memory than a worker may
            use.
    """
    files = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
    needed = 64 + 4 * workers
    if files != resource.RLIM_INFINITY and files < needed:
        raise InvalidInputError(
            f"{workers} workers need {needed} file descriptors and the limit is {files}: raise it "
            f"with 'ulimit -n {needed}', or give fewer workers"
        )
    for option, limit in (("v", resource.RLIMIT_AS), ("d", resource.RLIMIT_DATA)):
        most = resource.getrlimit(limit)[0]
        if memory_mb is not None and most != resource.RLIM_INFINITY and most < memory_mb * 1e6:
            raise InvalidInputError(
                f"a worker may use {memory_mb:g} MB and 'ulimit -{option}' allows "
                f"{most / 1e6:.0f} MB: raise that limit, or give --memory {most / 1e6:.0f} or less"
            )


def is_ctrl_c(error: BaseException) -> bool:
    """True for a KeyboardInterrupt that is no policy's: workers ignore that signal."""
    return isinstance(error, KeyboardInterrupt) and not os.environ.get(WORKER_VARIABLE)


def limit_memory(megabytes: float | None) -> None:
    """Let allocations of this process fail beyond this much private memory [MB], for good."""
    if megabytes is None:
        return
    limit = int(megabytes * 1e6)
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    if hard != resource.RLIM_INFINITY:
        limit = min(limit, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (limit, hard))


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
