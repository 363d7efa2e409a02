"""The MuJoCo model of a scene, and a small store of models that were compiled before."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from pushplan.drawing.palette import FLOOR_PALETTE, WATER_PALETTE, Palette
from pushplan.envs.simulators.base import Materials, Solids
from pushplan.envs.simulators.mujoco_library import mujoco
from pushplan.envs.simulators.mujoco_shapes import (
    add_geom,
    add_prism,
    prisms_inertia,
    rgba,
    set_mass,
)
from pushplan.envs.simulators.mujoco_shell import CONTACT_GROUP, add_shell, add_superstructure
from pushplan.world import InvalidInputError, Movables, RobotModel, StaticMap
from pushplan.world.checked_fields import (
    CheckedFields,
    Limits,
    PositiveFloat,
    PositiveFraction,
    PositiveInt,
)
from pushplan.world.checks import FloatArray
from pushplan.world.outline import centroid, inscribed_radius

GRAVITY = 9.81
_HOLDING = 1e7  # damping of a fixed object over its mass [1/s]
_WHEEL_MASS = 0.03  # of one wheel, in units of the robot's mass
_CASTER = 0.25  # radius of the caster's ball, in units of the wheel radius
_CLEARANCE = 0.35  # height of the chassis above ground, in units of the wheel radius
_BALANCE = 0.4  # place of the centre of mass on the way from the axle to the caster
_MASS_HEIGHT = 0.25  # of the centre of mass, in units of the robot's height


@dataclass(frozen=True)
class MujocoOptions(CheckedFields):
    """Settings; docs/simulators-mujoco.md has the studies behind the defaults.

    Args:
        time_step: longest step of the engine on the ground [s]; a whole number of steps fits
            between two samples.
        water_time_step: longest step where bodies float [s].
        drag_interval: longest time for which the drag coefficient of a floating body is kept [s].
        samples: poses recorded in each call of `MujocoSimulator.step`, at even intervals.
        iterations: most iterations of the contact solver (Newton) in a step.
        tolerance: of the contact solver.
        contact_time: time constant with which an overlap of two bodies decays [s]; MuJoCo needs
            at least two steps.
        impedance: how much of a contact's relative motion the solver takes away in a step, in
            (0, 1); bodies sink into each other by a fraction of ``1 - impedance``.
        sleep_speed: objects that end a step slower than this rest until something touches them
            [m/s].
        motor_time: time constant of the motors' speed control on free ground [s].
        motor_force: push of all motors together, in units of the robot's weight.
        rotor_inertia: inertia of each motor's rotor as its wheel feels it through the gear, in
            units of the robot's mass times the wheel radius squared.
        wheel_friction: sliding friction coefficient of tyres on the ground.
        thrust: greatest acceleration of a ship by its thrusters, ahead and sideways [m/s²].
        thruster_lever: lever of the thrust that turns a ship, in units of its half length.
        thrust_droop: loss of speed at full thrust, in units of the greatest speed.
    """

    field_prefix = "mujoco "

    time_step: PositiveFraction = 0.0125
    water_time_step: PositiveFraction = 0.02
    drag_interval: PositiveFloat = 0.1
    samples: PositiveInt = 8
    iterations: PositiveInt = 30
    tolerance: PositiveFloat = 1e-6
    contact_time: PositiveFloat = 0.025
    impedance: Annotated[float, Limits(0.0, 0.9999, open_low=True)] = 0.98
    sleep_speed: PositiveFloat = 1e-3
    motor_time: PositiveFloat = 0.025
    motor_force: PositiveFloat = 0.8
    rotor_inertia: PositiveFloat = 1.0
    wheel_friction: PositiveFloat = 0.9
    thrust: PositiveFloat = 0.2
    thruster_lever: PositiveFloat = 1.0
    thrust_droop: PositiveFloat = 0.05


@lru_cache(maxsize=8)
def scene_model(
    robot: RobotModel,
    static: StaticMap,
    movables: Movables,
    materials: Materials,
    options: MujocoOptions,
) -> Any:
    """The MjModel of a scene, to be copied; compiled anew where it is none of the last few.

    Args:
        robot: its footprint and limits.
        static: what does not move.
        movables: the objects; where they are does not matter.
        materials: how bodies grip and float, and their heights.
        options: settings.

    Raises:
        InvalidInputError: if the scene has no third dimension, or the robot neither wheels nor
            water.
    """
    solids = materials.solids
    if solids is None:
        raise InvalidInputError("MuJoCo needs materials.solids: the heights of everything")
    afloat = materials.water is not None
    if not afloat and robot.wheel_separation == 0.0:
        raise InvalidInputError(
            f"robot {robot.name!r} needs wheels on dry ground: robot.wheel_separation must be > 0"
        )
    palette = WATER_PALETTE if afloat else FLOOR_PALETTE
    spec = mujoco.MjSpec.from_string(_description(robot, static, materials, solids, options))
    spec.geom("ground").rgba = rgba(palette.floor)
    _add_static(spec, static, solids, palette.wall, afloat)
    _add_robot(spec, robot, solids, palette, afloat)
    for k in range(len(movables)):
        _add_object(spec, k, movables, solids, palette, afloat)
    try:
        model = spec.compile()
    except ValueError as error:
        raise InvalidInputError(f"MuJoCo cannot build this scene: {error}") from error
    if not afloat:
        _set_damping(model, movables, materials)
    return model


def _description(
    robot: RobotModel,
    static: StaticMap,
    materials: Materials,
    solids: Solids,
    options: MujocoOptions,
) -> str:
    """The scene in MJCF, all but the prisms."""
    afloat = materials.water is not None
    x, y = 0.5 * (static.bounds[:2] + static.bounds[2:])
    sides = static.bounds[2:] - static.bounds[:2]
    half = 0.5 * float(sides.max())
    if afloat:
        time_step = options.water_time_step
        driven = _thrusters(robot, options)
    else:
        time_step = options.time_step
        driven = _wheels(robot, solids, options)
    frictions = {
        "object_ground": materials.object_ground,
        "object_static": materials.object_static,
        "object_object": materials.object_object,
        "robot_object": materials.robot_object,
        "wheel_friction": options.wheel_friction,
    }
    # frictionless contacts have one dimension
    grips = {
        name: f'friction="{mu} 0 0" condim="3"' if mu else "" for name, mu in frictions.items()
    }
    return _filled(
        "scene",
        driven=driven,
        time_step=time_step,
        gravity=0.0 if afloat else -GRAVITY,
        iterations=options.iterations,
        tolerance=options.tolerance,
        contact_time=max(options.contact_time, 2.0 * time_step),
        impedance=options.impedance,
        floor=0 if afloat else 1,
        meets=6 if afloat else 7,
        extent=float(np.hypot(*sides)),
        x=x,
        y=y,
        plane=0.1 * half,  # without end
        lamp=2.0 * half,
        **grips,
    )


def _filled(name: str, **values: object) -> str:
    file = Path(__file__).with_name(f"mujoco_{name}.xml")
    return file.read_text(encoding="utf-8").format(**values)


def caster_position(robot: RobotModel) -> float:
    """Distance of the caster's contact with the ground ahead of the axle [m].

    At the rear, unless most of the chassis is ahead of the axle.
    """
    x = robot.contact_parts[0][:, 0]
    rear = float(-x.min())
    front = float(x.max())
    return -0.85 * rear if rear >= 0.5 * front else 0.85 * front


def _wheels(robot: RobotModel, solids: Solids, options: MujocoOptions) -> str:
    radius = solids.wheel_radius
    mass = robot.mass
    wheel_mass = _WHEEL_MASS * mass
    width = 0.4 * radius
    ball = _CASTER * radius
    # of the motor, as its wheel feels it through the gear [kg m²]
    rotor = options.rotor_inertia * mass * radius**2
    return _filled(
        "wheels",
        radius=radius,
        caster=caster_position(robot),
        caster_height=ball - radius,
        ball=ball,
        left=0.5 * robot.wheel_separation,
        wheel_mass=wheel_mass,
        across=wheel_mass * (3.0 * radius**2 + width**2) / 12.0,
        along=0.5 * wheel_mass * radius**2,
        rotor=rotor,
        wheel="caster" if robot.slides else "wheel",
        site='<site name="thrusters"/>' if robot.slides else "",
        motors="".join(_motors(robot, rotor, radius, options)),
    )


def _motors(
    robot: RobotModel, rotor: float, radius: float, options: MujocoOptions
) -> Iterator[str]:
    """The actuators of the wheels, or of an omnidirectional robot's body: ahead, left, turning."""
    mass = robot.mass
    force = options.motor_force * mass * GRAVITY
    if not robot.slides:
        gain = (0.5 * mass * radius**2 + rotor) / options.motor_time
        torque = 0.5 * force * radius
        for side in ("left", "right"):
            name = f"{side} wheel"
            yield _motor(name, f'joint="{name}"', gain, torque)
        return
    lever = robot.circumscribed_radius
    for name, axis, scale in (("ahead", 0, 1.0), ("aside", 1, 1.0), ("turn", 5, lever)):
        gear = " ".join("1" if i == axis else "0" for i in range(6))
        gain = mass * scale**2 / options.motor_time
        yield _motor(name, f'site="thrusters" gear="{gear}"', gain, force * scale)


