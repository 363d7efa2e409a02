"""The step of `QuasiStatic` for `advance_objects`."""

from __future__ import annotations

from typing import NamedTuple

from pushplan.compiled import kernel
from pushplan.interaction.advance import advance_objects
from pushplan.interaction.kernels import Bodies, Scratch, Settings, advance
from pushplan.world.checks import FloatArray, IntArray


class QuasiStaticContacts(NamedTuple):
    """`QuasiStatic` in compiled form, with memory for one thread."""

    inverse_masses: FloatArray  # (K,)
    radii: FloatArray  # (K,) circumscribed radii [m]
    tests: IntArray  # (1,) pairs of outlines that were tested so far
    bodies: Bodies
    settings: Settings
    scratch: Scratch


@kernel
def _step(
    model: QuasiStaticContacts,
    robot_from: FloatArray,
    robot_to: FloatArray,
    poses: FloatArray,
    moved: FloatArray,
) -> bool:
    """Drive the robot a step by the contact kernels."""
    return bool(
        advance(robot_from, robot_to, poses, moved, model.bodies, model.settings, model.scratch)
    )


advance_objects.add(QuasiStaticContacts, _step)
