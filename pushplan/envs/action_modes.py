"""Action modes: what an array in the action space asks of the robot, and back."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import ClassVar

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import ArrayLike, NDArray

from pushplan.control import clamp_twist
from pushplan.envs.tasks.base import Task
from pushplan.world import Action, InvalidInputError, Twist, UnknownNameError, WheelSpeeds, World
from pushplan.world.checks import FloatArray, is_finite

Motion = Callable[[FloatArray, float, bool], tuple[Twist, float] | None]
"""Asked while one action lasts, with the robot's pose (3,), the time [s] and whether
something has just held it: the next command and the number of control steps for which it may stand
if the robot follows it exactly (less than one only for a command that has to be replaced before its
step is over); None when the action is done."""


class ActionMode(ABC):
    """One way to command a robot. Actions are arrays in ``[-1, 1]``; others are clipped to it."""

    size: ClassVar[int]
    """Number of elements of an action."""
    takes_velocities: ClassVar[bool] = True
    """True if a `Twist` or `WheelSpeeds` can be encoded."""
    takes_lateral: ClassVar[bool] = False
    """True if that `Twist` may have a lateral velocity."""

    def __init__(self, task: Task) -> None:
        self.robot = task.robot

    @property
    def space(self) -> Box:
        """A new action space."""
        return Box(-1.0, 1.0, (self.size,), np.float32)

    def read(self, action: ArrayLike) -> FloatArray:
        """Check an action and clip it to the space.

        Raises:
            InvalidInputError: if it has the wrong shape or type or is not finite.
        """
        try:
            values = np.asarray(action, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InvalidInputError(
                f"an action must be numbers of shape ({self.size},), got {action!r:.80}"
            ) from error
        if values.shape != (self.size,):
            raise InvalidInputError(
                f"an action must have shape ({self.size},), got shape {values.shape}: "
                f"{action!r:.80}"
            )
        if not is_finite(values):
            raise InvalidInputError(f"an action must be finite, got {values.tolist()}")
        return np.clip(values, -1.0, 1.0)

    @abstractmethod
    def start(self, action: FloatArray, world: World) -> Motion:
        """Begin to carry out an action that `read` has returned."""

    def encode(self, action: Action) -> NDArray[np.float32]:
        """The array in the action space nearest to a command.

        Raises:
            InvalidInputError: if the command is not finite or has the wrong shape, or is a lateral
                velocity, which these actions do not have.
        """
        if isinstance(action, Twist | WheelSpeeds):
            twist = self._twist(action)
            if twist.lateral and not self.takes_lateral:
                raise InvalidInputError(
                    "these actions have no lateral velocity, make the environment with "
                    f"action='omnidirectional'; got {twist.lateral:g} m/s"
                )
            action = self._from_twist(twist)
        return self.read(action).astype(np.float32)

    def afterwards(self, command: Twist) -> Twist:
        """Return the velocity of the robot after an action that ended with ``command``."""
        return command

    @abstractmethod
    def _from_twist(self, twist: Twist) -> FloatArray:
        """The array that asks for a twist, not clipped."""

    def _twist(self, action: Twist | WheelSpeeds) -> Twist:
        if isinstance(action, Twist):
            return action
        separation = self.robot.wheel_separation
        if separation == 0.0:
            raise InvalidInputError(f"robot {self.robot.name!r} has no wheels, send a Twist")
        return Twist(0.5 * (action.left + action.right), (action.right - action.left) / separation)


def chosen_action(task: type[Task], wanted: str | Sequence[str] | None) -> str:
    """The action mode of a task: its first, or the first of those wanted that it has.

    Raises:
        UnknownNameError: if it has none of them.
    """
    if wanted is None:
        return task.actions[0]
    several = isinstance(wanted, Sequence) and not isinstance(wanted, str)
    names = tuple(wanted) if several else (wanted,)
    for name in names:
        if name in task.actions:
            return name
    raise UnknownNameError(
        f"action of task {task.name!r}", ", ".join(map(str, names)), task.actions
    )


def waiting(command: Twist, periods: float = 1.0, *, then: Motion | None = None) -> Motion:
    """A command for some time, one control step at most, and then another motion."""
    first = iter(((command, periods),))

    def motion(pose: FloatArray, time: float, held: bool) -> tuple[Twist, float] | None:
        wanted = next(first, None)
        if wanted is None and then is not None:
            return then(pose, time, held)
        return wanted

    return motion


class TurnRateAction(ActionMode):
    """Turn rate at constant speed: one element, times ``robot.max_turn_rate``."""

    size = 1

    def start(self, action: FloatArray, world: World) -> Motion:
        """One command at full speed."""
        return waiting(Twist(self.robot.max_speed, float(action[0]) * self.robot.max_turn_rate))

    def _from_twist(self, twist: Twist) -> FloatArray:
        return np.array([twist.angular / self.robot.max_turn_rate])


class VelocityAction(ActionMode):
    """Forward speed and turn rate, times the robot's limits; a car turns as its speed allows."""

    size = 2

    def start(self, action: FloatArray, world: World) -> Motion:
        """One command within the speed limits."""
        robot = self.robot
        speed = float(action[0]) * robot.max_speed
        return waiting(clamp_twist(robot, speed, float(action[1]) * robot.max_turn_rate))

    def _from_twist(self, twist: Twist) -> FloatArray:
        return np.array(
            [twist.linear / self.robot.max_speed, twist.angular / self.robot.max_turn_rate]
        )


class OmnidirectionalAction(ActionMode):
    """Speeds ahead and to the left, times ``robot.max_speed``, and turn rate of any robot.

    Where both speeds together are more than ``robot.max_speed`` the direction is kept.
    """

    size = 3
    takes_lateral = True

    def start(self, action: FloatArray, world: World) -> Motion:
        """One command within the limits of speed and turn rate."""
        linear, lateral, angular = (float(value) for value in action)
        speed = self.robot.max_speed
        turn = angular * self.robot.max_turn_rate
        return waiting(clamp_twist(self.robot, linear * speed, turn, lateral * speed))

    def _from_twist(self, twist: Twist) -> FloatArray:
        robot = self.robot
        speeds = np.array([twist.linear, twist.lateral]) / robot.max_speed
        return np.append(speeds, twist.angular / robot.max_turn_rate)


class WheelsAction(ActionMode):
    """Rim speeds of the left and the right wheel, times ``robot.max_speed``.

    Where the difference asks for more than the robot's turn rate, the turn rate is limited and
    the mean of the two, the forward speed, is kept.
    """

    size = 2

    def start(self, action: FloatArray, world: World) -> Motion:
        """One command within the limits of speed and turn rate."""
        left, right = (float(value) * self.robot.max_speed for value in action)
        twist = self._twist(WheelSpeeds(left, right))
        return waiting(clamp_twist(self.robot, twist.linear, twist.angular))

    def _from_twist(self, twist: Twist) -> FloatArray:
        half = 0.5 * twist.angular * self.robot.wheel_separation
        wheels = np.array([twist.linear - half, twist.linear + half]) / self.robot.max_speed
        # slowing both wheels alike keeps to the curve
        return wheels / max(1.0, float(np.abs(wheels).max()))
