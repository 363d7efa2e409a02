"""A line that says how far the kernels are while they are compiled."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.resources import files
from typing import Any

from pushplan.cli.common import duration

SECONDS_A_KERNEL = 1.2
"""Mean time to compile a kernel [s of CPU], from the table in docs/compilation.md."""

_LINGER_S = 3.0  # between two kernels a process imports and loads


@dataclass
class KernelProgress:
    """Count of the kernels that this process has compiled or loaded so far."""

    # names of the kernels that are to come; empty if that is not known
    expected: frozenset[str] = frozenset()
    terminal: bool = False  # to write on one line of; else a log gets one line in all
    compiled: int = 0
    loaded: int = 0
    ready: set[str] = field(default_factory=set)

    def __call__(self, kernel: str, loaded: bool) -> None:
        """Count a kernel, and say so if it was compiled."""
        self.loaded += loaded
        self.compiled += not loaded
        if not loaded:
            if self.terminal:
                self.clear(str(self))
            elif self.compiled == 1:
                words, _, _ = str(self).partition(":")
                sys.stderr.write(f"{words}; later runs find them in the cache\n")
        self.ready.add(kernel)

    def clear(self, text: str = "") -> None:
        """Empty the line for something else."""
        if self.terminal and self.compiled:
            sys.stderr.write(f"\r\033[K{text}")
            sys.stderr.flush()

    def __str__(self) -> str:
        """Say how far it is, without a total that is not known."""
        if self.expected and self.expected >= self.ready:
            words = in_words(len(self.expected - self.ready))
            return f"{words}: {len(self.ready)} of at most {len(self.expected)}"
        return f"compiling kernels, once: {len(self.ready)}"


class PendingKernels:
    """Kernels that worker processes may have to compile: what the cache on disk lacks of them.

    Args:
        names: policies; of those that `pushplan compile` does not name nothing is known.
    """

    def __init__(self, *names: str) -> None:
        self._missing = _used_by(names)
        self._seen = -_LINGER_S

    def finish(self) -> None:
        """Say no more of them: a job is done, and what it needed is there."""
        self._missing = frozenset()

    def __str__(self) -> str:
        """Say how long compiling may take while a process compiles a missing kernel; else empty."""
        from pushplan.compiled import cached_kernels, compiling_kernels

        now = time.monotonic()
        if self._missing and compiling_kernels(self._missing):
            self._seen = now
        if not self._missing or now - self._seen >= _LINGER_S:
            return ""
        self._missing -= cached_kernels(self._missing)
        return in_words(len(self._missing))


def in_words(missing: int) -> str:
    """Say how long compiling so many kernels takes, at most, on one core."""
    about = max(1.0, round(SECONDS_A_KERNEL * missing))
    return f"compiling kernels, about {duration(about)} at most, once"


@contextmanager
def kernel_progress(*names: str) -> Iterator[KernelProgress]:
    """Count kernels: on one line of a terminal, or once in words in a log.

    Args:
        names: what is to be warmed up, as `pushplan compile` names it, and nothing else.
    """
    from pushplan.compiled import watching  # Numba is loaded only where kernels are

    progress = KernelProgress(expected_kernels(*names), sys.stderr.isatty())
    try:
        with watching(progress):
            yield progress
    finally:
        progress.clear()


def expected_kernels(*names: str) -> frozenset[str]:
    """Look up the kernels that names make ready; none if one of the names is not known."""
    known = set().union(*_users().values()).issuperset(names)
    return _used_by(names) if known else frozenset()


def every_kernel() -> frozenset[str]:
    """The kernels that anything of `pushplan compile` makes ready."""
    return frozenset(_users())


def _used_by(names: Sequence[str]) -> frozenset[str]:
    """The kernels that any of these names makes ready."""
    return frozenset(kernel for kernel, by in _users().items() if not by.isdisjoint(names))


def _users() -> dict[str, set[str]]:
    """Kernel -> the names that make it ready."""
    text = files("pushplan.cli").joinpath("kernel_names.json").read_text(encoding="utf-8")
    table: dict[str, Any] = json.loads(text)
    return {kernel: set(users.split()) for users, of in table.items() for kernel in of}
