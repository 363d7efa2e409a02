"""The planar reference simulator, on Pymunk (Chipmunk). See docs/simulators.md for its accuracy."""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from pushplan.envs.simulators.base import Materials, Simulator, SimulatorState
from pushplan.envs.simulators.pymunk_bodies import PymunkBodies
from pushplan.envs.trace import Trace
from pushplan.interaction.model import Interaction
from pushplan.world import InvalidInputError, Twist, World
from pushplan.world.checks import FloatArray, array, frozen, integer, number


@dataclass(frozen=True)
class PymunkOptions:
    """Numerical settings. Lengths are fractions of the radius of the smallest object.

    Args:
        travel: how far the fastest point of the robot may move in one substep. At the default
            (2.8 mm for a 1 m box) boxes end where substeps ten times finer put them to 0.2 % of
            their size (median) and total work agrees to 0.1 %: docs/simulators.md has the table.
        slop: overlap that the contact solver leaves alone. It has to be small against an object,
            because an object rides that far inside its pusher, and not much smaller than
            ``travel``, because an object that is pushed out of contact in each substep is hit
            again in the next and chatters.
        tolerance: overlap at which the robot is held, when something static is involved.
        iterations: sweeps of the contact solver in each substep.
        samples: poses recorded in each call of `PymunkSimulator.step`, at even intervals.
    """

    travel: float = 0.004
    slop: float = 0.0015
    tolerance: float = 0.012
    iterations: int = 20
    samples: int = 8

    def __post_init__(self) -> None:
        for key in ("travel", "slop", "tolerance"):
            value = number(f"pymunk {key}", getattr(self, key), low=0.0, high=0.2, open_low=True)
            object.__setattr__(self, key, value)
        for key in ("iterations", "samples"):
            integer(f"pymunk {key}", getattr(self, key), low=1)
        if self.tolerance < self.travel + self.slop:
            raise InvalidInputError(
                f"pymunk tolerance must be at least travel + slop = "
                f"{self.travel + self.slop:g}, got {self.tolerance:g}"
            )


class _Moved(enum.Enum):
    """What came of a substep."""

    ALL = enum.auto()
    SOME = enum.auto()
    NOTHING = enum.auto()
    TOO_FAR = enum.auto()


