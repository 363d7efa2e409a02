"""The state of a MuJoCo scene as planar rows, and back, so that nothing else is remembered."""

from __future__ import annotations

import logging
import math
from typing import Any

import numpy as np

from pushplan.envs.simulators.base import Materials
from pushplan.envs.simulators.mujoco_library import mujoco
from pushplan.envs.simulators.mujoco_model import MujocoOptions, scene_model
from pushplan.envs.simulators.mujoco_sleep import (
    AWAKE,
    put_to_sleep,
    quiet_objects,
    rest_cycles,
    rest_gap,
)
from pushplan.world import PushplanError, World
from pushplan.world.checks import BoolArray, FloatArray, IntArray

_LOG = logging.getLogger(__name__)
_FASTEST = 1e8  # no velocity of a sane simulation exceeds this [m/s] or [rad/s]


def log_warnings() -> None:
    """Send MuJoCo's warnings to `logging`; it would write them to a file and to the console.

    Whoever has installed a handler of their own keeps it.
    """
    if mujoco.get_mju_user_warning() is None:
        mujoco.set_mju_user_warning(lambda text: _LOG.debug("MuJoCo: %s", text))


def scene_key(world: World, materials: Materials, options: MujocoOptions) -> tuple[Any, ...]:
    """The arguments of `scene_model`; equal where only poses and the goal differ."""
    objects = world.movables.moved_to(np.zeros((len(world.movables), 3)))
    return world.robot, world.static, objects, materials, options


class DivergedError(PushplanError, RuntimeError):
    """The engine's state is no longer finite."""


