"""OMPL's random seed and log level are global: whoever uses OMPL holds this lock."""

from __future__ import annotations

import atexit
import contextlib
import functools
import threading
from collections.abc import Callable, Iterator
from typing import Any

from ompl import base, util

from pushplan.world.checks import FloatArray

_LOCK = threading.Lock()
_POLL_S = 0.002


@functools.cache
def own_state(space: Callable[[], base.StateSpace]) -> Any:
    """The one state of a kind of space to hand values to OMPL with, which copies it.

    Its Python binding cannot free states (2.0.1), so one for each call would be lost.
    """
    return space().allocState()


atexit.register(own_state.cache_clear)  # else the binding complains about what is left


def plane_bounds(bounds: FloatArray) -> base.RealVectorBounds:
    """Bounds (4,) of a plane as OMPL has them."""
    made = base.RealVectorBounds(2)
    for axis in range(2):
        made.setLow(axis, float(bounds[axis]))
        made.setHigh(axis, float(bounds[axis + 2]))
    return made


@contextlib.contextmanager
def ompl_alone(stopped: Callable[[], bool]) -> Iterator[bool]:
    """Keep other threads from seeding OMPL inside the block, and OMPL from printing.

    Args:
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
        yield ours
    finally:
        if ours:
            _LOCK.release()
