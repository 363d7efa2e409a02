"""Independent random streams from one seed, the same in every process."""

from __future__ import annotations

import zlib

import numpy as np

from pushplan.world.checks import integer


def stream(seed: int, name: str) -> np.random.Generator:
    """A generator that depends on the seed and on what it is for, and on nothing else.

    Layout and policy draw from different streams, so that a layout never depends on who plans.

    Args:
        seed: not negative.
        name: what the numbers are for, such as ``"layout"``.
    """
    seed = integer("seed", seed, low=0)
    return np.random.default_rng(np.random.SeedSequence([seed, zlib.crc32(name.encode())]))