class MujocoBodies:
    """A model and its data, with a robot and K objects that are read and written as rows.

    Bodies on the ground have six degrees of freedom and the robot's wheels one each; floating
    bodies have three. Positions are ordered robot first, then objects.
    """

    def __init__(self, world: World, materials: Materials, options: MujocoOptions) -> None:
        log_warnings()
        self.key = scene_key(world, materials, options)
        self.model = scene_model(*self.key).__copy__()
        self.data = mujoco.MjData(self.model)
        self._water = materials.water
        self.afloat = materials.water is not None
        self.count = len(world.movables)
        solids = materials.solids
        assert solids is not None
        self._rest_height = 0.5 * solids.object_height
        self._wheel_radius = solids.wheel_radius
        self._track = world.robot.wheel_separation
        movables = world.movables
        self._outlines = movables.vertices, movables.offsets, movables.radii
        self._options = options
        self._gap = rest_gap(movables.radii)
        self.accelerations = math.inf, math.inf  # up to speed well within a step
        """Greatest accelerations of the robot's motors on free ground: [m/s²] and [rad/s²]."""
        if self.afloat:
            limits = self.model.actuator_forcerange[:, 1]
            inertia = self.model.body("robot").inertia.max()
            self.accelerations = options.thrust, float(limits[2] / inertia)
        model = self.model
        data = self.data
        self.qpos: FloatArray = data.qpos  # all positions and velocities, the engine's own arrays
        self.qvel: FloatArray = data.qvel
        self.ctrl = data.ctrl
        self._damping = model.dof_damping
        self._asleep = data.tree_asleep
        self._touch = data.sensordata
        first = 3 if self.afloat else 9
        self._first_q = first
        self._first_v = 3 if self.afloat else 8
        size_q, size_v = (3, 3) if self.afloat else (7, 6)
        self._objects_q = self.qpos[first:].reshape(-1, size_q)
        self._objects_v = self.qvel[self._first_v :].reshape(-1, size_v)
        self.hidden_size = model.nq + model.nv + model.ntree

    # ---------------------------------------------------------------- rows of planar states

    def place(self, world: World) -> None:
        """Put every body where the world says, upright on the ground, with its velocity.

        Objects at rest are asleep until something touches them.
        """
        assert world.robot_twist is not None
        model = self.model
        water = self._water
        self._drag = None if water is None else water.coefficients(world)
        qpos = np.array(model.qpos0)
        qvel = np.zeros(model.nv)
        poses = world.movables.poses
        twists = world.movables.twists
        if self.afloat:
            qpos[:3] = world.robot_pose
            qvel[:3] = world.robot_twist
            qpos[3:] = poses.ravel()
            qvel[3:] = twists.ravel()
        else:
            self._put_robot(qpos, qvel, world.robot_pose, world.robot_twist)
            rows = qpos[9:].reshape(-1, 7)
            rates = qvel[8:].reshape(-1, 6)
            rows[:, :2] = poses[:, :2]
            rows[:, 2] = self._rest_height
            rows[:, 3] = np.cos(0.5 * poses[:, 2])
            rows[:, 6] = np.sin(0.5 * poses[:, 2])
            rows[:, 4:6] = 0.0
            rates[:, :2] = twists[:, :2]
            rates[:, 5] = twists[:, 2]
        quiet: BoolArray = np.logical_not(twists.any(axis=1))
        asleep = rest_cycles(poses, *self._outlines, quiet, self._gap)
        self._load(world.time, qpos, qvel, asleep)

    def _put_robot(
        self, qpos: FloatArray, qvel: FloatArray, pose: FloatArray, twist: FloatArray
    ) -> None:
        """A robot whose wheels turn as fast as it moves."""
        x, y, theta = (float(value) for value in pose)
        qpos[:3] = x, y, self._wheel_radius
        qpos[3:7] = math.cos(0.5 * theta), 0.0, 0.0, math.sin(0.5 * theta)
        qvel[:2] = twist[:2]
        qvel[5] = twist[2]
        speed = float(twist[0]) * math.cos(theta) + float(twist[1]) * math.sin(theta)
        qvel[6:8] = self.wheel_speeds(speed, float(twist[2]))

    def wheel_speeds(self, linear: float, angular: float) -> tuple[float, float]:
        """Rates of the left and the right wheel [rad/s] of a motion without slip."""
        half = 0.5 * angular * self._track
        return (linear - half) / self._wheel_radius, (linear + half) / self._wheel_radius

    def planar(self, qpos: FloatArray) -> FloatArray:
        """(N, 1 + K, 3) poses of N stored positions (N, nq): robot, then objects."""
        if self.afloat:
            return np.array(qpos).reshape(len(qpos), 1 + self.count, 3)
        # the robot, two wheels, objects
        free = np.concatenate([qpos[:, :7], qpos[:, 9:]], axis=1)
        return planar_rows(free.reshape(len(qpos), 1 + self.count, 7))

    def poses(self) -> FloatArray:
        """(1 + K, 3) poses now."""
        rows: FloatArray = self.planar(self.qpos[None])[0]
        return rows

    def twists(self) -> FloatArray:
        """(1 + K, 3) velocities now, world frame."""
        if self.afloat:
            return np.array(self.qvel).reshape(-1, 3)
        rows = np.empty((1 + self.count, 6))
        rows[0] = self.qvel[:6]
        rows[1:] = self.qvel[8:].reshape(-1, 6)
        return np.ascontiguousarray(rows[:, [0, 1, 5]])

    # ---------------------------------------------------------------- state

    def hidden(self) -> FloatArray:
        """Positions, velocities and who sleeps, in one array."""
        return np.concatenate([self.qpos, self.qvel, self._asleep])

    def hidden_without(self, gone: IntArray) -> FloatArray:
        """Return `hidden` as it would be without some of the objects, given by index."""
        kept = np.delete(np.arange(self.count), gone)
        positions = self._objects_q[kept]
        velocities = self._objects_v[kept]
        asleep = np.full(len(kept), AWAKE)  # who rests is found out anew
        return np.concatenate(
            [
                self.qpos[: self._first_q],
                positions.ravel(),
                self.qvel[: self._first_v],
                velocities.ravel(),
                self._asleep[:1],
                asleep,
            ]
        )

    def load_hidden(self, time: float, hidden: FloatArray) -> None:
        """Go back to what `hidden` returned at some time [s]."""
        model = self.model
        qpos, qvel, asleep = np.split(hidden, [model.nq, model.nq + model.nv])
        self._load(time, qpos, qvel, asleep.astype(np.int32))

    def refresh(self) -> FloatArray:
        """Forget all but the state, as if it had just been loaded; returns that (`hidden`).

        MuJoCo keeps accelerations of the step before as a first guess of its solver, and computed
        quantities of sleeping bodies. With this at the beginning of each step of the simulator
        they are functions of the state, and the simulator is memoryless.
        """
        state = self.hidden()
        self.load_hidden(self.data.time, state)
        return state

    def wake_all(self, time: float, hidden: FloatArray) -> None:
        """Go back to what `hidden` returned, with every object awake."""
        awake = hidden.copy()
        awake[-self.model.ntree :] = AWAKE
        self.load_hidden(time, awake)

    def settle(self, before: FloatArray, interval: float) -> None:
        """Lay objects to rest that have stopped.

        Args:
            before: (nq,) positions one sample earlier.
            interval: since then [s].
        """
        if self.count == 0:
            return
        quiet = quiet_objects(
            self._objects_v,
            self._objects_q,
            before[self._first_q :].reshape(self._objects_q.shape),
            self._outlines[2],
            self._options.sleep_speed,
            interval,
        )
        if not quiet[self._asleep[1:] < 0].any():
            return  # nobody new
        asleep = rest_cycles(self.poses()[1:], *self._outlines, quiet, self._gap)
        self._objects_v[asleep[1:] >= 0] = 0.0
        put_to_sleep(self.model, self.data, asleep)

    def _load(self, time: float, qpos: FloatArray, qvel: FloatArray, asleep: Any) -> None:
        model = self.model
        data = self.data
        mujoco.mj_resetData(model, data)
        data.time = time
        self.qpos[:] = qpos
        self.qvel[:] = qvel
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_crb(model, data)
        mujoco.mj_factorM(model, data)
        put_to_sleep(model, data, asleep)

    # ---------------------------------------------------------------- stepping

    def advance(self, interval: float) -> None:
        """Let the engine run for ``interval`` [s], in steps that are short enough."""
        model = self.model
        data = self.data
        options = self._options
        longest = options.time_step
        if self.afloat:
            longest = options.water_time_step
        steps = max(1, math.ceil(interval / longest - 1e-9))
        model.opt.timestep = interval / steps
        if self._drag is None:
            mujoco.mj_step(model, data, steps)
            return
        most = max(1, int(options.drag_interval / model.opt.timestep))
        velocities = self.qvel.reshape(-1, 3)
        damping = self._damping.reshape(-1, 3)
        while steps > 0:
            damping[:] = drag_damping(velocities, self._drag)
            mujoco.mj_step(model, data, min(most, steps))
            steps -= most

    @property
    def touches(self) -> tuple[bool, bool]:
        """Flags of the hull in the engine's last step: touched something static, touched at all."""
        return bool(self._touch[0] > 0.0), bool(self._touch[1] > 0.0)

    def check(self) -> None:
        """Raise where the state is not finite.

        Raises:
            DivergedError: then.
        """
        if not np.abs(self.qvel).max() < _FASTEST:  # false for NaN, too
            raise DivergedError(
                "the MuJoCo simulation has diverged: bodies may overlap deeply at the start, or "
                "the time step be too long for the masses and forces of this scene"
            )


