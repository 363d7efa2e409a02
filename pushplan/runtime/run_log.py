"""What keeps a record of a `Runner`."""

from __future__ import annotations

import warnings
from typing import Any, Protocol

from pushplan.runtime.command import Command
from pushplan.world import Plan, World
from pushplan.world.errors import describe


class RunLog(Protocol):
    """Keeps what a `Runner` sees and does; a log that raises is not called again."""

    def world(self, world: World) -> None:
        """A snapshot has come in."""

    def plan(self, plan: Plan, time: float) -> None:
        """A plan was taken up, at a time [s]."""

    def command(self, command: Command) -> None:
        """A command was given."""


class QuietLog:
    """Passes on what is to be kept; a log that fails is not called again.

    Args:
        log: where to; None keeps nothing.
    """

    def __init__(self, log: RunLog | None) -> None:
        self._log = log

    def note(self, what: str, *values: Any) -> None:
        """Call a method of the log by its name."""
        if self._log is None:
            return
        try:
            getattr(self._log, what)(*values)
        except Exception as error:
            self._log = None
            warnings.warn(f"logging has ended: {describe(error)}", RuntimeWarning, stacklevel=3)
