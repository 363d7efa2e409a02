"""The three-dimensional simulator, on MuJoCo. See docs/simulators-mujoco.md for its accuracy."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pushplan.envs.simulators.base import (
    Materials,
    Simulator,
    SimulatorState,
    Trace,
    checked_path,
    straight_leg,
)
from pushplan.envs.simulators.mujoco_bodies import MujocoBodies, scene_key
from pushplan.envs.simulators.mujoco_camera import MujocoCamera
from pushplan.envs.simulators.mujoco_library import mujoco
from pushplan.envs.simulators.mujoco_model import MujocoOptions
from pushplan.interaction.interaction_model import Interaction
from pushplan.world import InvalidInputError, RobotModel, Twist, World
from pushplan.world.checks import FloatArray, frozen, number

_PERIODS_PER_RADIUS = 10.0
_PATIENCE = 1.0
_LATE = 0.5
HELD_SHARE = 0.5
"""A robot in contact that moves with less than this fraction of its command is held ..."""
GAIN_SHARE = 0.25
"""... unless it gains more than this fraction of the speed that it could gain in the step."""
_NEGLIGIBLE = 0.05  # commands below this fraction of the robot's limit hold nobody


class MujocoSimulator(Simulator):
    """A robot on motor-driven wheels among boxes on the ground, or a ship among floes.

    Every call of `step` begins from the state alone (`MujocoBodies.refresh`), so the simulator is
    memoryless: the same state and commands give the same bytes. A scene built from a `World`
    starts upright on the ground with the planar velocities that the world states.

    `touched_static` looks at the samples of a step. `held`: the hull touched something at one of
    them, and in the second half of the step the robot moved along its heading, or turned, with
    less than half of the commanded rate, and was not speeding up either.
    """

    name = "mujoco"
    needs_solids = True
    has_camera = True
    engine_parts = ("_bodies", "_camera")
    _bodies: MujocoBodies | None = None
    _camera: MujocoCamera | None = None

    def __init__(self, options: MujocoOptions | None = None) -> None:
        self.options = options or MujocoOptions()

    def build(self, world: World, materials: Materials) -> None:
        """Replace the scene with this one; a scene of the same shapes keeps its model.

        Raises:
            InvalidInputError: if ``materials.solids`` is None, or the robot cannot drive.
        """
        key = scene_key(world, materials, self.options)
        if self._bodies is None or self._bodies.key != key:
            self._camera = None
            self._bodies = MujocoBodies(world, materials, self.options)
        self._world = world
        self._materials = materials
        self._held = self._touched = False
        self._bodies.place(world)

    @property
    def _scene(self) -> MujocoBodies:
        if self._bodies is None:
            raise InvalidInputError("there is no scene yet: call build() first")
        return self._bodies

    def step(self, command: Twist, duration: float) -> Trace:
        """Drive at a body-frame velocity for ``duration`` [s]."""
        duration = number("duration", duration, low=0.0, open_low=True)
        bodies = self._scene
        samples = self.options.samples
        start = bodies.data.time
        interval = duration / samples
        state = bodies.refresh()
        try:
            stored, touched = self._run(command, interval)
        except mujoco.FatalError:  # the engine is strict about bodies that wake in a chain
            bodies.wake_all(start, state)
            stored, touched = self._run(command, interval)
        bodies.check()
        bodies.settle(stored[-min(2, samples)], interval)
        bodies.data.time = start + duration
        times = start + interval * np.arange(1, samples + 1)
        times[-1] = bodies.data.time
        poses = bodies.planar(stored)
        self._held = touched and self._fell_short(poses[:, 0], command, interval)
        return Trace(
            frozen(times),
            frozen(np.ascontiguousarray(poses[:, 0])),
            frozen(np.ascontiguousarray(poses[:, 1:])),
        )

    def _run(self, command: Twist, interval: float) -> tuple[FloatArray, bool]:
        """Advance by one step.

        Returns:
            (samples, nq) positions after each interval [s], and whether the hull touched anything.
        """
        bodies = self._scene
        if bodies.afloat or self._world.robot.slides:
            bodies.ctrl[:] = command.linear, command.lateral, command.angular
        else:
            bodies.ctrl[:] = bodies.wheel_speeds(command.linear, command.angular)
        stored = np.empty((self.options.samples, bodies.model.nq))
        self._touched = touched = False
        for row in stored:
            bodies.advance(interval)
            row[:] = bodies.qpos
            static, anything = bodies.touches
            self._touched |= static
            touched |= anything
        return stored, touched

    def _fell_short(self, poses: FloatArray, command: Twist, interval: float) -> bool:
        """Return True if the robot's speed or turn rate is neither as commanded nor rising.

        Args:
            poses: (N, 3) of the robot, one interval apart; both halves are compared.
            command: what was asked.
            interval: [s].
        """
        robot = self._world.robot
        gains = self._scene.accelerations
        middle = len(poses) // 2
        halves = (poses[: middle + 1], poses[middle:])
        speed, bearing = command.course
        asked = speed, command.angular
        for i, limit in enumerate((robot.max_speed, robot.max_turn_rate)):
            wanted = abs(asked[i])
            if wanted < _NEGLIGIBLE * limit or not 0 < middle < len(poses) - 1:
                continue
            first, second = (
                math.copysign(1.0, asked[i]) * _rates(half, bearing)[i] / interval
                for half in halves
            )
            possible = min(gains[i] * middle * interval, wanted - first)
            if second < HELD_SHARE * wanted and second - first <= GAIN_SHARE * possible:
                return True
        return False

    def follow(self, path: ArrayLike) -> Interaction:
        """Drive the robot through poses at its full speed."""
        poses = checked_path(path)
        twist = np.zeros(3)
        if self._scene.afloat and len(poses) > 1:  # a ship is long in getting under way
            along = poses[1, :2] - poses[0, :2]
            speed = self._world.robot.max_speed / max(float(np.hypot(*along)), 1e-9)
            twist[:2] = speed * along
        start = self.world().moved(robot_pose=poses[0], robot_twist=twist)
        self.build(start, self._materials)
        found, jammed = follow_path(self, self._world.robot, poses)
        return Interaction(found, self._world.movables.masses, jammed)

    def _motion(self) -> tuple[float, FloatArray, FloatArray]:
        bodies = self._scene
        return bodies.data.time, bodies.poses(), bodies.twists()

    def _hidden(self) -> FloatArray:
        return self._scene.hidden()

    def restore(self, state: SimulatorState) -> None:
        """Go back to a saved state of the same scene.

        Raises:
            InvalidInputError: if the state is not one of this scene.
        """
        bodies = self._scene
        if state.hidden.shape != (bodies.hidden_size,):
            raise InvalidInputError(
                f"the state is of another scene: it has {state.hidden.size} hidden numbers, "
                f"this scene {bodies.hidden_size}"
            )
        self._held = self._touched = False
        bodies.load_hidden(state.time, state.hidden)

    def remove(self, object_ids: Sequence[int]) -> None:
        """Take objects off the floor."""
        world, gone = self._without(object_ids)
        touched = self._touched
        held = self._held
        hidden = self._scene.hidden_without(gone)
        self.build(world, self._materials)
        self._scene.load_hidden(world.time, hidden)
        self._touched = touched
        self._held = held

    def photograph(self, width: int, height: int) -> NDArray[np.uint8]:
        """(H, W, 3) picture of the whole scene, seen from the south and above.

        Raises:
            MissingDependencyError: if there is no way to draw without a display.
        """
        if self._camera is None or self._camera.size != (width, height):
            self._camera = MujocoCamera(self._scene.model, width, height)
        return self._camera.take(self._scene.qpos, self.world())


def _rates(poses: FloatArray, bearing: float) -> tuple[float, float]:
    """Mean way at a bearing [m] and turn [rad] from one of (N, 3) poses to the next."""
    first = poses[0]
    last = poses[-1]
    count = max(len(poses) - 1, 1)
    turn = math.remainder(float(last[2] - first[2]), math.tau)
    middle = float(first[2]) + 0.5 * turn + bearing
    way = (last[0] - first[0]) * math.cos(middle) + (last[1] - first[1]) * math.sin(middle)
    return float(way) / count, turn / count


def follow_path(
    simulator: Simulator, robot: RobotModel, poses: FloatArray
) -> tuple[FloatArray, int]:
    """Sweep the robot through poses (N, 3); it stands at the first.

    A reference moves straight from pose to pose at the robot's full speed and waits where the robot
    falls behind by more than half its radius. The command is the reference's own motion plus
    feedback on the error in the robot's frame (Kanayama et al. 1990):
    v = v_r cos e_θ + k_x e_x, ω = ω_r + v_r k_y e_y + k_θ sin e_θ.

    Returns:
        (N, K, 3) object poses when the reference was at each pose, and the index of the first pose
        that could not be reached, -1 if all were: the robot was held for one second, or for as
        long as it takes to drive its own radius if that is longer.
    """
    radius = robot.circumscribed_radius
    period = radius / robot.max_speed / _PERIODS_PER_RADIUS
    patience = max(_PATIENCE, radius / robot.max_speed)
    start = simulator.object_poses
    found = np.repeat(start[None], len(poses), axis=0)
    for leg in range(1, len(poses)):
        if not _drive_leg(simulator, robot, poses[leg - 1], poses[leg], period, patience):
            found[leg:] = simulator.object_poses
            return found, leg
        found[leg] = simulator.object_poses
    return found, -1


def _drive_leg(
    simulator: Simulator,
    robot: RobotModel,
    a: FloatArray,
    b: FloatArray,
    period: float,
    patience: float,
) -> bool:
    """Move the reference from ``a`` to ``b``; False if the robot was held on the way."""
    dx, dy, turn, duration = straight_leg(robot, a, b)
    if duration == 0.0:
        return True
    middle = float(a[2]) + 0.5 * turn
    speed = (dx * math.cos(middle) + dy * math.sin(middle)) / duration
    rate = turn / duration
    done = 0.0
    waited = 0.0
    while done < duration:
        fraction = done / duration
        reference = (
            float(a[0]) + fraction * dx,
            float(a[1]) + fraction * dy,
            float(a[2]) + fraction * turn,
        )
        x, y, theta = (float(value) for value in simulator.robot_pose)
        ex = reference[0] - x
        ey = reference[1] - y
        c = math.cos(theta)
        s = math.sin(theta)
        # where the reference is in the robot's frame
        ahead = c * ex + s * ey
        left = c * ey - s * ex
        turned = math.remainder(reference[2] - theta, math.tau)
        late = math.hypot(ahead, left) > _LATE * robot.circumscribed_radius
        late |= abs(turned) > _LATE
        part = period if late else min(period, duration - done)
        if robot.slides:
            pace = 2.0 * robot.max_speed / robot.circumscribed_radius
            vx = dx / duration + pace * ex
            vy = dy / duration + pace * ey
            command = Twist(c * vx + s * vy, rate + 2.0 * pace * turned, c * vy - s * vx)
        else:
            command = _command(robot, (ahead, left, turned), speed, rate)
        simulator.step(command, part)
        if late:
            waited += part
            if waited > patience:
                return False
        else:
            done += part
            waited = 0.0
    return True


def _command(
    robot: RobotModel, error: tuple[float, float, float], speed: float, rate: float
) -> Twist:
    """Kanayama's law with gains in units of the robot's radius, within its limits."""
    ahead, left, turned = error
    radius = robot.circumscribed_radius
    pace = robot.max_speed / radius
    v = speed * math.cos(turned) + 2.0 * pace * ahead
    w = rate + 4.0 * speed / radius**2 * left + 4.0 * pace * math.sin(turned)
    top = 1.2 * robot.max_speed
    turn = 1.2 * robot.max_turn_rate
    low = min(1.2 * robot.min_speed, 0.0)
    return Twist(min(max(v, low), top), min(max(w, -turn), turn))
