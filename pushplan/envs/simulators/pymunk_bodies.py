"""The bodies of one scene in a Pymunk space, and their addresses for the compiled core."""

from __future__ import annotations

import itertools
import math
from typing import Any

import pymunk

from pushplan.core import envs as core
from pushplan.envs.simulators.base import Materials
from pushplan.errors import MissingDependencyError
from pushplan.geometry import gyration_squares
from pushplan.world import World

ROBOT = 1
OBJECT = 2
STATIC = 3
FIXED = 4
_GROUND = 1 << 31  # category of what is static, which wheels do not meet

_FUNCTIONS = (
    *("cpSpaceStep", "cpSpaceSetCollisionBias", "cpSpaceEachCachedArbiter"),
    *("cpSpaceAddBody", "cpSpaceRemoveBody", "cpSpaceAddShape", "cpSpaceRemoveShape"),
    *("cpBodyGetPosition", "cpBodyGetAngle", "cpBodyGetVelocity", "cpBodyGetAngularVelocity"),
    *("cpBodySetPosition", "cpBodySetAngle", "cpBodySetVelocity", "cpBodySetAngularVelocity"),
    *("cpBodySetForce", "cpBodySetTorque", "cpBodyUpdatePosition"),
    *("cpArbiterGetCount", "cpArbiterGetDepth", "cpArbiterGetContactPointSet"),
)
"""Functions of the engine in the order of `Chipmunk` in ``core/include/pushplan/envs``."""


