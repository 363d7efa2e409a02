"""OMPL's random seed and log level are global: whoever uses OMPL holds this lock."""

from __future__ import annotations

import atexit
import contextlib
import functools
import threading
from collections.abc import Callable, Iterator
from typing import Any

from ompl import base, util

_LOCK = threading.Lock()
_POLL_S = 0.002


@functools.cache
def own_state(kind: type[base.StateSpace], *arguments: int) -> Any:
    """The one state of a kind of space to hand values to OMPL with, which copies it.

    Its Python binding cannot free states (2.0.1), so one for each call would be lost.
    """
    return kind(*arguments).allocState()


atexit.register(own_state.cache_clear)  # else the binding complains about what is left


@contextlib.contextmanager
def seeded_ompl(seed: int, stopped: Callable[[], bool]) -> Iterator[bool]:
    """Seed every generator that OMPL makes inside the block, and keep it from printing.

    Args:
        seed: positive.
        stopped: asked while another thread uses OMPL, so that waiting keeps to a stop rule.

    Yields:
        Whether OMPL is ours; False if ``stopped()`` came first.
    """
    ours = _LOCK.acquire(timeout=_POLL_S)
    while not ours and not stopped():
        ours = _LOCK.acquire(timeout=_POLL_S)
    try:
        if ours:
            util.setLogLevel(util.LogLevel.LOG_NONE)
            util.RNG.setSeed(seed)
        yield ours
    finally:
        if ours:
            _LOCK.release()
