"""The one angle wrap, for Python and for kernels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.extending import register_jitable

_TURN = 2.0 * np.pi


@register_jitable
def wrap_angle(angle: Any) -> Any:
    """The equivalent angle in [-π, π] [rad]; a number, or an array of any shape outside kernels."""
    return angle - _TURN * np.round(angle / _TURN)
