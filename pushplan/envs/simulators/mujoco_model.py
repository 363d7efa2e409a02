"""The MuJoCo model of a scene, and a small store of models that were compiled before."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import mujoco
import numpy as np

from pushplan.envs.simulators.base import Materials, Solids
from pushplan.envs.simulators.mujoco_options import MujocoOptions
from pushplan.envs.simulators.mujoco_robot import (
    GRAVITY,
    add_floating,
    add_ship,
    add_wheeled_robot,
    palette_of,
)
from pushplan.envs.simulators.mujoco_shapes import (
    FLOOR_BIT,
    OBJECT_BIT,
    STATIC_BIT,
    WHEEL_BIT,
    Surface,
    add_prism,
    color_of,
    prism_inertia,
    set_mass,
    yaw_quaternion,
)
from pushplan.world import InvalidInputError, Movables, RobotModel, StaticMap, World
from pushplan.world.checks import FloatArray

_CASTER_BALL = (0.25, 0.25, 0.27)
_HOLDING = 1e7  # damping of a fixed object over its mass [1/s]


@dataclass(frozen=True)
class SceneKey:
    """What a compiled model depends on: everything but poses and the goal."""

    robot: RobotModel
    static: StaticMap
    materials: Materials
    options: MujocoOptions
    shapes: bytes  # what counts of the objects
    movables: Movables = field(compare=False)

    @classmethod
    def of(cls, world: World, materials: Materials, options: MujocoOptions) -> SceneKey:
        """The key of a scene."""
        m = world.movables
        shapes = (m.vertices + 0.0, m.offsets, m.masses, m.wheeled, m.fixed)
        packed = b"".join(part.tobytes() for part in shapes)
        return cls(world.robot, world.static, materials, options, packed, m)


@lru_cache(maxsize=8)
def scene_model(key: SceneKey) -> Any:
    """The MjModel of a scene, to be copied; compiled anew where it is none of the last few.

    Raises:
        InvalidInputError: if the scene has no third dimension, or the robot neither wheels nor
            water.
    """
    solids, robot, movables = key.materials.solids, key.robot, key.movables
    if solids is None:
        raise InvalidInputError("MuJoCo needs materials.solids: the heights of everything")
    afloat = key.materials.water is not None
    if not afloat and robot.wheel_separation == 0.0:
        raise InvalidInputError(
            f"robot {robot.name!r} needs wheels on dry ground: robot.wheel_separation must be > 0"
        )
    spec = mujoco.MjSpec()
    _set_options(spec, key, afloat)
    _add_ground(spec, key)
    _add_static(spec, key, solids)
    if afloat:
        add_ship(spec, robot, key.materials, solids, key.options)
    else:
        add_wheeled_robot(spec, robot, key.materials, solids, key.options)
    for k in range(len(movables)):
        _add_object(spec, k, movables, key.materials, solids)
    _add_touch(spec)
    try:
        model = spec.compile()
    except ValueError as error:
        raise InvalidInputError(f"MuJoCo cannot build this scene: {error}") from error
    if not afloat:
        _set_damping(model, movables, key.materials)
    return model


def _add_touch(spec: Any) -> None:
    """Sensors that say how many contacts the hull has: with something static, and with anything."""
    body = mujoco.mjtObj.mjOBJ_BODY
    number_found = 1 << int(mujoco.mjtConDataField.mjCONDATA_FOUND)
    hull = {"objtype": body, "objname": "robot", "intprm": [number_found, 0, 1]}
    contact = mujoco.mjtSensor.mjSENS_CONTACT
    spec.add_sensor(name="static", type=contact, reftype=body, refname="static", **hull)
    spec.add_sensor(name="anything", type=contact, **hull)


def _set_options(spec: Any, key: SceneKey, afloat: bool) -> None:
    options = key.options
    option = spec.option
    option.timestep = options.water_time_step if afloat else options.time_step
    option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.iterations = options.iterations
    option.tolerance = options.tolerance
    option.sleep_tolerance = 0.0  # who rests is decided between two steps of the simulator
    option.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    option.gravity = [0.0, 0.0, 0.0 if afloat else -GRAVITY]
    spec.default.geom.solref = [max(options.contact_time, 2.0 * option.timestep), 1.0]
    spec.default.geom.solimp = [options.impedance, options.impedance, 0.001, 0.5, 2.0]
    low, high = key.static.bounds[:2], key.static.bounds[2:]
    spec.stat.extent = float(np.hypot(*(high - low)))
    spec.stat.center = [*(0.5 * (low + high)), 0.0]
    spec.visual.headlight.ambient = [0.3, 0.3, 0.3]
    spec.visual.headlight.diffuse = [0.2, 0.2, 0.2]
    spec.visual.headlight.specular = [0.0, 0.0, 0.0]
    spec.visual.quality.shadowsize = 4096
    spec.visual.map.shadowclip = 2.0  # the default leaves specks at the edge of the light


def _add_ground(spec: Any, key: SceneKey) -> None:
    """The floor, which only the world's dry scenes can touch, and the lamp."""
    afloat = key.materials.water is not None
    low, high = key.static.bounds[:2], key.static.bounds[2:]
    half = 0.5 * (high - low)
    color = color_of(palette_of(key.materials).floor)
    surface = Surface(FLOOR_BIT, 0, key.materials.object_ground, 1, color)
    settings = surface.options()
    if afloat:
        settings["contype"] = 0
    spec.worldbody.add_geom(
        name="ground",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=[*(0.5 * (low + high)), 0.0],
        size=[0.0, 0.0, 0.1 * float(half.max())],  # without end
        **settings,
    )
    lamp = spec.worldbody.add_light(name="lamp")
    lamp.type = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    lamp.pos = [*(0.5 * (low + high)), 2.0 * float(half.max())]
    lamp.dir = [0.3, 0.45, -1.0]
    lamp.diffuse = [0.5, 0.5, 0.5]
    lamp.specular = [0.05, 0.05, 0.05]


