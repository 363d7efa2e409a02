"""Models of what the robot pushes."""

from typing import Annotated

import numpy
from numpy.typing import NDArray


class Bodies:
    """A robot, objects and walls."""

    def __init__(self, robot_vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], robot_offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], wall_parts: int, robot_radius: float, vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], part_vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], part_offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], first_parts: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], radii: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], inverse_masses: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], inverse_gyration: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], wall_vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], wall_offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], wall_boxes: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> None: ...

class QuasiStatic:
    """Quasi-static pushing with memory for one thread."""

    def __init__(self, bodies: Bodies, max_step: float, tolerance: float, jam_depth: float, iterations: int, friction: float, static_friction: float) -> None: ...

    def advance(self, robot_from: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], robot_to: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu')], lengths: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')]) -> bool: ...

    def sweep(self, path: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu')], out: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu')]) -> int: ...

    @property
    def tests(self) -> int: ...

class IceBodies:
    """A hull among floes."""

    def __init__(self, hull_vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], hull_offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], hull_radius: float, vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], first_parts: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], radii: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], masses: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], inverse_gyration: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

class IceContacts:
    """Floes that push floes, with memory for one thread."""

    def __init__(self, bodies: IceBodies, step: float, iterations: int, hull_friction: float, friction: float, still: float) -> None: ...

    def sweep(self, path: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu')], out: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu')]) -> float: ...

class IceInteraction:
    """Floes as a model that is driven step by step."""

    def __init__(self, bodies: IceBodies, step: float, iterations: int, hull_friction: float, friction: float, still: float) -> None: ...

    def advance(self, robot_from: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], robot_to: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu')], lengths: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')]) -> bool: ...

    @property
    def tests(self) -> int: ...

class CalledInteraction:
    """Any model behind a C function."""

    def __init__(self, function: int, context: int, radii: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], inverse_masses: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], owner: object | None = None) -> None:
        """
        Addresses of a `CalledInteraction::Advance` and of what it is given as its context; `owner` is kept alive for them.
        """

    def advance(self, robot_from: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], robot_to: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu')], lengths: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')]) -> bool: ...

    @property
    def tests(self) -> int: ...

def cover_objects(poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], frame: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], cell: float, out: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu')]) -> None: ...

def cover_sweep(path: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], frame: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], cell: float, out: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu')]) -> None: ...

def step_works(swept: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu')], masses: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], works: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')]) -> None: ...

def sweep_near(path: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu')], bodies: IceBodies, step: float, iterations: int, hull_friction: float, friction: float, still: float, margin: float, out: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu')], works: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')]) -> None: ...
