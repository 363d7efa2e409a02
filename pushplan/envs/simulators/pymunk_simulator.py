"""The planar reference simulator, on Pymunk (Chipmunk). See docs/simulators.md for its accuracy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from pushplan.core import envs as core
from pushplan.envs.simulators.base import (
    Materials,
    Simulator,
    SimulatorState,
    Trace,
    checked_path,
    straight_leg,
)
from pushplan.envs.simulators.pymunk_bodies import PymunkBodies
from pushplan.geometry import gyration_squares
from pushplan.geometry.obstacles import grown_map
from pushplan.interaction.interaction_model import Interaction
from pushplan.world import InvalidInputError, Twist, World
from pushplan.world.checked_fields import CheckedFields, Limits, PositiveInt
from pushplan.world.checks import FloatArray, frozen, number

_Small = Annotated[float, Limits(0.0, 0.2, open_low=True)]
_LEAST_SIZE = 0.01
"""Objects far smaller than this fraction of the robot or of the others do not refine the steps."""
_REST = 2e-4  # objects that move slower than this fraction of their size per second stop


@dataclass(frozen=True)
class PymunkOptions(CheckedFields):
    """Numerical settings. Lengths are fractions of the objects' median radius.

    Where sizes differ much, four times the least radius counts instead, if that is smaller.

    Args:
        travel: how far the fastest point of the robot may move in one substep. At the default
            (2.8 mm for a 1 m box) boxes end where substeps ten times finer put them to 0.2 % of
            their size (median) and total work agrees to 0.1 %: docs/simulators.md has the table.
        slop: overlap that the contact solver leaves alone. It has to be small against an object,
            because an object rides that far inside its pusher, and not much smaller than
            ``travel``, because an object that is pushed out of contact in each substep is hit
            again in the next and chatters.
        tolerance: overlap at which the robot is held, when something static is involved.
        decay: fraction of its speed that a rolling or floating object may lose in one substep.
        iterations: sweeps of the contact solver in each substep.
        samples: poses recorded in each call of `PymunkSimulator.step`, at even intervals.
        holds_direction: the robot keeps the direction in the world that it had when a
            command began, and turns beside that, as in the code of the 2D benchmark; else its
            velocity turns with it, on an arc.
    """

    field_prefix = "pymunk "

    travel: _Small = 0.008
    slop: _Small = 0.002
    tolerance: _Small = 0.012
    decay: _Small = 0.04
    iterations: PositiveInt = 10
    samples: PositiveInt = 8
    holds_direction: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.tolerance < self.travel + self.slop:
            raise InvalidInputError(
                f"pymunk tolerance must be at least travel + slop = "
                f"{self.travel + self.slop:g}, got {self.tolerance:g}"
            )


class PymunkSimulator(Simulator):
    """A kinematic robot among objects that stop at once when nothing pushes them.

    Every velocity is zeroed in each substep before contacts are solved (``damping = 0``), so the
    world is quasi-static; a wheeled object keeps a decaying part of its velocity instead. Contacts
    are solved from scratch at the beginning of each call of `step`: that makes the simulator
    memoryless, as the contract wants.
    """

    name = "pymunk"
    is_exact = True
    engine_parts = ("_bodies", "_core", "_rows")

    def __init__(self, options: PymunkOptions | None = None) -> None:
        self.options = options or PymunkOptions()

    def build(self, world: World, materials: Materials) -> None:
        """Replace the scene with this one."""
        robot = world.robot
        radii = world.movables.radii
        self._size = max(robot.inscribed_radius, 1e-3)
        if len(radii):
            least = _LEAST_SIZE * max(self._size, float(np.median(radii)))
            self._size = max(float(min(np.median(radii), 4.0 * radii.min())), least)
        self._materials = materials
        self._world = world
        self._time = world.time
        assert world.robot_twist is not None
        movables = world.movables
        poses = np.vstack([world.robot_pose, movables.poses])
        # (1 + K, 6) poses and twists, which the core changes
        self._rows = np.hstack([poses, np.vstack([world.robot_twist, movables.twists])])
        self._held = self._touched = False
        options = self.options
        bodies = PymunkBodies(
            world,
            materials,
            slop=options.slop * self._size,
            iterations=options.iterations,
        )
        momentum = Momentum.of(world, materials)
        self._core = core.PlanarSimulator(
            bodies.functions,
            *bodies.handles,
            owner=bodies,
            reach=core.Reach(
                robot.vertices, robot.offsets, movables.vertices, movables.offsets, movables.radii
            ),
            obstacles=grown_map(world.static).obstacles,
            keeps=momentum.keeps,
            inertia=momentum.inertia,
            drag=momentum.drag,
            states=self._rows,
            travel=options.travel * self._size,
            tolerance=options.tolerance * self._size,
            rest=_REST * self._size,
            decay=options.decay,
            samples=options.samples,
            holds=options.holds_direction,
        )
        bodies.watch(self._core.contacts)
        self._bodies = bodies

    def __getstate__(self) -> dict[str, Any]:
        state = super().__getstate__()
        if "_core" in self.__dict__:
            state["history"] = self._bodies.shapes_so_far, self._core.most_shapes
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        came, most = state.pop("history", (0, 0))
        super().__setstate__(state)
        if most:
            self._bodies.go_on_from(came, most)
            self._core.most_shapes = most

    def step(self, command: Twist, duration: float) -> Trace:
        """Drive at a body-frame velocity for ``duration`` [s]."""
        duration = number("duration", duration, low=0.0, open_low=True)
        velocity = command.linear, command.angular, command.lateral
        robot, paths, held, touched = self._core.step(*velocity, duration)
        self._held = held
        self._touched = touched
        times = self._time + duration * np.arange(1, len(robot) + 1) / len(robot)
        self._time += duration
        times[-1] = self._time
        return Trace(frozen(times), frozen(robot), frozen(paths))

    def clear_for(self, command: Twist, limit: float) -> float:
        """Return a time in which the robot certainly touches nothing, as `Simulator.clear_for`."""
        return self._core.clear_for(command.linear, command.angular, command.lateral, limit)

    def follow(self, path: ArrayLike) -> Interaction:
        """Sweep the robot straight from pose to pose at its full speed."""
        poses = checked_path(path)
        self._rows[0] = [*poses[0], 0.0, 0.0, 0.0]
        found = np.empty((len(poses), len(self._rows) - 1, 3))
        found[0] = self._rows[1:, :3]
        jammed = -1
        for leg in range(1, len(poses)):
            if jammed < 0 and not self._sweep(poses[leg - 1], poses[leg]):
                jammed = leg
            found[leg] = self._rows[1:, :3]
        return Interaction(found, self._world.movables.masses, jammed)

    def _sweep(self, a: FloatArray, b: FloatArray) -> bool:
        """Drive straight between two poses; whether the robot got there."""
        dx, dy, turn, duration = straight_leg(self._world.robot, a, b)
        if duration == 0.0:
            return True
        self._time += duration
        return self._core.sweep(b, np.array([dx, dy, turn]), math.hypot(dx, dy), duration)

    @property
    def robot_pose(self) -> FloatArray:
        """(3,) x, y [m], theta [rad] of the robot now; cheap."""
        return self._rows[0, :3].copy()

    def _motion(self) -> tuple[float, FloatArray, FloatArray]:
        rows = self._rows.copy()
        return self._time, rows[:, :3], rows[:, 3:]

    def restore(self, state: SimulatorState) -> None:
        """Go back to a saved state of the same scene."""
        self._time = state.time
        self._held = self._touched = False
        self._rows[:, :3] = np.vstack([state.robot_pose, state.object_poses])
        self._rows[:, 3:] = np.vstack([state.robot_twist, state.object_twists])

    def remove(self, object_ids: Sequence[int]) -> None:
        """Take objects off the floor."""
        self.build(self._without(object_ids)[0], self._materials)


@dataclass(frozen=True)
class Momentum:
    """Drag on rolling and floating bodies; plain objects on the ground keep nothing.

    A body's law is ``m v' = -(b + c |v|) v``, and likewise about the vertical axis. A wheeled
    object has ``b = m / rolling_time`` and no c.
    """

    # (N,) whether the body keeps anything; the first is the robot, which never does
    keeps: FloatArray
    inertia: FloatArray  # (N, 2) mass [kg] and moment of inertia [kg m²]
    drag: FloatArray  # (N, 4) b and c of the translation and of the rotation, over mass and moment

    @classmethod
    def of(cls, world: World, materials: Materials) -> Momentum:
        """For the robot and all objects of a world."""
        movables = world.movables
        moments = movables.masses * gyration_squares(movables)
        inertia = np.ones((1 + len(movables), 2))
        inertia[1:, 0] = movables.masses
        inertia[1:, 1] = moments
        drag = np.zeros((len(inertia), 4))
        if materials.water is not None:
            drag = materials.water.coefficients(world) / np.repeat(inertia, 2, axis=1)
            keeps = np.ones(len(inertia), dtype=bool)
        else:
            drag[:, [0, 2]] = 1.0 / materials.rolling_time
            keeps = np.concatenate([[False], movables.wheeled])
        keeps[0] = False
        return cls(keeps.astype(np.float64), inertia, drag)
