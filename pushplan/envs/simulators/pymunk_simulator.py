"""The planar reference simulator, on Pymunk (Chipmunk). See docs/simulators.md for its accuracy."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pushplan.core import envs as core
from pushplan.envs.simulators.base import (
    Materials,
    Simulator,
    SimulatorState,
    checked_path,
    straight_leg,
)
from pushplan.envs.simulators.momentum import Momentum
from pushplan.envs.simulators.pymunk_bodies import PymunkBodies
from pushplan.envs.simulators.pymunk_drive import PymunkDriver, PymunkOptions
from pushplan.envs.trace import Trace
from pushplan.geometry.obstacles import obstacles_of
from pushplan.interaction.interaction_model import Interaction
from pushplan.world import Twist, World
from pushplan.world.checks import BoolArray, FloatArray, IntArray, frozen, number

_GLIDE_SAMPLES = 4
"""Poses recorded at least in a step in which the robot turns and touches nothing."""
_GLIDE_TURN = 0.15
"""Turn between two of them at most [rad]; driving, they are at most a robot's radius apart."""
_SAMPLED = 24.0  # steps of fewer substeps than this are sampled more coarsely
_LEAST_SIZE = 0.01
"""Objects far smaller than this fraction of the robot or of the others do not refine the steps."""
_REST = 2e-4  # objects that move slower than this fraction of their size per second stop


