"""Parts of simulators."""

from collections.abc import Sequence
from typing import Annotated

import numpy
from numpy.typing import NDArray

import pushplan._core.geometry


def slow_down(velocities: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], keeps: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], drag: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], h: float) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')]: ...

def flow_shapes(vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')]:
    """
    (K, 4) mean width [m], area [m^2], two integrals of rotation [m^4, m^5] of convex bodies.
    """

class Reach:
    """Objects that a step of the robot can affect."""

    def __init__(self, parts: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], part_offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], radii: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

def contact_points_size() -> int: ...

def contact_callbacks(of_robot: bool, with_fixed: bool) -> list[int]: ...

class PlanarSimulator:
    """A robot among objects in a space of Chipmunk."""

    def __init__(self, functions: Sequence[int], space: int, bodies: Sequence[int], shapes: Sequence[Sequence[int]], owner: object, reach: Reach, obstacles: pushplan._core.geometry.Obstacles, keeps: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], inertia: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], drag: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], states: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], travel: float, tolerance: float, rest: float, decay: float, samples: int, holds: bool) -> None: ...

    def step(self, linear: float, angular: float, lateral: float, duration: float) -> tuple[Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C')], bool, bool]:
        """
        Poses (T, 3) of the robot and (T, K, 3) of the objects in a step; whether the robot was
        held, and touched something static.
        """

    def sweep(self, to: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], motion: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], length: float, duration: float) -> bool:
        """Drive straight to a pose; False if the robot was held."""

    def clear_for(self, linear: float, angular: float, lateral: float, limit: float) -> float:
        """Time [s] for which the robot certainly touches nothing."""

    @property
    def loaded(self) -> int:
        """Number of objects that the last step needed the engine for."""

    @property
    def loads_all(self) -> bool:
        """True if objects that cannot move are simulated as well."""

    @loads_all.setter
    def loads_all(self, arg: bool, /) -> None: ...

    @property
    def contacts(self) -> int: ...
