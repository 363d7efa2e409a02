"""`advance_objects`: one step of an interaction model in compiled code, selected by its type.

A compiled interaction model is a named tuple with the fields ``inverse_masses`` (K,), ``radii``
(K,) and ``tests`` (1,), a count of its work that stands for time without a clock, and a step that
`register_advance` makes known. `QuasiStatic.compiled` makes one; `compile_interaction` makes one
of any other model.
"""

from __future__ import annotations

from typing import Any, Protocol, cast, runtime_checkable

from numba import types
from numba.extending import overload

from pushplan.compiled import add_type_kernels
from pushplan.interaction.model import InteractionModel
from pushplan.world import World
from pushplan.world.checks import FloatArray


@runtime_checkable
class CompiledInteraction(InteractionModel, Protocol):
    """An interaction model that also comes in compiled form."""

    def compiled(self, world: World) -> Any:
        """The model for the shapes of this world as a named tuple, with memory for one thread."""
        ...


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
        Whether the robot gets there; False where it jams.
    """
    raise NotImplementedError(f"no step is known for a {type(model).__name__}")


def register_advance(kind: type, step: Any) -> None:
    """Teach `advance_objects` a type of model.

    Args:
        kind: a named tuple class of arrays, numbers and such tuples.
        step: compiled function with the arguments of `advance_objects`; it makes no arrays.
    """
    add_type_kernels(kind, step)

    @overload(advance_objects, jit_options=cast(Any, {"_nrt": False}))
    def _advance(model, robot_from, robot_to, poses, moved):  # type: ignore[no-untyped-def]
        if isinstance(model, types.NamedTuple) and model.instance_class is kind:
            return lambda model, robot_from, robot_to, poses, moved: step(
                model, robot_from, robot_to, poses, moved
            )
        return None
