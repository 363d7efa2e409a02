"""A step of any interaction model: compiled code calls back the model's own ``sweep``."""

from __future__ import annotations

import ctypes
from typing import Any, NamedTuple

import numba.experimental.function_type  # noqa: F401  (lets kernels take functions as arguments)
import numpy as np
from numba import types

from pushplan.compiled import copy_into, kernel, owned
from pushplan.interaction.advance import CompiledInteraction, advance_objects
from pushplan.interaction.interaction_model import InteractionModel
from pushplan.world import World
from pushplan.world.checks import FloatArray, IntArray


class SweepCall(types.WrapperAddressProtocol):
    """A call of a model's ``sweep`` over one step, that compiled code can make.

    An error of the model counts as a jam; it is kept, and `raise_error` raises it later.

    Args:
        model: the interaction model.
        world: gives the robot and the objects; their poses come with each call.
    """

    def __init__(self, model: InteractionModel, world: World) -> None:
        self._model = model
        self._world = world
        count = len(world.movables)
        self.path = np.zeros((2, 3))
        self.poses = np.zeros((count, 3))
        self.moved = np.zeros(count)
        self._error: Exception | None = None
        self._entry = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(self._sweep)

    def __wrapper_address__(self) -> int:
        return int(ctypes.cast(self._entry, ctypes.c_void_p).value or 0)

    def signature(self) -> Any:
        """One number in, 1 out where the robot gets there, else 0."""
        return types.int64(types.int64)

    def raise_error(self) -> None:
        """Raise what the model has raised since the last call."""
        error = self._error
        self._error = None
        if error is not None:
            raise error

    def _sweep(self, _: int) -> int:
        try:
            here = self._world.moved(
                robot_pose=self.path[0].copy(), robot_twist=(0, 0, 0), movable_poses=self.poses
            )
            swept = self._model.sweep(here, self.path.copy())
        except Exception as error:
            self._error = self._error or error
            return 0
        if swept.jammed_at >= 0:
            return 0
        self.poses[:] = swept.object_poses[-1]
        self.moved[:] = swept.lengths
        return 1


class SweptContacts(NamedTuple):
    """Any interaction model in the form of a compiled one."""

    inverse_masses: FloatArray
    radii: FloatArray
    tests: IntArray
    call: Any  # a `SweepCall`
    path: FloatArray  # (2, 3) its arguments and results, as in `SweepCall`
    poses: FloatArray
    moved: FloatArray


@kernel
def _step(
    model: SweptContacts,
    robot_from: FloatArray,
    robot_to: FloatArray,
    poses: FloatArray,
    moved: FloatArray,
) -> bool:
    """Drive the robot a step by a call of ``sweep``."""
    copy_into(model.path[0], robot_from)
    copy_into(model.path[1], robot_to)
    copy_into(model.poses, poses)
    model.tests[0] += 1
    if model.call(0) == 0:
        return False
    copy_into(poses, model.poses)
    for k in range(poses.shape[0]):
        moved[k] += model.moved[k]
    return True


advance_objects.add(SweptContacts, _step)


def compile_interaction(
    model: InteractionModel,  # the interaction model
    world: World,
) -> Any:
    """An interaction model as `advance_objects` takes it.

    A model that has no compiled form is asked for every step by its ``sweep``: a thousand times
    slower than a compiled one, and objects are at rest at the beginning of each step.
    """
    if isinstance(model, CompiledInteraction):
        return model.compiled(world)
    call = SweepCall(model, world)
    objects = world.movables
    tests = np.zeros(1, np.int64)
    return SweptContacts(
        1.0 / objects.masses, owned(objects.radii), tests, call, call.path, call.poses, call.moved
    )
