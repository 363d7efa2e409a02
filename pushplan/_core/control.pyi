"""Predictive control along a path."""

from typing import Annotated

import numpy
from numpy.typing import NDArray

import pushplan._core.motion


class CommandLimits:
    def __init__(self, constant: bool, min_speed: float, max_speed: float, max_turn_rate: float, max_acceleration: float, max_turn_acceleration: float, turning_radius: float) -> None: ...

class Horizon:
    """Commands for the next steps, in arrays of Python."""

    def __init__(self, limits: CommandLimits, units: Annotated[NDArray[numpy.float64], dict(shape=(2), order='C', device='cpu', writable=False)], columns: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], moves: int, blocks: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], hessian: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], gradient: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], low: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], high: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], steps: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], solved: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], shifted: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu')], solution: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], nominal: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], last: Annotated[NDArray[numpy.float64], dict(shape=(2), order='C', device='cpu')], sent: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], counts: Annotated[NDArray[numpy.int64], dict(shape=(4), order='C', device='cpu')]) -> None: ...

    def send(self, v: float, w: float, held: float, ramps: bool) -> tuple[float, float]: ...

    def remember(self, time: float, over: float) -> None: ...

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

    def __init__(self, horizon: Horizon, tuning: Tuning, span: float, delay: float) -> None: ...

    def begin_track(self) -> None: ...

    def begin_step(self, track: ReferencePath, pose: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], time: float, held: float) -> tuple[float, float] | None:
        """
        Put up the program for where the robot is; the command where it is known without one.
        """

    def assemble_step(self, track: ReferencePath) -> None: ...

    def finish_step(self, track: ReferencePath, pose: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], time: float, held: float, solved: bool) -> tuple[float, float]:
        """The command: of the solution, or what is nearest to it without one."""

def clear_steps(step: float, turn: float, first: int, most: int, shape: pushplan._core.motion.Footprint, walls: pushplan._core.motion.ConvexObstacles, at: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)]) -> int: ...
