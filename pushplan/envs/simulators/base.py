"""What every simulator does. It knows bodies; tasks, goals and rewards mean nothing to it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from numpy.typing import ArrayLike

from pushplan.envs.trace import Trace
from pushplan.interaction.model import Interaction
from pushplan.world import Twist, World
from pushplan.world.checks import ArrayRecord, FloatArray, number


@dataclass(frozen=True)
class Materials:
    """How bodies grip and roll, in terms that every engine understands.

    Args:
        robot_object: friction coefficient between the robot's bumper and an object.
        object_object: friction coefficient between two objects.
        object_static: friction coefficient between an object and a wall.
        rolling_time: time constant [s] of the exponential decay of a wheeled object's velocity
            once nothing pushes it; it rolls on for speed times this.
    """

    robot_object: float = 0.0
    object_object: float = 0.0
    object_static: float = 0.0
    rolling_time: float = 1.0

    def __post_init__(self) -> None:
        for key in ("robot_object", "object_object", "object_static"):
            value = number(f"friction {key}", getattr(self, key), low=0.0)
            object.__setattr__(self, key, value)
        rolling = number("rolling_time", self.rolling_time, low=0.0, open_low=True)
        object.__setattr__(self, "rolling_time", rolling)


@dataclass(frozen=True, eq=False)
class SimulatorState(ArrayRecord):
    """Everything that decides what a simulator does next.

    Args:
        time: [s].
        robot_pose: (3,) x, y [m], theta [rad].
        robot_twist: (3,) velocity in the world frame [m/s, m/s, rad/s].
        object_poses: (K, 3).
        object_twists: (K, 3).
    """

    time: float
    robot_pose: FloatArray
    robot_twist: FloatArray
    object_poses: FloatArray
    object_twists: FloatArray


class Simulator(ABC):
    """Holds the bodies of one scene and moves them.

    The contract is *memoryless*: after `build` or `restore` from a snapshot, the same commands
    give the same bytes, whatever was simulated before. So a rollout from ``env.world`` is what
    the environment will do.
    """

    @abstractmethod
    def build(self, world: World, materials: Materials) -> None:
        """Replace the scene with this one."""

    @abstractmethod
    def step(self, command: Twist, duration: float) -> Trace:
        """Drive the robot at a velocity in its own frame for ``duration`` [s].

        The robot stops short, for as long as it has to, where going on would press a body into
        something static; `held` then says so.
        """

    @abstractmethod
    def follow(self, path: ArrayLike) -> Interaction:
        """Put the robot at the first of (N, 3) poses and sweep it through the others.

        Straight from pose to pose at the robot's full speed; ends where the robot is held.
        """

    @abstractmethod
    def world(self) -> World:
        """A snapshot of the scene now."""

    @abstractmethod
    def save(self) -> SimulatorState:
        """The state now, cheap enough for every step."""

    @abstractmethod
    def restore(self, state: SimulatorState) -> None:
        """Go back to a saved state of the same scene."""

    @abstractmethod
    def remove(self, object_id: int) -> None:
        """Take an object off the floor."""

    @property
    @abstractmethod
    def touched_static(self) -> bool:
        """Whether the robot's footprint touched something static during the last step."""

    @property
    @abstractmethod
    def held(self) -> bool:
        """Whether the robot was kept from moving as commanded during the last step."""
