"""The compiled core: inner loops in C++ (`core/` in the repository), room for room as here."""

from __future__ import annotations

from pushplan.errors import PushplanError

try:
    from pushplan._core import gtsp
except ImportError as error:
    raise PushplanError(
        f"the compiled core of pushplan is not built for this tree ({error}): "
        f"run pip install -e . in it"
    ) from error

__all__ = ["gtsp"]
