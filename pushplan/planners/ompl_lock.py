"""OMPL's random seed and log level are global: whoever uses OMPL holds this lock."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator

from ompl import util

_LOCK = threading.Lock()


@contextlib.contextmanager
def seeded_ompl(seed: int) -> Iterator[None]:
    """Seed every generator that OMPL makes inside the block, and keep it from printing.

    Args:
        seed: positive.
    """
    with _LOCK:
        util.setLogLevel(util.LogLevel.LOG_NONE)
        util.RNG.setSeed(seed)
        yield