def _motor(name: str, where: str, gain: float, most: float) -> str:
    return f'  <velocity name="{name}" {where} kv="{gain}" forcerange="-{most} {most}"/>\n'


def _thrusters(robot: RobotModel, options: MujocoOptions) -> str:
    force = options.thrust * robot.mass
    moment = 0.5 * float(np.ptp(robot.vertices[:, 0])) * options.thruster_lever * force
    return _filled(
        "thrusters",
        force=force,
        moment=moment,
        ahead=force / (options.thrust_droop * robot.max_speed),
        turning=moment / (options.thrust_droop * robot.max_turn_rate),
    )


def _add_robot(
    spec: Any, robot: RobotModel, solids: Solids, palette: Palette, afloat: bool
) -> None:
    """The footprint's parts, chassis or hull first, then the bumper; and what one sees."""
    body = spec.body("robot")
    hull = robot.contact_parts[0]
    height = solids.robot_height
    if afloat:
        ground = 0.0
        low = -0.5 * solids.object_height
        mass = robot.mass
        middle = [*centroid(hull), 0.0]
    else:
        ground = solids.wheel_radius  # height of the body's frame
        low = _CLEARANCE * ground
        mass = robot.mass - 2.0 * (_WHEEL_MASS * robot.mass)
        ahead = _BALANCE * caster_position(robot)
        middle = [ahead, centroid(hull)[1], _MASS_HEIGHT * height - ground]
    set_mass(body, [hull], height, mass, middle)
    for i, part in enumerate(robot.contact_parts):
        top = solids.bumper_height if i else height
        color = palette.bumper if i else palette.robot
        bottom = min(low, 0.5 * top)
        add_prism(spec, body, f"robot {i}", part, bottom - ground, top - ground, "robot", color)
    if afloat:
        add_superstructure(spec, robot, solids)
    else:
        body.geoms[0].group = CONTACT_GROUP  # the shell is what one sees
        add_shell(spec, robot, solids)


