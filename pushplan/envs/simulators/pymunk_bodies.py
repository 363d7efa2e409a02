"""The bodies of one scene in a Pymunk space, read and written as arrays."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pymunk
import pymunk.batch as batch

from pushplan.envs.simulators.base import Materials
from pushplan.envs.simulators.momentum import Momentum
from pushplan.world import World
from pushplan.world.checks import FloatArray, IntArray

ROBOT = 1
OBJECT = 2
STATIC = 3
FIXED = 4
_GROUND = 1 << 31  # category of what is static, which wheels do not meet
CORRECTION = 0.2
"""Fraction of an overlap beyond the slop that is taken back in one substep."""
_POSE_AND_TWIST = (
    batch.BodyFields.POSITION
    | batch.BodyFields.ANGLE
    | batch.BodyFields.VELOCITY
    | batch.BodyFields.ANGULAR_VELOCITY
)
_FORCES = batch.BodyFields.FORCE | batch.BodyFields.TORQUE
_DEPTHS = batch.ArbiterFields.DISTANCE_1 | batch.ArbiterFields.DISTANCE_2
# the setters themselves: assignment goes through a check of every attribute's name
_body_class: Any = pymunk.Body
_set_velocity = _body_class.velocity.fset
_set_turn_rate = _body_class.angular_velocity.fset
_update_position = pymunk.Body.update_position


def _step_of(space: pymunk.Space) -> Callable[[float], None]:
    """`Space.step` without its care for what callbacks add or remove, of which ours do nothing.

    That care takes longer than a substep among a few bodies. A version of Pymunk that keeps the
    engine elsewhere is stepped as usual.
    """
    engine = getattr(getattr(pymunk, "_chipmunk", None), "lib", None)
    raw = getattr(engine, "cpSpaceStep", None)
    handle = getattr(space, "_space", None)
    if raw is None or handle is None:
        return space.step
    return partial(raw, handle)


class _Contacts:
    """Record of the collision callbacks. They hold this and not the space: no reference cycle."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        self.object_static = 0
        self.robot_static = 0
        self.robot_touched = False
        self.robot_depth = 0.0


