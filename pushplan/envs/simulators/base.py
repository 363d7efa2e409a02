"""Base class of simulators. They simulate bodies and know no tasks, goals or rewards."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pushplan.core import envs as core
from pushplan.core import geometry
from pushplan.interaction.interaction_model import Interaction
from pushplan.world import InvalidInputError, Movables, RobotModel, Twist, World
from pushplan.world.checked_fields import CheckedFields, NonNegativeFloat, PositiveFloat
from pushplan.world.checks import ArrayRecord, FloatArray, IntArray, array, frozen
from pushplan.world.outline import flatten


@dataclass(frozen=True, eq=False)
class Trace(ArrayRecord):
    """Motion of robot and objects during a stretch of time, without the instant at which it began.

    Traces of consecutive stretches therefore join end to end without a repeated instant.

    Args:
        times: (N,) [s], increasing.
        robot_poses: (N, 3) x, y [m], theta [rad].
        object_poses: (N, K, 3) in the order of the world's movables.
    """

    times: FloatArray
    robot_poses: FloatArray
    object_poses: FloatArray

    @classmethod
    def join(cls, traces: Sequence[Trace]) -> Trace:
        """One trace of several consecutive ones; at least one is needed."""
        if len(traces) == 1:
            return traces[0]
        return cls(
            times=frozen(np.concatenate([trace.times for trace in traces])),
            robot_poses=frozen(np.concatenate([trace.robot_poses for trace in traces])),
            object_poses=frozen(np.concatenate([trace.object_poses for trace in traces])),
        )

    def object_lengths(self, start: FloatArray) -> FloatArray:
        """(K,) path length of each object's centre [m] from its pose in ``start`` (K, 3) on."""
        points = np.concatenate([start[None, :, :2], self.object_poses[:, :, :2]])
        steps = np.diff(points, axis=0)
        lengths: FloatArray = np.sqrt((steps * steps).sum(axis=-1)).sum(axis=0)
        return lengths


@dataclass(frozen=True)
class Water(CheckedFields):
    """Drag of water on bodies: ``F = -(b + c |v|) v``, and likewise about the vertical axis.

    Objects are flat floes. Water resists them at their edges (form drag) and underneath (skin
    drag), both quadratic. It is never quite still itself: against an ambient motion u0, the drag
    on a body that is slower than that is linear, which ``b = c u0`` stands for. So a floe comes to
    rest exponentially, where a quadratic law alone would let it creep for ever.

    The robot is a hull whose low-speed model is linear: its speed decays with a time constant.
    """

    field_prefix = "water "

    density: PositiveFloat = 1025.0  # of the water [kg/m³]
    object_draught: NonNegativeFloat = 1.05  # draught of an object [m]
    object_form_drag: NonNegativeFloat = 1.1  # C_d of an edge, on mean width times draught
    object_skin_drag: NonNegativeFloat = 0.0055  # C_w of the underside, ``F = density C_w area v²``
    ambient_speed: NonNegativeFloat = 0.05  # u0 [m/s]
    robot_draught: NonNegativeFloat = 5.0  # draught of the robot [m]
    # time constant of the robot's speed when nothing drives it [s]
    robot_surge_time: PositiveFloat = 88.0
    robot_yaw_time: PositiveFloat = 11.6  # of its turn rate [s]

    def coefficients(self, world: World) -> FloatArray:
        """Drag of the robot, then of each object.

        Returns:
            (1 + K, 4): linear b [N s/m] and quadratic c [N s²/m²] coefficient of the translation,
            linear [N m s] and quadratic [N m s²] of the rotation.
        """
        movables = world.movables
        out = np.zeros((1 + len(movables), 4))
        out[0, 0] = world.robot.mass / self.robot_surge_time
        out[0, 2] = world.robot.mass * _hull_inertia(world) / self.robot_yaw_time
        shape = _flow_shapes(movables)
        form = 0.5 * self.density * self.object_form_drag * self.object_draught
        skin = self.density * self.object_skin_drag
        out[1:, 1] = form * shape[:, 0] + skin * shape[:, 1]
        out[1:, 3] = form * shape[:, 2] + skin * shape[:, 3]
        out[1:, 0] = self.ambient_speed * out[1:, 1]
        out[1:, 2] = self.ambient_speed / np.sqrt(shape[:, 1] / np.pi) * out[1:, 3]
        return frozen(out)


def _flow_shapes(movables: Movables) -> FloatArray:
    """(K, 4) as `FlowShape` of the core: edges are those of the hulls, areas those of the parts."""
    shape = core.flow_shapes(movables.vertices, movables.offsets)
    if movables.is_compound:
        pieces = [movables.contact_pieces(k) for k in range(len(movables))]
        each = core.flow_shapes(*flatten([piece for some in pieces for piece in some]))
        first = np.cumsum([0, *map(len, pieces)])[:-1]
        shape[:, [1, 3]] = np.add.reduceat(each[:, [1, 3]], first)
    return shape


def _hull_inertia(world: World) -> float:
    """Polar second moment of the robot's footprint about its origin, per unit mass [m²]."""
    total = moment = 0.0
    for part in world.robot.contact_parts:
        area = geometry.polygon_area(part)
        x, y = geometry.polygon_centroid(part)
        total += area
        moment += area * (geometry.polygon_inertia(part) + x * x + y * y)
    return moment / total


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