def _add_static(spec: Any, static: StaticMap, solids: Solids, color: str, afloat: bool) -> None:
    """Walls and columns; rounded ends of thick segments are upright cylinders."""
    top = solids.wall_height
    bottom = -top if afloat else 0.0
    middle = 0.5 * (bottom + top)
    half = 0.5 * (top - bottom)
    body = spec.body("static")
    for i, polygon in enumerate(static.polygons):
        add_prism(spec, body, f"static {i}", polygon, bottom, top, "static", color)
    thin = 1e-3 * float((static.bounds[2:] - static.bounds[:2]).max())
    for i, (line, radius) in enumerate(zip(static.segments, static.radii, strict=True)):
        a = line[:2]
        b = line[2:]
        r = float(radius) or thin
        length = float(np.hypot(*(b - a)))
        heading = float(np.arctan2(*(b - a)[::-1]))
        if length:
            size = [0.5 * length, r, half]
            pos = [*(0.5 * (a + b)), middle]
            add_geom(spec, body, f"segment {i}", "box", size, pos, "static", color, yaw=heading)
        for end, point in enumerate((a, b) if radius else ()):
            size = [r, half, 0.0]
            pos = [*point, middle]
            add_geom(spec, body, f"segment {i} end {end}", "cylinder", size, pos, "static", color)


def ball_radius(outline: FloatArray, solids: Solids) -> float:
    """Radius of the casters' balls of a wheeled object [m].

    Half of the 5 cm wheels of the testbed, or what fits under a small box.
    """
    return min(0.025, 0.2 * solids.object_height, 0.3 * inscribed_radius(outline))


def _add_object(
    spec: Any, k: int, movables: Movables, solids: Solids, palette: Palette, afloat: bool
) -> None:
    """A floe, or a box: a free body whose frame is in the middle of its height."""
    outline = movables.outline(k)
    mass = float(movables.masses[k])
    half = 0.5 * solids.object_height
    name = f"object {k}"
    wheeled = bool(movables.wheeled[k]) and not afloat
    body = spec.worldbody.add_body(name=name, pos=[0.0, 0.0, 0.0 if afloat else half])
    if afloat:
        slide = mujoco.mjtJoint.mjJNT_SLIDE
        hinge = mujoco.mjtJoint.mjJNT_HINGE
        for kind, axis in zip((slide, slide, hinge), np.eye(3), strict=True):
            body.add_joint(type=kind, axis=axis)
    else:
        body.add_freejoint()
    pieces = movables.contact_pieces(k)
    set_mass(body, pieces, solids.object_height, mass, [0.0, 0.0, 0.0])
    low = -half
    if wheeled:
        radius = ball_radius(outline, solids)
        low += 1.2 * radius
        for i, corner in enumerate(_caster_corners(outline)):
            ball = f"{name} caster {i}"
            pos = [*(0.75 * corner), radius - half]
            add_geom(spec, body, ball, "sphere", [radius, 0.0, 0.0], pos, "caster")
    color = (palette.wheeled if wheeled else palette.box)[0]
    for i, part in enumerate(movables.parts(k)):
        add_prism(spec, body, f"{name} part {i}" if i else name, part, low, half, "object", color)


def _caster_corners(outline: FloatArray) -> FloatArray:
    """(3 or 4, 2) corners that carry casters, spread evenly over the outline."""
    count = len(outline)
    if count <= 4:
        return outline
    return outline[[i * count // 4 for i in range(4)]]


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
            _, inertia = prisms_inertia(movables.contact_pieces(k), 0.0, float(mass))
            damping[:2] = mass / materials.rolling_time
            damping[5] = inertia[2] / materials.rolling_time
        if movables.fixed[k]:
            damping[:] = _HOLDING * float(mass)
