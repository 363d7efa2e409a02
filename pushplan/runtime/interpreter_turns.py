"""Settings of the interpreter that keep commands prompt, shared by the runners of a process."""

from __future__ import annotations

import gc
import sys
import threading

_SWITCH = 5e-4  # time for which another thread may keep the interpreter to itself [s]
_lock = threading.Lock()
_users = 0
_before = 0.0


def take_short_turns() -> None:
    """Let threads take shorter turns, and garbage collection pass over what is in memory now.

    Each call needs one of `take_usual_turns` after it; the last of these restores what was before.
    """
    global _users, _before
    with _lock:
        _users += 1
        if _users == 1:
            _before = sys.getswitchinterval()
            sys.setswitchinterval(min(_SWITCH, _before))
            gc.collect()
            gc.freeze()  # else a collection amid driving goes through all modules


def take_usual_turns() -> None:
    """Take back one call of `take_short_turns`."""
    global _users
    with _lock:
        _users -= 1
        if not _users:
            sys.setswitchinterval(_before)
            gc.unfreeze()