class PymunkBodies:
    """One kinematic robot, K objects, dynamic or fixed, and what is static.

    Only the robot and those objects that `load` names are in the space; nothing happens to the
    others. Pose-and-twist rows are (1 + A, 6): x, y, theta, vx, vy, omega of the robot, then of
    each of the A loaded objects, world frame.

    Args:
        world: the scene; masses are the ones that the metrics count.
        materials: friction, rolling and floating.
        slop: overlap that the contact solver leaves alone [m].
        iterations: sweeps of the contact solver.
    """

    def __init__(self, world: World, materials: Materials, *, slop: float, iterations: int) -> None:
        self.space = pymunk.Space()
        # Every velocity is zeroed in each substep before contacts are solved. What a body carries
        # on from the substep before comes back as a force: see `_carry_on`.
        self.space.damping = 0.0
        # contacts of the last substep start the next one; 0 would drop contacts unsolved
        self.space.collision_persistence = 1
        self.space.collision_slop = slop
        self.space.iterations = iterations
        self._step = _step_of(self.space)
        self._h = 0.0
        self.contacts = _Contacts()
        self._buffer = batch.Buffer()
        self._arbiters = batch.Buffer()
        self._momentum = Momentum.of(world, materials)
        robot_mu, object_mu, static_mu = _shape_frictions(materials)
        self.robot = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        self._robot_shapes = self._make_robot(world, robot_mu)
        self._objects = self._make_objects(world, object_mu)
        self._active: IntArray = np.zeros(0, dtype=np.int64)
        self._bodies: list[pymunk.Body] = []
        self._shapes: list[pymunk.Shape] = []
        self._add_static(world, static_mu)
        self._watch()

    def load(self, active: IntArray, rows: FloatArray) -> None:
        """Put the robot and some objects into the space, and nothing else that moves.

        Contacts and corrections are forgotten, so that only the rows decide what follows: shapes
        that are added anew in the same order give the same broad phase, and so the same order in
        which contacts are solved.

        Args:
            active: (A,) indices of objects, increasing.
            rows: (1 + A, 6) where to place them.
        """
        if self._bodies and np.array_equal(active, self._active):
            self.space.remove(*self._shapes)
        else:
            self.space.remove(*self._shapes, *self._bodies)
            chosen = [self._objects[k] for k in active.tolist()]
            self._bodies = [self.robot, *(body for body, _ in chosen)]
            self._shapes = [*self._robot_shapes, *(shape for _, shape in chosen)]
            self.space.add(*self._bodies)
            self._carried = self._momentum.select(active)
            self._active = active
        self.write(rows)  # first, as the broad phase remembers where a shape was when it came
        self.space.add(*self._shapes)
        self.contacts.clear()

    def _add_static(self, world: World, friction: float) -> None:
        ground = self.space.static_body
        static = world.static
        shapes: list[pymunk.Shape] = [
            pymunk.Poly(ground, polygon.tolist()) for polygon in static.polygons
        ]
        for line, radius in zip(static.segments.tolist(), static.radii.tolist(), strict=True):
            shapes.append(pymunk.Segment(ground, tuple(line[:2]), tuple(line[2:]), radius))
        for shape in shapes:
            shape.friction = friction
            shape.collision_type = STATIC
            shape.filter = pymunk.ShapeFilter(categories=_GROUND)
        self.space.add(*shapes)

    def _make_robot(self, world: World, friction: float) -> list[pymunk.Shape]:
        shapes: list[pymunk.Shape] = []
        robot = world.robot
        for part in robot.parts:
            shape = pymunk.Poly(self.robot, part.tolist(), radius=robot.contact_radius)
            shape.friction = friction
            shape.collision_type = ROBOT
            shapes.append(shape)
        for wheel in shapes[len(shapes) - robot.wheel_parts :]:
            wheel.filter = pymunk.ShapeFilter(mask=pymunk.ShapeFilter.ALL_MASKS() ^ _GROUND)
        return shapes

    def _make_objects(
        self, world: World, friction: float
    ) -> list[tuple[pymunk.Body, pymunk.Shape]]:
        movables = world.movables
        made: list[tuple[pymunk.Body, pymunk.Shape]] = []
        for k in range(len(movables)):
            outline = movables.drawn_outline(k).tolist()
            radius = float(movables.contact_radii[k])
            mass = float(movables.masses[k])
            if movables.fixed[k]:
                body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
            else:
                body = pymunk.Body(mass, pymunk.moment_for_poly(mass, outline))
            shape = pymunk.Poly(body, outline, radius=radius)
            shape.friction = friction
            shape.collision_type = FIXED if movables.fixed[k] else OBJECT
            made.append((body, shape))
        return made

    def _watch(self) -> None:
        contacts = self.contacts

        def begin_object(arbiter: Any, space: Any, data: Any) -> None:
            contacts.object_static += 1

        def end_object(arbiter: Any, space: Any, data: Any) -> None:
            contacts.object_static -= 1

        def begin_robot(arbiter: Any, space: Any, data: Any) -> None:
            contacts.robot_static += 1
            contacts.robot_touched |= arbiter.shapes[1].collision_type == STATIC

        def end_robot(arbiter: Any, space: Any, data: Any) -> None:
            contacts.robot_static -= 1

        def measure_robot(arbiter: Any, space: Any, data: Any) -> None:
            for point in arbiter.contact_point_set.points:
                contacts.robot_depth = max(contacts.robot_depth, -point.distance)

        for still in (STATIC, FIXED):
            self.space.on_collision(OBJECT, still, begin=begin_object, separate=end_object)
            self.space.on_collision(
                ROBOT, still, begin=begin_robot, pre_solve=measure_robot, separate=end_robot
            )

    @property
    def static_contacts(self) -> int:
        """Number of touching pairs of a moving and a static shape."""
        return self.contacts.object_static + self.contacts.robot_static

    @property
    def depth(self) -> float:
        """Deepest overlap of any two bodies after the last `advance` [m], 0 if none."""
        self._arbiters.clear()
        batch.get_space_arbiters(self.space, _DEPTHS, self._arbiters)
        # a handful of numbers: quicker without making an array
        found = memoryview(self._arbiters.float_buf()).cast("d")
        return max(self.contacts.robot_depth, -min(found, default=0.0), 0.0)

    def snapshot(self) -> bytes:
        """The rows now, packed; `unpack` makes an array of them."""
        self._buffer.clear()
        batch.get_space_bodies(self.space, _POSE_AND_TWIST, self._buffer)
        return bytes(self._buffer.float_buf())

    def unpack(self, packed: bytes) -> FloatArray:
        """(1 + A, 6) rows of a `snapshot`; writeable."""
        return np.frombuffer(packed, dtype=np.float64).reshape(-1, 6)[: len(self._bodies)].copy()

    def read(self) -> FloatArray:
        """(1 + A, 6) rows now."""
        return self.unpack(self.snapshot())

    def write(self, rows: FloatArray) -> None:
        """Place every body and set its velocity; pending overlap corrections are dropped."""
        for body in self._bodies:
            _update_position(body, 0.0)  # empties the hidden correction velocity
        self._velocity = (math.nan, math.nan, math.nan)
        self._set(_POSE_AND_TWIST, rows)

    def _set(self, fields: batch.BodyFields, values: FloatArray) -> None:
        """Set something of every body; the ground comes last in the engine and stays at zero."""
        source = batch.Buffer()
        source.set_float_buf(np.concatenate([values, np.zeros((1, values.shape[1]))]))
        batch.set_space_bodies(self.space, fields, source)

    def slowed(self, rows: FloatArray, h: float) -> FloatArray:
        """The rows with the velocities that bodies keep when nothing touches them for ``h`` [s]."""
        kept = rows.copy()
        kept[:, 3:] = 0.0
        if self._carried is not None:
            kept[:, 3:] = self._carried.after(rows[:, 3:], h)
        return kept

    def drive(self, vx: float, vy: float, w: float) -> None:
        """Set the robot's velocity [m/s, m/s, rad/s], world frame."""
        if (vx, vy, w) != self._velocity:
            self._velocity = (vx, vy, w)
            _set_velocity(self.robot, (vx, vy))
            _set_turn_rate(self.robot, w)

    def advance(self, h: float) -> None:
        """One substep of ``h`` seconds."""
        self.contacts.robot_depth = 0.0
        if h != self._h:  # the engine wants the fraction of an overlap that is left after a second
            self._h = h
            self.space.collision_bias = max((1.0 - CORRECTION) ** (1.0 / h), 1e-300)
        if self._carried is not None:
            self._carry_on(self._carried, h)
        self._step(h)

    def march(
        self, chord: float, heading: float, held: float | None, w: float, h: float, count: int
    ) -> tuple[int, float]:
        """Substeps on an arc; the last one is the first in which something static is touched.

        Args:
            chord: speed along the chord of a substep [m/s].
            heading: of the robot [rad].
            held: direction that it keeps while it turns [rad]; None on an arc.
            w: turn rate [rad/s].
            h: length of a substep [s].
            count: how many at most.

        Returns:
            How many there were, and the heading after them.
        """
        contacts = self.contacts
        half = 0.5 * w * h
        for i in range(1, count + 1):
            middle = heading + half if held is None else held
            self.drive(chord * math.cos(middle), chord * math.sin(middle), w)
            self.advance(h)
            heading += w * h
            if contacts.object_static or contacts.robot_static:
                return i, heading
        return count, heading

    def _carry_on(self, carried: Momentum, h: float) -> None:
        """Give each body the force that restores what it keeps of its velocity.

        The engine zeroes velocities after it has moved the bodies and before it solves contacts,
        and adds force times ``h`` over mass in between.
        """
        velocities = self.unpack(self.snapshot())[:, 3:]
        self._set(_FORCES, carried.forces(carried.after(velocities, h), h))


def _shape_frictions(materials: Materials) -> tuple[float, float, float]:
    """Friction of robot, object and static shapes, whose products are those of the pairs."""
    own = math.sqrt(materials.object_object)
    if own == 0.0 and (materials.robot_object or materials.object_static):
        own = 1e-6  # boxes slide on each other and still grip the rest
    if own == 0.0:
        return 0.0, 0.0, 0.0
    return materials.robot_object / own, own, materials.object_static / own
