"""Work in pieces, so that a clock can be looked at however long a unit takes."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

_PIECE_S = 0.001  # time between two looks [s]


class Stopped(Exception):
    """The stop rule fired within work that gives nothing before it is done."""


def never() -> bool:
    """No stop rule."""
    return False


def go_on(stopped: Callable[[], bool]) -> None:
    """Ask a stop rule within such work.

    Raises:
        Stopped: if it fires.
    """
    if stopped():
        raise Stopped


class Pace:
    """Cuts work into pieces of about a millisecond."""

    def __init__(self) -> None:
        self._few = 1.0

    def pieces(self, total: int, stopped: Callable[[], bool]) -> Iterator[tuple[int, int]]:
        """Yield (first, last + 1) of consecutive pieces of ``total`` units, until stopped.

        Args:
            total: units to do.
            stopped: asked before each piece. As the cuts follow the clock, nothing but the clock
                may change its answer from piece to piece.
        """
        done = 0
        while done < total and not stopped():
            upto = min(total, done + max(1, int(self._few)))
            began = time.perf_counter()
            yield done, upto
            took = max(time.perf_counter() - began, 1e-6)
            self._few = min(2.0 * self._few, (upto - done) * _PIECE_S / took)
            done = upto
