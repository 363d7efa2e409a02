"""Base class of simulators. They simulate bodies and know no tasks, goals or rewards."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pushplan.envs.simulators.water import Water
from pushplan.envs.trace import Trace
from pushplan.interaction.interaction_model import Interaction
from pushplan.world import InvalidInputError, RobotModel, Twist, World
from pushplan.world.checked_fields import CheckedFields, NonNegativeFloat, PositiveFloat
from pushplan.world.checks import ArrayRecord, FloatArray, IntArray, array, frozen


@dataclass(frozen=True)
class Solids(CheckedFields):
    """The third dimension of a scene, for engines that have one."""

    object_height: PositiveFloat  # of boxes or floes [m]
    robot_height: PositiveFloat  # of the robot's body [m]
    wall_height: PositiveFloat  # of everything static [m]
    bumper_height: PositiveFloat  # of the footprint parts of the robot other than its first one [m]
    wheel_radius: PositiveFloat  # of the robot's driven wheels [m]


@dataclass(frozen=True)
class Materials(CheckedFields):
    """Friction, rolling and drag of bodies, in terms that every engine understands.

    Args:
        robot_object: friction coefficient between the robot's bumper and an object.
        object_object: friction coefficient between two objects.
        object_static: friction coefficient between an object and a wall.
        rolling_time: time constant [s] of the exponential decay of a wheeled object's velocity
            once nothing pushes it; it rolls on for speed times this.
        object_ground: sliding friction coefficient between a plain object and the ground. Planar
            engines stop plain objects at once instead.
        water: drag of floating bodies; None on dry ground.
        solids: the third dimension; None where the scene has none, and three-dimensional engines
            refuse it.
    """

    field_prefix = "materials."

    robot_object: NonNegativeFloat = 0.0
    object_object: NonNegativeFloat = 0.0
    object_static: NonNegativeFloat = 0.0
    rolling_time: PositiveFloat = 1.0
    object_ground: NonNegativeFloat = 0.4
    water: Water | None = None
    solids: Solids | None = None


@dataclass(frozen=True, eq=False)
class SimulatorState(ArrayRecord):
    """Everything that decides what a simulator does next."""

    time: float  # [s]
    robot_pose: FloatArray  # (3,) x, y [m], theta [rad]
    robot_twist: FloatArray  # (3,) velocity in the world frame [m/s, m/s, rad/s]
    object_poses: FloatArray  # (K, 3)
    object_twists: FloatArray  # (K, 3)
    # further state of the engine, in an order of its own
    hidden: FloatArray = field(default_factory=lambda: frozen(np.zeros(0)))


class Simulator(ABC):
    """Holds the bodies of one scene and moves them.

    The contract is *memoryless*: after `build` or `restore`, the same commands give the same
    bytes, whatever was simulated before. A planar engine's whole state is in the `World`, so that
    a rollout from ``env.world`` is what the environment will do; an engine with a third dimension
    begins with every body upright on the ground, and at the twists of the `World`.
    """

    name: ClassVar[str]
    """As in the registry of simulators."""
    needs_solids: ClassVar[bool] = False
    """True if the engine has a third dimension, so that `Materials.solids` must be there."""
    has_camera: ClassVar[bool] = False
    is_exact: ClassVar[bool] = False
    """True if the robot follows a command exactly unless something blocks it."""

    engine_parts: ClassVar[tuple[str, ...]] = ()
    """Attributes that `build` makes from a world, which a copy makes anew and never shares."""
    _world: World
    _materials: Materials
    _held = _touched = False

    def __getstate__(self) -> dict[str, Any]:
        """All but the engine's own objects, and the state they are in (`save`)."""
        kept = {key: self.__dict__[key] for key in self.__dict__ if key not in self.engine_parts}
        built = bool(self.engine_parts) and hasattr(self, "_world")
        return {**kept, "saved": self.save() if built else None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        saved = state.pop("saved", None)
        self.__dict__.update(state)
        if saved is not None:
            self.build(self._world, self._materials)
            self.restore(saved)
            self.__dict__.update(state)

    @abstractmethod
    def build(self, world: World, materials: Materials) -> None:
        """Replace the scene with this one."""

    @abstractmethod
    def step(self, command: Twist, duration: float) -> Trace:
        """Drive the robot at a velocity in its own frame for ``duration`` [s].

        The robot stops short, for as long as it has to, where going on would press a body into
        something static; `held` then says so.
        """

    def clear_for(self, command: Twist, limit: float) -> float:
        """Return a time [s], at most ``limit``, in which the robot certainly touches nothing.

        Meanwhile nothing but the robot moves. An engine that cannot tell says 0.
        """
        return 0.0

    @abstractmethod
    def follow(self, path: ArrayLike) -> Interaction:
        """Put the robot at the first of (N, 3) poses and sweep it through the others.

        Straight from pose to pose at the robot's full speed; ends where the robot is held.
        """

    @abstractmethod
    def _motion(self) -> tuple[float, FloatArray, FloatArray]:
        """Time [s], poses and twists (1 + K, 3) of the robot and the objects now."""

    def world(self) -> World:
        """A snapshot of the scene now."""
        time, poses, twists = self._motion()
        return replace(
            self._world,
            robot_pose=poses[0],
            robot_twist=twists[0],
            movables=self._world.movables.moved_to(poses[1:], twists[1:]),
            time=time,
        )

    def save(self) -> SimulatorState:
        """The state now, cheap enough for every step."""
        time, poses, twists = self._motion()
        parts = (poses[0], twists[0], poses[1:], twists[1:], self._hidden())
        return SimulatorState(time, *(frozen(part) for part in parts))

    def _hidden(self) -> FloatArray:
        """Return the state that the engine keeps beside poses and twists."""
        return np.zeros(0)

    @abstractmethod
    def restore(self, state: SimulatorState) -> None:
        """Go back to a saved state of the same scene."""

    @property
    def robot_pose(self) -> FloatArray:
        """(3,) x, y [m], theta [rad] of the robot now; cheap."""
        pose: FloatArray = self._motion()[1][0]
        return pose

    @property
    def object_poses(self) -> FloatArray:
        """(K, 3) poses of the objects now; cheap."""
        return np.ascontiguousarray(self._motion()[1][1:])

    @abstractmethod
    def remove(self, object_ids: Sequence[int]) -> None:
        """Take objects off the floor; the others keep their state.

        Raises:
            InvalidInputError: if one of them is not there.
        """

    def photograph(self, width: int, height: int) -> NDArray[np.uint8]:
        """(H, W, 3) picture by the engine's own camera, if `has_camera`."""
        raise NotImplementedError(f"simulator {self.name!r} has no camera")

    @property
    def touched_static(self) -> bool:
        """True if the robot's footprint touched something static during the last step."""
        return self._touched

    @property
    def held(self) -> bool:
        """True if the robot was kept from moving as commanded during the last step."""
        return self._held

    def _without(self, object_ids: Sequence[int]) -> tuple[World, IntArray]:
        """The world now without some objects, and their rows.

        Raises:
            InvalidInputError: if one of them is not there.
        """
        world = self.world()
        keep = ~np.isin(world.movables.ids, object_ids)
        if len(object_ids) != (~keep).sum():
            raise InvalidInputError(
                f"cannot remove {list(object_ids)}, valid ids: {world.movables.ids.tolist()}"
            )
        return replace(world, movables=world.movables.select(keep)), np.flatnonzero(~keep)


def checked_path(path: ArrayLike) -> FloatArray:
    """(N, 3) poses to follow.

    Raises:
        InvalidInputError: if there is none, or they have another shape or are not finite.
    """
    poses: FloatArray = array("path", path, (None, 3))
    if len(poses) == 0:
        raise InvalidInputError("path must hold at least one pose")
    return poses


def straight_leg(
    robot: RobotModel, a: FloatArray, b: FloatArray
) -> tuple[float, float, float, float]:
    """From a pose (3,) to another at full speed: dx, dy [m], turn [rad], time [s]."""
    dx = float(b[0] - a[0])
    dy = float(b[1] - a[1])
    turn = math.remainder(float(b[2] - a[2]), math.tau)
    return dx, dy, turn, max(math.hypot(dx, dy) / robot.max_speed, abs(turn) / robot.max_turn_rate)
