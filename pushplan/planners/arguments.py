"""What every planner checks before it plans."""

from __future__ import annotations

import numpy as np

from pushplan.world import Stop, World
from pushplan.world.checks import expect


def check_call(world: object, stop: object, rng: object) -> None:
    """Check the types of what a planner is called with.

    Raises:
        InvalidInputError: naming the argument and the type that it must have.
    """
    expect("world", world, World)
    if stop is not None:
        expect("stop", stop, Stop)  # type: ignore[type-abstract]
    if rng is not None:
        expect("rng", rng, np.random.Generator)