def drag_damping(velocities: FloatArray, drag: FloatArray) -> FloatArray:
    """Linear damping that equals combined linear and quadratic drag at the velocities now.

    Args:
        velocities: (B, 3) of floating bodies [m/s, m/s, rad/s].
        drag: (B, 4) linear and quadratic coefficients of translation, then of rotation.

    Returns:
        (B, 3) b + c |v|, [N s/m] and [N m s].
    """
    x, y, w = velocities.T
    along = drag[:, 0] + drag[:, 1] * np.sqrt(x * x + y * y)
    return np.column_stack([along, along, drag[:, 2] + drag[:, 3] * np.abs(w)])


def planar_rows(bodies: FloatArray) -> FloatArray:
    """(..., 3) planar poses of free bodies (..., 7): x, y, z [m] and a quaternion w, x, y, z."""
    w, x, y, z = (bodies[..., i] for i in range(3, 7))
    sines = 2.0 * (w * z + x * y)
    cosines = 1.0 - 2.0 * (y * y + z * z)
    rows = np.empty((*bodies.shape[:-1], 3))
    rows[..., :2] = bodies[..., :2]
    # not by NumPy, whose last digit depends on the processor
    angles = list(map(math.atan2, sines.ravel().tolist(), cosines.ravel().tolist()))
    rows[..., 2] = np.reshape(angles, sines.shape)
    return rows
