"""A line that counts the kernels while they are compiled."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.resources import files


@dataclass
class KernelProgress:
    """What has become ready so far."""

    # names of the kernels that are to come; empty if that is not known
    expected: frozenset[str] = frozenset()
    terminal: bool = False  # to write on one line of; else a log gets one line in all
    compiled: int = 0
    loaded: int = 0
    ready: set[str] = field(default_factory=set)

    def __call__(self, kernel: str, loaded: bool) -> None:
        """Count a kernel, and say so if it was compiled."""
        self.ready.add(kernel)
        self.loaded += loaded
        self.compiled += not loaded
        if loaded:
            return
        if self.terminal:
            sys.stderr.write(f"\r\033[K{self}")
            sys.stderr.flush()
        elif self.compiled == 1:
            sys.stderr.write("compiling kernels; later runs find them in the cache\n")

    def clear(self) -> None:
        """Empty the line for something else."""
        if self.terminal and self.compiled:
            sys.stderr.write("\r\033[K")
            sys.stderr.flush()

    def __str__(self) -> str:
        """Say how far it is, without a total that is not known."""
        if self.expected >= self.ready:
            return f"compiling kernels: {len(self.ready)} of {len(self.expected)}"
        return f"compiling kernels: {len(self.ready)}"


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
    text = files("pushplan.cli").joinpath("kernel_names.json").read_text(encoding="utf-8")
    users = {kernel: set(users.split()) for users, of in json.loads(text).items() for kernel in of}
    if not set(names) <= set().union(*users.values()):
        return frozenset()
    return frozenset(kernel for kernel, by in users.items() if not by.isdisjoint(names))
