"""Predictive control along a path."""

from typing import Annotated

import numpy
from numpy.typing import NDArray

import pushplan._core.motion


class CommandLimits:
    def __init__(self, constant: bool, min_speed: float, max_speed: float, max_turn_rate: float, max_acceleration: float, max_turn_acceleration: float, turning_radius: float) -> None: ...

class SolverSettings:
    def __init__(self, tolerance: float, iterations: int, rounds: int, first_rounds: int) -> None: ...

class QuadraticProgram:
    """A quadratic program over commands, and its solver."""

    def __init__(self, variables: int, moves: int, blocks: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], settings: SolverSettings) -> None: ...

    def solve(self, hessian: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], gradient: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], low: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], high: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')]) -> bool:
        """
        Minimise from x, in place; False if OSQP does not call its answer solved.
        """

class ReferencePath:
    def __init__(self, poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], lengths: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], speeds: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

    def locate(self, x: float, y: float, low: float, high: float) -> tuple: ...

    def errors(self, x: float, y: float, theta: float, index: int, fraction: float) -> tuple: ...

class Tuning:
    def __init__(self, size: float, max_speed: float, max_turn_rate: float, max_acceleration: float, stops: bool, optimise_speed: bool, heading_weight: float, turn_weight: float, smoothness: float, terminal: float, speed_weight: float) -> None: ...

class TrackingAssembly:
    """Puts up tracking problems."""

    def __init__(self, variables: int) -> None: ...

    def assemble(self, track: ReferencePath, tuning: Tuning, pose: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], along: float, before: Annotated[NDArray[numpy.float64], dict(shape=(2), order='C', device='cpu', writable=False)], steps: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], nominal: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], hessian: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], gradient: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')]) -> None: ...

class Tracker:
    """A predictive tracker of one robot."""

    def __init__(self, limits: CommandLimits, tuning: Tuning, solver: SolverSettings, steps: int, span: float, delay: float, v: float, w: float) -> None: ...

    def begin_track(self) -> None: ...

    def follow(self, track: ReferencePath, pose: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], time: float, held: float) -> tuple[float, float]:
        """The command for where the robot is; a stop where that is not finite."""

    @property
    def failures(self) -> int: ...

def clear_steps(step: float, turn: float, first: int, most: int, shape: pushplan._core.motion.Footprint, walls: pushplan._core.motion.ConvexObstacles, at: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)]) -> int: ...