class PymunkSimulator(Simulator):
    """A kinematic robot among objects that stop at once when nothing pushes them.

    Every velocity is zeroed in each substep before contacts are solved (``damping = 0``), so the
    world is quasi-static; a wheeled object keeps a decaying part of its velocity instead. Contacts
    are solved from scratch at the beginning of each call of `step`: that makes the simulator
    memoryless, as the contract wants.

    Jams: a kinematic robot has no limit of force, and would press an object through a wall. So a
    substep after which some overlap has grown past the tolerance, while something static is
    touched, is taken back. Until the next sample the robot then turns on the spot as commanded
    or, where that is no better, turns and gives way backwards; if it can do neither it stays where
    it is for the rest of the step.
    """

    name = "pymunk"

    def __init__(self, options: PymunkOptions | None = None) -> None:
        self.options = options or PymunkOptions()
        self._held = False
        self._deepest = 0.0
        self._yielding = 0.0

    def build(self, world: World, materials: Materials) -> None:
        """Replace the scene with this one."""
        options, robot = self.options, world.robot
        radii = world.movables.radii
        self._size = float(radii.min()) if len(radii) else max(robot.inscribed_radius, 1e-3)
        self._materials = materials
        self._world = world
        self._bodies = PymunkBodies(
            world, materials, slop=options.slop * self._size, iterations=options.iterations
        )
        fastest = max(abs(robot.min_speed), abs(robot.max_speed))
        self._rim_speed = fastest + robot.max_turn_rate * robot.circumscribed_radius
        self._time = world.time
        self._bodies.write(_rows(world))
        self._held = False

    def step(self, command: Twist, duration: float) -> Trace:
        """Drive at a body-frame velocity for ``duration`` [s]."""
        samples = self.options.samples
        wanted = duration * self._rim_speed / (self.options.travel * self._size)
        each = max(1, math.ceil(wanted / samples))
        h = duration / (samples * each)
        start = self._bodies.read()
        rows = self._drive(command, h, each, careful=False)
        if rows is None:
            self._bodies.write(start)
            rows = self._drive(command, h, each, careful=True)
            assert rows is not None
        times = self._time + h * each * np.arange(1, samples + 1)
        self._time += duration
        times[-1] = self._time
        poses = rows[..., :3]
        return Trace(
            frozen(times),
            frozen(np.ascontiguousarray(poses[:, 0])),
            frozen(np.ascontiguousarray(poses[:, 1:])),
        )

    def _drive(self, command: Twist, h: float, each: int, *, careful: bool) -> FloatArray | None:
        """Run the substeps of one step.

        Args:
            command: the velocity in the body frame.
            h: length of a substep [s].
            each: substeps between two samples.
            careful: keep a way back from every substep. Otherwise only where something static
                is touched already, which is enough nearly always.

        Returns:
            (samples, 1 + K, 6) rows, or None if a way back was missing: begin again, carefully.
        """
        bodies, w = self._bodies, command.angular
        half = 0.5 * w * h
        # the chord of an arc is shorter than the arc by sin(x) / x
        chord = command.linear * (math.sin(half) / half if half else 1.0)
        bodies.forget_contacts()
        self._held = False
        rows = np.empty((self.options.samples, len(bodies), 6))
        heading = bodies.heading
        outcome = _Moved.ALL
        for i in range(len(rows)):
            advancing = chord  # a robot that is held tries again after the next sample
            for j in range(each):
                middle = heading + half
                vx, vy = advancing * math.cos(middle), advancing * math.sin(middle)
                first = i == 0 and j == 0
                outcome = self._substep(vx, vy, w, h, first=first, careful=careful)
                if outcome is _Moved.TOO_FAR:
                    return None
                if outcome is _Moved.NOTHING:  # nor will it in the rest of the step
                    rows[i:] = bodies.read()
                    return rows
                if outcome is _Moved.SOME:
                    advancing = self._yielding
                    heading = bodies.heading
                else:
                    heading += w * h
            rows[i] = bodies.read()
        return rows

    def follow(self, path: ArrayLike) -> Interaction:
        """Sweep the robot straight from pose to pose at its full speed."""
        poses: FloatArray = array("path", path, (None, 3))
        if len(poses) == 0:
            raise InvalidInputError("path must hold at least one pose")
        bodies = self._bodies
        start = bodies.read()
        start[0] = [*poses[0], 0.0, 0.0, 0.0]
        bodies.write(start)
        bodies.forget_contacts()
        found = np.empty((len(poses), len(start) - 1, 3))
        found[0] = start[1:, :3]
        jammed = -1
        for leg in range(1, len(poses)):
            if jammed < 0 and not self._sweep(poses[leg - 1], poses[leg], first=leg == 1):
                jammed = leg
                found[leg:] = bodies.read()[1:, :3]
            if jammed < 0:
                found[leg] = bodies.read()[1:, :3]
        return Interaction(found, self._world.movables.masses, jammed)

    def _sweep(self, a: FloatArray, b: FloatArray, *, first: bool) -> bool:
        """Drive straight between two poses; whether the robot got there."""
        robot = self._world.robot
        dx, dy = float(b[0] - a[0]), float(b[1] - a[1])
        turn = math.remainder(float(b[2] - a[2]), 2.0 * math.pi)
        length = math.hypot(dx, dy)
        duration = max(length / robot.max_speed, abs(turn) / robot.max_turn_rate)
        if duration == 0.0:
            return True
        reach = length + abs(turn) * robot.circumscribed_radius
        count = max(1, math.ceil(reach / (self.options.travel * self._size)))
        h = duration / count
        for i in range(count):
            outcome = self._substep(
                *(dx / duration, dy / duration, turn / duration, h),
                first=first and i == 0,
                careful=True,
            )
            if outcome is not _Moved.ALL:
                return False
        self._time += duration
        return True

    def _substep(
        self, vx: float, vy: float, w: float, h: float, *, first: bool, careful: bool
    ) -> _Moved:
        """Move everything by ``h`` seconds, the robot at a velocity in the world frame."""
        bodies = self._bodies
        limit = self.options.tolerance * self._size
        # a jam needs something static, so most substeps do without the check
        if not (first or careful or bodies.static_contacts):
            return _Moved.ALL if self._try(vx, vy, w, h, limit) else _Moved.TOO_FAR
        packed = bodies.snapshot()
        allowed = limit if first else max(limit, self._deepest)
        if self._try(vx, vy, w, h, allowed):
            return _Moved.ALL
        before = bodies.unpack(packed)
        resting = before.copy()
        resting[:, 3:] *= bodies.rolling[:, None]
        if first:  # the scene may have begun with deeper overlaps: no reason to hold the robot
            still = before.copy()
            still[:, 3:] = 0.0
            bodies.write(still)
            self._try(0.0, 0.0, 0.0, h, math.inf)
            allowed = max(limit, self._deepest)
            bodies.write(before)
            if self._try(vx, vy, w, h, allowed):
                return _Moved.ALL
        self._held = True
        heading = float(before[0, 2])
        for speed in (0.0, -abs(w) * self._world.robot.circumscribed_radius) if w else ():
            bodies.write(resting)
            if self._try(speed * math.cos(heading), speed * math.sin(heading), w, h, allowed):
                self._yielding = speed
                return _Moved.SOME
        bodies.write(resting)
        if resting[1:, 3:].any() and self._try(0.0, 0.0, 0.0, h, allowed):
            self._yielding = 0.0
            return _Moved.SOME
        resting[:, 3:] = 0.0
        bodies.write(resting)
        return _Moved.NOTHING

    def _try(self, vx: float, vy: float, w: float, h: float, allowed: float) -> bool:
        """Advance by ``h`` [s]; whether no overlap beyond ``allowed`` [m] has come of it."""
        bodies = self._bodies
        bodies.drive(vx, vy, w)
        bodies.advance(h)
        depth = bodies.depth if bodies.static_contacts else 0.0
        if depth <= allowed:
            self._deepest = depth
            return True
        return False

    def world(self) -> World:
        """A snapshot of the scene now."""
        rows = self._bodies.read()
        return replace(
            self._world,
            robot_pose=rows[0, :3],
            robot_twist=rows[0, 3:],
            movables=self._world.movables.moved_to(rows[1:, :3], rows[1:, 3:]),
            time=self._time,
        )

    def save(self) -> SimulatorState:
        """The state now."""
        rows = self._bodies.read()
        return SimulatorState(
            self._time,
            frozen(rows[0, :3]),
            frozen(rows[0, 3:]),
            frozen(rows[1:, :3]),
            frozen(rows[1:, 3:]),
        )

    def restore(self, state: SimulatorState) -> None:
        """Go back to a saved state of the same scene."""
        robot = np.concatenate([state.robot_pose, state.robot_twist])
        objects = np.concatenate([state.object_poses, state.object_twists], axis=1)
        self._time = state.time
        self._held = False
        self._bodies.write(np.concatenate([robot[None], objects]))

    @property
    def robot_pose(self) -> FloatArray:
        """(3,) pose of the robot now."""
        robot = self._bodies.robot
        return np.array([*robot.position, robot.angle])

    @property
    def object_poses(self) -> FloatArray:
        """(K, 3) poses of the objects now."""
        return self._bodies.read()[1:, :3]

    def remove(self, object_ids: Sequence[int]) -> None:
        """Take objects off the floor."""
        world = self.world()
        keep = ~np.isin(world.movables.ids, object_ids)
        if len(object_ids) != (~keep).sum():
            raise InvalidInputError(
                f"cannot remove {list(object_ids)}, valid ids: {world.movables.ids.tolist()}"
            )
        self.build(replace(world, movables=world.movables.select(keep)), self._materials)

    @property
    def touched_static(self) -> bool:
        """Whether the robot touched something static during the last step."""
        return self._bodies.robot_touched

    @property
    def held(self) -> bool:
        """Whether the robot was kept from moving as commanded during the last step."""
        return self._held


def _rows(world: World) -> FloatArray:
    """(1 + K, 6) pose and twist of the robot and then of each object."""
    assert world.robot_twist is not None
    rows = np.zeros((1 + len(world.movables), 6))
    rows[0, :3], rows[0, 3:] = world.robot_pose, world.robot_twist
    rows[1:, :3], rows[1:, 3:] = world.movables.poses, world.movables.twists
    return rows
