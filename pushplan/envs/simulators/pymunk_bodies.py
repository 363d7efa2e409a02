"""The bodies of one scene in a Pymunk space, read and written as arrays."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pymunk
import pymunk.batch as batch

from pushplan.envs.simulators.base import Materials
from pushplan.world import World
from pushplan.world.checks import BoolArray, FloatArray

ROBOT, OBJECT, STATIC = 1, 2, 3
CORRECTION = 0.2
"""Share of an overlap beyond the slop that is taken back in one substep."""
_POSE_AND_TWIST = (
    batch.BodyFields.POSITION
    | batch.BodyFields.ANGLE
    | batch.BodyFields.VELOCITY
    | batch.BodyFields.ANGULAR_VELOCITY
)
_DEPTHS = batch.ArbiterFields.DISTANCE_1 | batch.ArbiterFields.DISTANCE_2
# the setters themselves: assignment goes through a check of every attribute's name
_body_class: Any = pymunk.Body
_set_velocity = _body_class.velocity.fset
_set_turn_rate = _body_class.angular_velocity.fset


class _Contacts:
    """What the collision callbacks write. They hold this and not the space: no reference cycle."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        self.object_static = 0
        self.robot_static = 0
        self.robot_touched = False
        self.robot_depth = 0.0


class PymunkBodies:
    """One kinematic robot, K dynamic objects and what is static.

    Args:
        world: the scene; masses are the ones that the metrics count.
        materials: friction and rolling.
        slop: overlap that the contact solver leaves alone [m].
        iterations: sweeps of the contact solver.

    Pose-and-twist rows are (1 + K, 6): x, y, theta, vx, vy, omega of the robot, then of each
    object, world frame.
    """

    def __init__(self, world: World, materials: Materials, *, slop: float, iterations: int) -> None:
        self.space = pymunk.Space()
        self.space.damping = 0.0
        # contacts of the last substep start the next one; 0 would drop contacts unsolved
        self.space.collision_persistence = 1
        self.space.collision_slop = slop
        self.space.iterations = iterations
        self.rolling: BoolArray = np.concatenate([[False], world.movables.wheeled])
        self._h = 0.0
        self._contacts = _Contacts()
        self._buffer = batch.Buffer()
        self._arbiters = batch.Buffer()
        robot_mu, object_mu, static_mu = _shape_frictions(materials)
        self.robot = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        self.objects: list[pymunk.Body] = []
        self._moving: list[pymunk.Shape] = []
        self._add_robot(world, robot_mu)
        self._add_objects(world, object_mu, materials.rolling_time)
        self._add_static(world, static_mu)
        self._rows = self._find_rows()
        self._watch()

    def _add_static(self, world: World, friction: float) -> None:
        ground, static = self.space.static_body, world.static
        shapes: list[pymunk.Shape] = [
            pymunk.Poly(ground, polygon.tolist()) for polygon in static.polygons
        ]
        for line, radius in zip(static.segments.tolist(), static.radii.tolist(), strict=True):
            shapes.append(pymunk.Segment(ground, tuple(line[:2]), tuple(line[2:]), radius))
        for shape in shapes:
            shape.friction, shape.collision_type = friction, STATIC
        self.space.add(*shapes)

    def _add_robot(self, world: World, friction: float) -> None:
        self.space.add(self.robot)
        for part in world.robot.parts:
            shape = pymunk.Poly(self.robot, part.tolist())
            shape.friction, shape.collision_type = friction, ROBOT
            self._moving.append(shape)
        self.space.add(*self._moving)

    def _add_objects(self, world: World, friction: float, rolling_time: float) -> None:
        movables = world.movables
        for k in range(len(movables)):
            outline = movables.outline(k).tolist()
            mass = float(movables.masses[k])
            body = pymunk.Body(mass, pymunk.moment_for_poly(mass, outline))
            if movables.wheeled[k]:
                body.velocity_func = _roll(rolling_time)
            shape = pymunk.Poly(body, outline)
            shape.friction, shape.collision_type = friction, OBJECT
            self.space.add(body, shape)
            self.objects.append(body)
            self._moving.append(shape)

    def _find_rows(self) -> slice:
        """Where the moving bodies stand in what the batch call returns."""
        self._buffer.clear()
        batch.get_space_bodies(self.space, batch.BodyFields.BODY_ID, self._buffer)
        found = np.frombuffer(self._buffer.int_buf(), dtype=np.uintp).tolist()
        wanted = [body.id for body in (self.robot, *self.objects)]
        first = found.index(wanted[0])
        assert found[first : first + len(wanted)] == wanted
        return slice(first, first + len(wanted))

    def _watch(self) -> None:
        contacts = self._contacts

        def begin_object(arbiter: Any, space: Any, data: Any) -> None:
            contacts.object_static += 1

        def end_object(arbiter: Any, space: Any, data: Any) -> None:
            contacts.object_static -= 1

        def begin_robot(arbiter: Any, space: Any, data: Any) -> None:
            contacts.robot_static += 1
            contacts.robot_touched = True

        def end_robot(arbiter: Any, space: Any, data: Any) -> None:
            contacts.robot_static -= 1

        def measure_robot(arbiter: Any, space: Any, data: Any) -> None:
            for point in arbiter.contact_point_set.points:
                contacts.robot_depth = max(contacts.robot_depth, -point.distance)

        self.space.on_collision(OBJECT, STATIC, begin=begin_object, separate=end_object)
        self.space.on_collision(
            ROBOT, STATIC, begin=begin_robot, pre_solve=measure_robot, separate=end_robot
        )

    def __len__(self) -> int:
        return 1 + len(self.objects)

    @property
    def robot_touched(self) -> bool:
        """Whether the robot touched something static since `forget_contacts`."""
        return self._contacts.robot_touched

    @property
    def static_contacts(self) -> int:
        """How many pairs of a moving and a static shape touch."""
        return self._contacts.object_static + self._contacts.robot_static

    @property
    def depth(self) -> float:
        """Deepest overlap of any two bodies after the last `advance` [m], 0 if none."""
        self._arbiters.clear()
        batch.get_space_arbiters(self.space, _DEPTHS, self._arbiters)
        # a handful of numbers: quicker without making an array
        found = memoryview(self._arbiters.float_buf()).cast("d")
        return max(self._contacts.robot_depth, -min(found, default=0.0), 0.0)

    @property
    def heading(self) -> float:
        """Heading of the robot [rad]."""
        return float(self.robot.angle)

    def snapshot(self) -> bytes:
        """The rows now, packed; `unpack` makes an array of them."""
        self._buffer.clear()
        batch.get_space_bodies(self.space, _POSE_AND_TWIST, self._buffer)
        return bytes(self._buffer.float_buf())

    def unpack(self, packed: bytes) -> FloatArray:
        """(1 + K, 6) rows of a `snapshot`; writeable."""
        return np.frombuffer(packed, dtype=np.float64).reshape(-1, 6)[self._rows].copy()

    def read(self) -> FloatArray:
        """(1 + K, 6) rows now."""
        return self.unpack(self.snapshot())

    def write(self, rows: FloatArray) -> None:
        """Place every body and set its velocity; pending overlap corrections are dropped."""
        for body, row in zip((self.robot, *self.objects), rows.tolist(), strict=True):
            pymunk.Body.update_position(body, 0.0)  # empties the hidden correction velocity
            body.position = row[0], row[1]
            body.angle = row[2]
            body.velocity = row[3], row[4]
            body.angular_velocity = row[5]

    def forget_contacts(self) -> None:
        """Drop contacts and corrections, so that only poses and velocities decide what follows.

        Shapes that are added anew in the same order give the same broad phase, and so the same
        order in which contacts are solved.
        """
        for body in self.objects:
            pymunk.Body.update_position(body, 0.0)
        self.space.remove(*self._moving)
        self.space.add(*self._moving)
        self._contacts.clear()

    def drive(self, vx: float, vy: float, w: float) -> None:
        """Set the robot's velocity [m/s, m/s, rad/s], world frame."""
        _set_velocity(self.robot, (vx, vy))
        _set_turn_rate(self.robot, w)

    def advance(self, h: float) -> None:
        """One substep of ``h`` seconds."""
        self._contacts.robot_depth = 0.0
        if h != self._h:  # the engine wants the share of an overlap that is left after a second
            self._h = h
            self.space.collision_bias = max((1.0 - CORRECTION) ** (1.0 / h), 1e-300)
        self.space.step(h)


def _shape_frictions(materials: Materials) -> tuple[float, float, float]:
    """Friction of robot, object and static shapes, whose products are those of the pairs."""
    own = math.sqrt(materials.object_object)
    if own == 0.0 and (materials.robot_object or materials.object_static):
        own = 1e-6  # boxes slide on each other and still grip the rest
    if own == 0.0:
        return 0.0, 0.0, 0.0
    return materials.robot_object / own, own, materials.object_static / own


def _roll(rolling_time: float) -> Any:
    def velocity(body: Any, gravity: Any, damping: float, h: float) -> None:
        pymunk.Body.update_velocity(body, (0.0, 0.0), math.exp(-h / rolling_time), h)

    return velocity
