"""Handling of Ctrl-C during imports and callbacks, where Python may lose it."""

from __future__ import annotations

import signal
import sys
import threading
from types import FrameType

_AGAIN_S = 0.01


class Interrupts:
    """Raises `KeyboardInterrupt` for Ctrl-C, but waits for the end of an import.

    During an import Python may drop the exception, and compiled modules may abort the process.
    A second Ctrl-C does not wait. If Python drops the exception elsewhere, it is raised again.
    """

    def __init__(self) -> None:
        self._timer: threading.Timer | None = None
        self._is_due = False  # the signal that comes is the timer's

    def __enter__(self) -> None:
        """Take Ctrl-C over from Python; a job that a shell runs in the background ignores it."""
        usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler
        if usual and hasattr(signal, "pthread_kill"):  # not on Windows
            signal.signal(signal.SIGINT, self._interrupt)
            sys.unraisablehook = self._dropped

    def __exit__(self, *_: object) -> None:
        """Let a later Ctrl-C end the process silently: the command has ended."""
        if signal.getsignal(signal.SIGINT) == self._interrupt:
            signal.signal(signal.SIGINT, signal.SIG_DFL)

    def _interrupt(self, _: int, frame: FrameType | None) -> None:
        while frame is not None and not frame.f_code.co_filename.startswith("<frozen importlib"):
            frame = frame.f_back
        waits = self._timer is None or self._is_due
        self._is_due = False
        if self._timer is not None:
            self._timer.cancel()
        if frame is None or not waits:
            raise KeyboardInterrupt
        self._later()

    def _dropped(self, lost: sys.UnraisableHookArgs) -> None:
        if lost.exc_type is KeyboardInterrupt:  # in a callback or a finalizer
            self._later()
        else:
            sys.__unraisablehook__(lost)

    def _later(self) -> None:
        self._timer = threading.Timer(_AGAIN_S, self._ask_again)
        self._timer.daemon = True
        self._timer.start()

    def _ask_again(self) -> None:
        self._is_due = True
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