def _add_static(spec: Any, key: SceneKey, solids: Solids) -> None:
    """Walls and columns; rounded ends of thick segments are upright cylinders."""
    static = key.static
    color = color_of(palette_of(key.materials).wall)
    surface = Surface(STATIC_BIT, OBJECT_BIT, key.materials.object_static, 1, color)
    top = solids.wall_height
    bottom = -top if key.materials.water is not None else 0.0
    # a body of their own, so that a sensor can tell them from the ground
    world = spec.worldbody.add_body(name="static")
    for i, polygon in enumerate(static.polygons):
        add_prism(spec, world, f"static {i}", polygon, bottom, top, surface)
    thin = 1e-3 * float((static.bounds[2:] - static.bounds[:2]).max())
    for i, (line, radius) in enumerate(zip(static.segments, static.radii, strict=True)):
        a, b = line[:2], line[2:]
        r = float(radius) or thin
        dx, dy = float(b[0] - a[0]), float(b[1] - a[1])
        upright = (0.5 * (bottom + top), 0.5 * (top - bottom))
        if dx or dy:
            world.add_geom(
                name=f"segment {i}",
                type=mujoco.mjtGeom.mjGEOM_BOX,
                pos=[*(0.5 * (a + b)), upright[0]],
                size=[0.5 * float(np.hypot(dx, dy)), r, upright[1]],
                quat=yaw_quaternion(float(np.arctan2(dy, dx))),
                **surface.options(),
            )
        for end, point in enumerate((a, b) if radius else ()):
            world.add_geom(
                name=f"segment {i} end {end}",
                type=mujoco.mjtGeom.mjGEOM_CYLINDER,
                pos=[*point, upright[0]],
                size=[r, upright[1], 0.0],
                **surface.options(),
            )


def ball_radius(outline: FloatArray, solids: Solids) -> float:
    """Radius of the casters' balls of a wheeled object [m].

    Half of the 5 cm wheels of the testbed, or what fits under a small box.
    """
    edges = np.roll(outline, -1, axis=0) - outline
    inside = (edges[:, 1] * outline[:, 0] - edges[:, 0] * outline[:, 1]) / np.hypot(
        edges[:, 0], edges[:, 1]
    )
    return min(0.025, 0.2 * solids.object_height, 0.3 * float(inside.min()))


def _add_object(
    spec: Any, k: int, movables: Movables, materials: Materials, solids: Solids
) -> None:
    """A floe, or a box: a free body whose frame is in the middle of its height."""
    outline, mass = movables.outline(k), float(movables.masses[k])
    half, name = 0.5 * solids.object_height, f"object {k}"
    wheeled = bool(movables.wheeled[k]) and materials.water is None
    meets = STATIC_BIT | OBJECT_BIT
    if materials.water is None:
        body = spec.worldbody.add_body(name=name, pos=[0.0, 0.0, half])
        body.add_freejoint()
        meets |= FLOOR_BIT
    else:
        body = add_floating(spec, name)
    set_mass(body, outline, solids.object_height, mass, [0.0, 0.0, 0.0])
    palette = palette_of(materials)
    color = color_of((palette.wheeled if wheeled else palette.box)[0])
    low = -half
    if wheeled:
        radius = ball_radius(outline, solids)
        low += 1.2 * radius
        ball = Surface(WHEEL_BIT, FLOOR_BIT, 0.0, 3, _CASTER_BALL)
        for i, corner in enumerate(_caster_corners(outline)):
            body.add_geom(
                name=f"{name} caster {i}",
                type=mujoco.mjtGeom.mjGEOM_SPHERE,
                size=[radius, 0.0, 0.0],
                pos=[*(0.75 * corner), radius - half],
                **ball.options(),
            )
    surface = Surface(OBJECT_BIT, meets, materials.object_object, 0, color)
    add_prism(spec, body, name, outline, low, half, surface)


def _caster_corners(outline: FloatArray) -> FloatArray:
    """(3 or 4, 2) corners that carry casters, spread evenly over the outline."""
    count = len(outline)
    return outline[[i * count // 4 for i in range(4)]] if count > 4 else outline


def _set_damping(model: Any, movables: Movables, materials: Materials) -> None:
    """Wheeled objects lose speed and turn rate with the time constant of rolling; fixed ones stay.

    A free joint has one damping coefficient for all six directions, so those of the plane are
    written into the compiled model. What pushes a fixed object meets a damping that it cannot
    drive.
    """
    for k, mass in enumerate(movables.masses):
        first = int(model.body(f"object {k}").dofadr[0])
        damping = model.dof_damping[first : first + 6]
        if movables.wheeled[k]:
            _, inertia = prism_inertia(movables.outline(k), 0.0, float(mass))
            damping[:2] = mass / materials.rolling_time
            damping[5] = inertia[2] / materials.rolling_time
        if movables.fixed[k]:
            damping[:] = _HOLDING * float(mass)
