"""Parts of simulators."""

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

    def within(self, robot: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], reach: float, poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], speeds: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C')]: ...

    def clear_time(self, robot: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], course: float, linear: float, angular: float, holds: bool, limit: float, margin: float, poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], obstacles: pushplan._core.geometry.Obstacles) -> float:
        """
        Time [s] for which a robot that drives an arc certainly touches nothing.
        """

    def struck(self, loaded: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C', device='cpu', writable=False)], paths: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], before: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C')]: ...

def arc_pose(start: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], course: float, linear: float, angular: float, holds: bool, time: float, out: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu')]) -> None: ...