class PymunkBodies:
    """One kinematic robot, K objects, dynamic or fixed, and what is static.

    Only what is static is in the space. The core puts the robot and the objects that can move into
    it, and drives the engine by the addresses that are here.

    Args:
        world: the scene; masses are the ones that the metrics count.
        materials: friction.
        slop: overlap that the contact solver leaves alone [m].
        iterations: sweeps of the contact solver.

    Attributes:
        functions: of the engine, in the order of the core's `Chipmunk`.
        handles: of the space, of the bodies (the robot first), and of the shapes of each.

    Raises:
        MissingDependencyError: if this version of Pymunk does not give access to its engine.
    """

    def __init__(self, world: World, materials: Materials, *, slop: float, iterations: int) -> None:
        self.space = pymunk.Space()
        # Every velocity is zeroed in each substep before contacts are solved. What a body carries
        # on from the substep before comes back as a force, which the core sets.
        self.space.damping = 0.0
        # contacts of the last substep start the next one; 0 would drop contacts unsolved
        self.space.collision_persistence = 1
        self.space.collision_slop = slop
        self.space.iterations = iterations
        robot_mu, object_mu, static_mu = _shape_frictions(materials)
        self._robot = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        self._robot_shapes = self._make_robot(world, robot_mu)
        self._add_static(world, static_mu)
        try:
            from pymunk._chipmunk import ffi, lib

            self._ffi = ffi
            self._lib = lib
            self._objects = self._make_objects(world, object_mu)
            self._find_addresses()
        except (ImportError, AttributeError, TypeError) as error:
            raise MissingDependencyError(
                f"pymunk {pymunk.version} does not give access to its engine as 7.3 does "
                f"({error}): pip install 'pymunk>=7.3,<8'"
            ) from error

    def _find_addresses(self) -> None:
        ffi = self._ffi
        points = ffi.sizeof("cpContactPointSet")
        if ffi.sizeof("cpFloat") != 8 or points != core.contact_points_size():
            raise TypeError(f"its numbers and points of contact have other sizes, {points} bytes")

        def address(of: Any) -> int:
            return int(ffi.cast("uintptr_t", of))

        self.functions = [address(ffi.addressof(self._lib, name)) for name in _FUNCTIONS]
        robot = (self._robot._body, [part._shape for part in self._robot_shapes])
        self._moving = bodies = [robot, *self._objects]
        self.handles = (
            address(self.space._space),
            [address(body) for body, _ in bodies],
            [[address(shape) for shape in shapes] for _, shapes in bodies],
        )

    @property
    def shapes_so_far(self) -> int:
        """Number of times that a shape came into the space."""
        return int(self._lib.cpSpaceGetShapeIDCounter(self.space._space))

    def go_on_from(self, came: int, most: int) -> None:
        """Restore the order of contacts after ``came`` shapes were added, at most ``most`` at once.

        The engine numbers shapes as they come, and lists them by number in a table that grows.
        """
        lib = self._lib
        space = self.space._space
        bodies = [body for body, _ in self._moving]
        shapes = [shape for _, own in self._moving for shape in own][:most]
        for change, changed in (
            (lib.cpSpaceAddBody, bodies),
            (lib.cpSpaceAddShape, shapes),
            (lib.cpSpaceRemoveShape, shapes),
            (lib.cpSpaceRemoveBody, bodies),
        ):
            for one in changed:
                change(space, one)
        lib.cpSpaceSetShapeIDCounter(space, came)

    def watch(self, record: int) -> None:
        """Let the engine report contacts of moving and static shapes to a record of the core."""
        ffi = self._ffi
        for kind, still in itertools.product((ROBOT, OBJECT), (STATIC, FIXED)):
            handler = self._lib.cpSpaceAddCollisionHandler(self.space._space, kind, still)
            begin, touch, end = core.contact_callbacks(kind == ROBOT, still == FIXED)
            handler.beginFunc = ffi.cast("cpCollisionBeginFunc", begin)
            if touch:
                handler.preSolveFunc = ffi.cast("cpCollisionPreSolveFunc", touch)
            handler.separateFunc = ffi.cast("cpCollisionSeparateFunc", end)
            handler.userData = ffi.cast("void *", record)

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
            shape = pymunk.Poly(self._robot, part.tolist(), radius=robot.contact_radius)
            shape.friction = friction
            shape.collision_type = ROBOT
            shapes.append(shape)
        for wheel in shapes[len(shapes) - robot.wheel_parts :]:
            wheel.filter = pymunk.ShapeFilter(mask=pymunk.ShapeFilter.ALL_MASKS() ^ _GROUND)
        return shapes

    def _make_objects(self, world: World, friction: float) -> list[tuple[Any, list[Any]]]:
        """Make the body and the shapes of each object.

        Pymunk's classes take four times as long, and there may be hundreds of floes of which the
        engine needs a few dozen.
        """
        ffi = self._ffi
        lib = self._lib
        movables = world.movables
        made: list[tuple[Any, list[Any]]] = []
        here = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0)  # the transform that changes nothing
        radii = movables.contact_radii.tolist()
        given = movables.gyration_radii.tolist()
        squares = given
        if movables.is_compound or any(given):
            squares = gyration_squares(movables).tolist()
        for k, mass in enumerate(movables.masses.tolist()):
            fixed = bool(movables.fixed[k])
            parts = [
                (len(part), ffi.from_buffer("cpVect[]", part)) for part in movables.drawn_parts(k)
            ]
            if fixed:
                body = lib.cpBodyNewKinematic()
            elif len(parts) > 1 or given[k]:
                body = lib.cpBodyNew(mass, mass * squares[k])
            else:
                body = lib.cpBodyNew(mass, lib.cpMomentForPoly(mass, *parts[0], (0.0, 0.0), 0.0))
            shapes = []
            for corners in parts:
                shape = lib.cpPolyShapeNew(body, *corners, here, radii[k])
                lib.cpShapeSetFriction(shape, friction)
                lib.cpShapeSetCollisionType(shape, FIXED if fixed else OBJECT)
                shapes.append(ffi.gc(shape, lib.cpShapeFree))
            made.append((ffi.gc(body, lib.cpBodyFree), shapes))
        return made


def _shape_frictions(materials: Materials) -> tuple[float, float, float]:
    """Friction of robot, object and static shapes, whose products are those of the pairs."""
    own = math.sqrt(materials.object_object)
    if own == 0.0 and (materials.robot_object or materials.object_static):
        own = 1e-6  # boxes slide on each other and still grip the rest
    if own == 0.0:
        return 0.0, 0.0, 0.0
    return materials.robot_object / own, own, materials.object_static / own