class PymunkSimulator(Simulator):
    """A kinematic robot among objects that stop at once when nothing pushes them.

    Every velocity is zeroed in each substep before contacts are solved (``damping = 0``), so the
    world is quasi-static; a wheeled object keeps a decaying part of its velocity instead. Contacts
    are solved from scratch at the beginning of each call of `step`: that makes the simulator
    memoryless, as the contract wants.
    """

    name = "pymunk"
    is_exact = True

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
        self._momentum = Momentum.of(world, materials)
        self._connect()
        self._time = world.time
        assert world.robot_twist is not None
        robot_row = np.concatenate([world.robot_pose, world.robot_twist])
        objects = np.concatenate([world.movables.poses, world.movables.twists], axis=1)
        self._rows = np.concatenate([robot_row[None], objects])  # (1 + K, 6) poses and twists
        self._held = self._touched = False

    def _connect(self) -> None:
        """Make the objects of the engine and of the core, which the rest decides."""
        options = self.options
        robot = self._world.robot
        movables = self._world.movables
        bodies = PymunkBodies(
            self._world,
            self._materials,
            slop=options.slop * self._size,
            iterations=options.iterations,
        )
        self._driver = PymunkDriver(bodies, robot, options, self._size)
        self._reach = core.Reach(
            robot.vertices, robot.offsets, movables.vertices, movables.offsets, movables.radii
        )

    def __getstate__(self) -> dict[str, Any]:
        """Everything but what `_connect` makes."""
        made = ("_driver", "_reach")
        return {key: value for key, value in self.__dict__.items() if key not in made}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        if "_world" in state:
            self._connect()

    def step(self, command: Twist, duration: float) -> Trace:
        """Drive at a body-frame velocity for ``duration`` [s]."""
        duration = number("duration", duration, low=0.0, open_low=True)
        radius = self._world.robot.circumscribed_radius
        speed = abs(command.linear) + abs(command.angular) * radius
        self._held = self._touched = False
        clear = self.clear_for(command, duration)
        if clear >= duration:
            turn = abs(command.angular) * duration
            way = abs(command.linear) * duration
            samples = max(1, math.ceil(turn / _GLIDE_TURN), math.ceil(way / radius))
            poses = self._glide(command, duration, max(samples, _GLIDE_SAMPLES if turn else 1))
            return self._traced(duration, poses, self._resting(len(poses)))
        own = self._object_speeds() * duration
        wanted = self._substeps(max(speed * duration, own.max(initial=0.0)), duration)
        samples = max(2, math.ceil(self.options.samples * min(1.0, wanted / _SAMPLED)))
        each = max(1, math.ceil(wanted / samples))
        free = int(samples * clear / duration)  # samples before anything is touched
        course = float(self._rows[0, 2])
        robot = self._glide(command, duration * free / samples, free)
        left = samples - free
        rest = duration * left / samples
        resting = self._resting(free)
        driven, paths = self._simulate(
            self._in_reach(speed * rest, own),
            lambda start, active: self._driver.run(
                command, rest, start, active, (left, each), course
            ),
        )
        self._held = self._driver.held
        self._touched = self._driver.touched
        paths = np.concatenate([resting, paths])
        return self._traced(duration, np.concatenate([robot, driven]), paths)

    def _simulate(
        self, loaded: BoolArray, run: Callable[[FloatArray, IntArray], FloatArray]
    ) -> tuple[FloatArray, FloatArray]:
        """Run the engine with some objects, and with those that turn out to be struck.

        Args:
            loaded: (K,) which objects to begin with.
            run: takes the rows of the robot and some objects and the indices of these, and returns
                rows (T, 1 + A, 6) of T samples.

        Returns:
            (T, 3) and (T, K, 3) poses of the robot and of all objects. The last ones stay; objects
            that were left out are at rest.
        """
        while True:
            active = np.flatnonzero(loaded)
            found = run(np.concatenate([self._rows[:1], self._rows[1 + active]]), active)
            paths = self._resting(len(found))
            paths[:, active] = found[:, 1:, :3]
            missed = self._reach.struck(loaded, paths, self._object_rows())
            if not missed.any():
                break
            loaded |= missed
        self._rows[1:, 3:] = 0.0
        self._rows[0] = found[-1, 0]
        self._rows[1 + active] = found[-1, 1:]
        return found[:, 0, :3], paths

    def clear_for(self, command: Twist, limit: float) -> float:
        """Return a time in which the robot certainly touches nothing, as `Simulator.clear_for`."""
        held = self.options.holds_direction
        return self._clear_time(self._rows[0, 2], command.linear, command.angular, held, limit)

    def _clear_time(
        self, course: float, linear: float, angular: float, holds: bool, limit: float
    ) -> float:
        if self._object_speeds().any():
            return 0.0
        return self._reach.clear_time(
            self._rows[0, :3],
            course,
            linear,
            angular,
            holds,
            limit,
            self.options.travel * self._size,
            self._object_rows(),
            obstacles_of(self._world.static),
        )

    def _object_rows(self) -> FloatArray:
        """(K, 3) poses of the objects, contiguous also where there is one object or none."""
        return np.ascontiguousarray(self._rows[1:, :3])

    def _substeps(self, travel: float, duration: float) -> float:
        """Return the number of substeps of a step in which some point moves by ``travel`` [m]."""
        decay = self._momentum.fastest_decay(self._rows[:, 3:])
        by_travel = travel / (self.options.travel * self._size)
        return max(by_travel, duration * decay / self.options.decay)

    def _glide(self, command: Twist, duration: float, samples: int) -> FloatArray:
        """(samples, 3) poses of a robot that touches nothing; it ends at the last one."""
        poses = np.empty((samples, 3))
        start = self._rows[0, :3].copy()
        v = command.linear
        w = command.angular
        for i in range(samples):
            time = duration * (i + 1) / samples
            core.arc_pose(start, start[2], v, w, self.options.holds_direction, time, poses[i])
        if samples:
            theta = poses[-1, 2]
            self._rows[1:, 3:] = 0.0
            self._rows[0] = *poses[-1], v * math.cos(theta), v * math.sin(theta), w
        return poses

    def _resting(self, samples: int) -> FloatArray:
        """(samples, K, 3) poses of the objects where nothing moves them."""
        return np.repeat(self._rows[None, 1:, :3], samples, axis=0)

    def _traced(self, duration: float, robot: FloatArray, paths: FloatArray) -> Trace:
        times = self._time + duration * np.arange(1, len(robot) + 1) / len(robot)
        self._time += duration
        times[-1] = self._time
        return Trace(frozen(times), frozen(np.ascontiguousarray(robot)), frozen(paths))

    def _object_speeds(self) -> FloatArray:
        """(K,) speeds of the objects' fastest points, rolling or still being pushed [m/s].

        What has become slower than can matter has stopped.
        """
        velocities = self._rows[1:, 3:]
        if not velocities.any():
            return np.zeros(len(velocities))
        turning = np.abs(velocities[:, 2]) * self._world.movables.radii
        speeds: FloatArray = np.hypot(velocities[:, 0], velocities[:, 1]) + turning
        speeds[speeds < _REST * self._size] = 0.0
        return speeds

    def _in_reach(self, reach: float, own: FloatArray) -> BoolArray:
        return self._reach.within(self._rows[0, :3], reach, self._object_rows(), own)

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
        robot = self._world.robot
        dx, dy, turn, duration = straight_leg(robot, a, b)
        length = math.hypot(dx, dy)
        if duration == 0.0:
            return True
        course = math.atan2(dy, dx)
        clear = self._clear_time(course, length / duration, turn / duration, True, duration)
        if clear >= duration:
            self._rows[1:, 3:] = 0.0
            self._rows[0, :3] = b
            self._time += duration
            return True
        reach = length + abs(turn) * robot.circumscribed_radius
        own = self._object_speeds() * duration
        count = max(1, math.ceil(reach / (self.options.travel * self._size)))
        h = duration / count
        velocity = (dx / duration, dy / duration, turn / duration)
        self._simulate(
            self._in_reach(reach, own),
            lambda start, active: self._driver.sweep(velocity, h, count, start, active),
        )
        self._time += duration
        return not self._driver.held

    def _motion(self) -> tuple[float, FloatArray, FloatArray]:
        rows = self._rows.copy()
        return self._time, rows[:, :3], rows[:, 3:]

    def restore(self, state: SimulatorState) -> None:
        """Go back to a saved state of the same scene."""
        robot = np.concatenate([state.robot_pose, state.robot_twist])
        objects = np.concatenate([state.object_poses, state.object_twists], axis=1)
        self._time = state.time
        self._held = self._touched = False
        self._rows = np.concatenate([robot[None], objects])

    def remove(self, object_ids: Sequence[int]) -> None:
        """Take objects off the floor."""
        self.build(self._without(object_ids)[0], self._materials)
