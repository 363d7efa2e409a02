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
    compiled: int = 0
    loaded: int = 0
    ready: set[str] = field(default_factory=set)

    def __call__(self, kernel: str, loaded: bool) -> None:
        """Count a kernel."""
        self.ready.add(kernel)
        self.loaded += loaded
        self.compiled += not loaded

    def __str__(self) -> str:
        """Say how far it is, without a total that is not known."""
        if self.expected >= self.ready:
            return f"compiling {len(self.ready)} of {len(self.expected)}"
        return f"compiling {len(self.ready)}"


@contextmanager
def kernel_progress(*names: str) -> Iterator[KernelProgress]:
    """Count kernels: on one line of a terminal, or once in words in a log.

    Args:
        names: policies that are to be warmed up and nothing else.
    """
    from pushplan.compiled import watching  # Numba is loaded only where kernels are

    text = files("pushplan.cli").joinpath("kernel_names.json").read_text(encoding="utf-8")
    known = json.loads(text)
    expected = [set(known.get(name, ())) for name in names]
    whole = frozenset(set().union(*expected)) if all(expected) else frozenset()
    progress = KernelProgress(whole - _READY)
    terminal = sys.stderr.isatty()

    def watch(kernel: str, loaded: bool) -> None:
        progress(kernel, loaded)
        _READY.add(kernel)
        if terminal and not loaded:
            sys.stderr.write(f"\r\033[K{progress}")
            sys.stderr.flush()
        elif not loaded and progress.compiled == 1:
            sys.stderr.write("compiling kernels; later runs find them in the cache\n")

    try:
        with watching(watch):
            yield progress
    finally:
        if terminal and progress.compiled:
            sys.stderr.write("\r\033[K")


_READY: set[str] = set()  # kernels that have become ready in this process while somebody counted
