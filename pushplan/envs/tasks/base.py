"""What every task does. It names quantities of a `World`; engines mean nothing to it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from pushplan.envs.simulators.base import Materials
from pushplan.envs.trace import Trace
from pushplan.world import Drive, RobotModel, World


class ObservationBuilder(Protocol):
    """Turns a snapshot into an array of fixed shape and type, within fixed bounds."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array."""
        ...

    @property
    def dtype(self) -> np.dtype[Any]:
        """Element type of the array."""
        ...

    @property
    def low(self) -> float:
        """Least value of an element."""
        ...

    @property
    def high(self) -> float:
        """Greatest value of an element."""
        ...

    def observe(self, world: World) -> NDArray[Any]:
        """A new array for this snapshot."""
        ...


@dataclass(frozen=True)
class Outcome:
    """What one step of an episode was worth.

    Args:
        reward: as the task defines it.
        success: whether the goal is reached.
        reason: why the episode ends, ``""`` while it goes on.
        terminated: whether the episode is over for the task.
        truncated: whether it was cut off.
        work: sum over the objects of mass times path length in this step [kg m].
    """

    reward: float
    success: bool
    reason: str
    terminated: bool
    truncated: bool
    work: float


class Task(ABC):
    """One task with one preset and its variations.

    Args:
        preset: one of `presets`.
        variations: what departs from the preset, by name.
        drive: how the action mode drives the robot; it becomes part of the world's robot.

    Raises:
        UnknownNameError: if there is no such preset or variation.
        ScenarioError: if the value of a variation makes no sense.
    """

    name: ClassVar[str]
    presets: ClassVar[tuple[str, ...]]
    actions: ClassVar[tuple[str, ...]]
    """Action modes that make sense; the first is the default."""

    control_step: float
    """Time between two commands to the robot [s]."""
    materials: Materials
    robot: RobotModel
    reach: float
    """No coordinate and no distance that is observed exceeds this [m]."""

    @abstractmethod
    def __init__(self, *, preset: str, variations: Mapping[str, object], drive: Drive) -> None: ...

    @abstractmethod
    def start(self, rng: np.random.Generator) -> World:
        """A new start, drawn from the task's distribution; also forgets the last episode.

        Raises:
            ScenarioError: if the request cannot be met, such as too many boxes.
        """

    @abstractmethod
    def score(self, before: World, after: World, trace: Trace, *, touched_static: bool) -> Outcome:
        """What the step from ``before`` to ``after`` was worth, and whether the episode ends.

        Args:
            before: the world when the step began.
            after: the world when it ended.
            trace: what moved in between.
            touched_static: whether the robot touched something static.
        """

    @abstractmethod
    def observation(self, name: str) -> ObservationBuilder:
        """The builder of an observation by name.

        Raises:
            UnknownNameError: if the task has no such observation.
        """
