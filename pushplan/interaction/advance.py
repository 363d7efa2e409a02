"""`advance_objects`: one step of an interaction model in compiled code, selected by its type.

A compiled interaction model is a named tuple with the fields ``inverse_masses`` (K,), ``radii``
(K,) and ``tests`` (1,), a count of its work that stands for time without a clock, and a step that
`advance_objects.add` makes known, a kernel that makes no arrays. `QuasiStatic.compiled` makes one;
`compile_interaction` makes one of any other model.
"""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

from pushplan.compiled import KernelByType
from pushplan.interaction.interaction_model import InteractionModel
from pushplan.world import World
from pushplan.world.checks import FloatArray


@runtime_checkable
class CompiledInteraction(InteractionModel, Protocol):
    """An interaction model that also comes in compiled form."""

    def compiled(self, world: World) -> Any:
        """The model for the shapes of this world as a named tuple, with memory for one thread."""


@KernelByType
def advance_objects(
    model: Any, robot_from: FloatArray, robot_to: FloatArray, poses: FloatArray, moved: FloatArray
) -> bool:
    """Drive the robot from one pose to a near one; by the type of the compiled model.

    Args:
        model: the compiled interaction model.
        robot_from: (3,) where it is.
        robot_to: (3,) where it goes, along a straight line.
        poses: (K, 3) poses of the objects, changed in place.
        moved: (K,) path lengths of the objects [m], added to in place.

    Returns:
        True where the robot gets there, False where it jams.
    """
    raise NotImplementedError
