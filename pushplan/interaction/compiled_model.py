"""Interaction models in compiled form: the core drives them one small step of the robot at a time.

`QuasiStatic` and `IceInteraction` have a form of their own in the core; a C function becomes one by
`called_model`, and any other model by a call of its ``sweep`` for each step.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import numpy as np

from pushplan.core import interaction as core
from pushplan.errors import InvalidInputError, short
from pushplan.interaction.interaction_model import InteractionModel
from pushplan.world import World
from pushplan.world.checks import FloatArray

CompiledModel = core.QuasiStatic | core.IceInteraction | core.CalledInteraction
"""A model for the shapes of one world, with memory for one thread."""

_NUMBERS = ctypes.POINTER(ctypes.c_double)
_STEP = ctypes.CFUNCTYPE(
    ctypes.c_bool, ctypes.c_void_p, ctypes.c_int64, _NUMBERS, _NUMBERS, _NUMBERS, _NUMBERS
)


@runtime_checkable
class CompiledInteraction(InteractionModel, Protocol):
    """An interaction model that also comes in compiled form."""

    def compiled(self, world: World) -> CompiledModel:
        """The model for the shapes of this world."""


def called_model(function: Any, world: World) -> core.CalledInteraction:
    """A model behind a C function, for the method ``compiled`` of an interaction model.

    The function drives the robot from one pose to a near one along a straight line, changes the
    poses of the objects and adds to the lengths of their paths [m]. It returns false where the
    robot jams; then it has changed nothing. Poses are x, y [m], theta [rad]. It is called without
    Python's lock::

        bool step(void *user_data, int64_t count, const double robot_from[3],
                  const double robot_to[3], double poses[][3], double lengths[])

    Args:
        function: a `scipy.LowLevelCallable`, whose user data it is given; or, with none, a
            function pointer of `ctypes` or a `numba.cfunc`.
        world: gives the objects.

    Raises:
        InvalidInputError: if it is something else.
    """
    entry, user_data = _addresses(function)
    objects = world.movables
    return core.CalledInteraction(
        entry, user_data, objects.radii, 1.0 / objects.masses, owner=function
    )


def compile_interaction(model: InteractionModel, world: World) -> CompiledModel:
    """An interaction model in compiled form.

    A model that has none is asked for every step by its ``sweep``: a thousand times slower than a
    compiled one, and objects are at rest at the beginning of each step.
    """
    if isinstance(model, CompiledInteraction):
        return model.compiled(world)
    return SweptModel(model, world)


class SweptModel(core.CalledInteraction):
    """Any interaction model, whose ``sweep`` is called over each step.

    An error of the model counts as a jam; it is kept, and `raise_error` raises it later.

    Args:
        model: the interaction model.
        world: gives the robot and the objects; their poses come with each call.
    """

    def __init__(self, model: InteractionModel, world: World) -> None:
        self._errors: list[Exception] = []
        entry = _STEP(_sweep_call(model, world, self._errors))
        address = ctypes.cast(entry, ctypes.c_void_p).value or 0
        objects = world.movables
        super().__init__(address, 0, objects.radii, 1.0 / objects.masses, owner=entry)

    def raise_error(self) -> None:
        """Raise what the model has raised first since the last call."""
        errors = self._errors.copy()
        self._errors.clear()
        if errors:
            raise errors[0]


def _sweep_call(
    model: InteractionModel, world: World, errors: list[Exception]
) -> Callable[..., bool]:
    def step(_: int | None, count: int, start: Any, end: Any, objects: Any, lengths: Any) -> bool:
        try:
            poses = _array(objects, (count, 3))
            path = np.stack([_array(start, (3,)), _array(end, (3,))])
            here = world.moved(robot_pose=path[0], robot_twist=(0, 0, 0), movable_poses=poses)
            swept = model.sweep(here, path)
            if swept.jammed_at < 0:
                poses[:] = swept.object_poses[-1]
                _array(lengths, (count,))[:] += swept.lengths
        except Exception as error:
            errors.append(error)
            return False
        return swept.jammed_at < 0

    return step


def _array(numbers: Any, shape: tuple[int, ...]) -> FloatArray:
    """Numbers in the core's memory."""
    if 0 in shape:  # there need be no memory for none
        return np.empty(shape)
    return np.ctypeslib.as_array(numbers, shape)


def _addresses(function: Any) -> tuple[int, int]:
    """Addresses of a C function, and of its user data or 0."""
    from scipy import LowLevelCallable

    if isinstance(function, LowLevelCallable):
        capsule = ctypes.py_object(tuple.__getitem__(function, 0))
        name = _capsule_reader("Name", ctypes.c_char_p)(capsule)
        entry = _capsule_reader("Pointer", ctypes.c_void_p, ctypes.c_char_p)(capsule, name)
        return entry, _capsule_reader("Context", ctypes.c_void_p)(capsule) or 0
    pointer = getattr(function, "ctypes", function)  # of a numba.cfunc
    if not isinstance(pointer, ctypes._CFuncPtr):  # type: ignore[attr-defined]
        raise InvalidInputError(
            "the function of an interaction model must be a scipy.LowLevelCallable, a function "
            f"pointer of ctypes or a numba.cfunc, got {short(function)}"
        )
    return ctypes.cast(pointer, ctypes.c_void_p).value or 0, 0


def _capsule_reader(what: str, result: Any, *more: Any) -> Callable[..., Any]:
    prototype = ctypes.PYFUNCTYPE(result, ctypes.py_object, *more)
    return prototype((f"PyCapsule_Get{what}", ctypes.pythonapi))
