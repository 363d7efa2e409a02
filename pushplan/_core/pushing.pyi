"""Predictive pushing of one box along a path."""

from collections.abc import Sequence
from typing import Annotated

import numpy
from numpy.typing import NDArray

import pushplan._core.control
import pushplan._core.geometry


class BoxContact:
    """Bumper and pushed face."""

    def __init__(self, front: float, half: float, curvature: float, depth: float, low: float, high: float, spread: float, friction: float) -> None: ...

    @property
    def front(self) -> float:
        """X of the bumper in its middle, from the axle [m]."""

    @property
    def half(self) -> float:
        """Half the bumper's width [m]."""

    @property
    def curvature(self) -> float:
        """Curvature of the bumper's front [1/m]."""

    @property
    def depth(self) -> float:
        """From the pushed face to the box's centre [m]."""

    @property
    def low(self) -> float:
        """Right end of the face from the centre [m], negative."""

    @property
    def high(self) -> float:
        """Left end of the face [m]."""

    @property
    def spread(self) -> float:
        """Greatest torque over force of the ground [m]."""

    @property
    def friction(self) -> float:
        """Coefficient between bumper and box."""

    def line(self, offset: float) -> tuple[float, float]: ...

    def standoff(self, offset: float, angle: float) -> tuple[float, float]: ...

    def velocity(self, offset: float, angle: float, c: float, s: float, v: float, w: float, dt: float, out: Annotated[NDArray[numpy.float64], dict(shape=(6), order='C', device='cpu')]) -> float: ...

    def linearise(self, offset: float, angle: float, v: float, w: float, dt: float, widths: Annotated[NDArray[numpy.float64], dict(shape=(4), order='C', device='cpu', writable=False)], slopes: Annotated[NDArray[numpy.float64], dict(shape=(2, 4), order='C', device='cpu')]) -> None: ...

    def roll_out(self, start: Annotated[NDArray[numpy.float64], dict(shape=(6), order='C', device='cpu', writable=False)], twists: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], steps: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], states: Annotated[NDArray[numpy.float64], dict(shape=(None, 6), order='C', device='cpu')], motions: Annotated[NDArray[numpy.float64], dict(shape=(None, 6), order='C', device='cpu')]) -> None: ...

    def observe(self, normal: float, robot: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], box: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    def box_pose(self, state: Annotated[NDArray[numpy.float64], dict(shape=(6), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

class Clearance:
    """Distances of robot and box from static things."""

    def __init__(self, vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], radii: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], least: float, slack: float) -> None: ...

    def gaps(self, contact: BoxContact, normal: float, state: Annotated[NDArray[numpy.float64], dict(shape=(6), order='C', device='cpu', writable=False)], obstacles: pushplan._core.geometry.Obstacles) -> tuple[float, float]: ...

class PushWeights:
    """Costs and scales of the cost."""

    def __init__(self, length: float, max_speed: float, half: float, curvature: float, heading: float, offset: float, rim: float, safe: float, angle: float, grip: float, turn: float, speed: float, smoothness: float, terminal: float) -> None: ...

class PushingProblem:
    """The pushing problem of one call."""

    def __init__(self, contact: BoxContact, track: pushplan._core.control.ReferencePath, weights: PushWeights, start: Annotated[NDArray[numpy.float64], dict(shape=(6), order='C', device='cpu', writable=False)], along: float, last: Annotated[NDArray[numpy.float64], dict(shape=(2), order='C', device='cpu', writable=False)], units: Annotated[NDArray[numpy.float64], dict(shape=(2), order='C', device='cpu', writable=False)], steps: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], groups: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

class PushAssembly:
    """Puts up pushing problems of one size."""

    def __init__(self, steps: int, commands: int) -> None: ...

    def assemble(self, problem: PushingProblem, nominal: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], hessian: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], gradient: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')]) -> float: ...

class Face:
    """A side of a box on the bumper."""

    def __init__(self, score: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], contact: BoxContact, normal: float, curvature: float) -> None: ...

class PushTracker:
    """Pushes boxes along paths."""

    def __init__(self, limits: pushplan._core.control.CommandLimits, weights: PushWeights, solver: pushplan._core.control.SolverSettings, groups: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], reach: float, delay: float, gain: float, v: float, w: float) -> None: ...

    def begin(self, faces: Sequence[Face], clearance: Clearance, direction: float) -> None: ...

    def follow(self, track: pushplan._core.control.ReferencePath, obstacles: pushplan._core.geometry.Obstacles, robot: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], box: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], time: float, held: float) -> tuple[float, float]:
        """The command; a stop at the end, and for poses that are not finite."""

    def stop(self, time: float, held: float) -> tuple[float, float]: ...

    @property
    def failures(self) -> int: ...

    @property
    def solution(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

    @property
    def steps(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def face(self) -> int: ...

    @property
    def along(self) -> float: ...

    @property
    def slowed(self) -> float: ...

    @property
    def state(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def state_in_effect(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...
