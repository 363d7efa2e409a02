"""Driven bodies for MuJoCo: robots on two wheels and a caster, and ships."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from pushplan.drawing.palette import FLOOR_PALETTE, WATER_PALETTE, Palette
from pushplan.envs.simulators.base import Materials, Solids
from pushplan.envs.simulators.mujoco_options import MujocoOptions
from pushplan.envs.simulators.mujoco_shapes import (
    FLOOR_BIT,
    OBJECT_BIT,
    ROBOT_BIT,
    STATIC_BIT,
    WHEEL_BIT,
    Surface,
    add_prism,
    color_of,
    set_mass,
)
from pushplan.envs.simulators.mujoco_shell import (
    CONTACT_GROUP,
    TYRE,
    add_shell,
    add_superstructure,
    add_tyre,
)
from pushplan.world import RobotModel
from pushplan.world.outline import centroid

GRAVITY = 9.81
_WHEEL_MASS = 0.03  # of one wheel, in units of the robot's mass
_CASTER = 0.25  # radius of the caster's ball, in units of the wheel radius
_CLEARANCE = 0.35  # height of the chassis above ground, in units of the wheel radius
_BALANCE = 0.4  # where the centre of mass is on the way from the axle to the caster
_MASS_HEIGHT = 0.25  # of the centre of mass, in units of the robot's height


def palette_of(materials: Materials) -> Palette:
    """Colours of a scene on water or on dry ground."""
    return FLOOR_PALETTE if materials.water is None else WATER_PALETTE


def caster_position(robot: RobotModel) -> float:
    """Where the caster's ball touches the ground, ahead of the axle [m].

    At the rear, unless most of the chassis is ahead of the axle.
    """
    x = robot.contact_parts[0][:, 0]
    rear, front = float(-x.min()), float(x.max())
    return -0.85 * rear if rear >= 0.5 * front else 0.85 * front


def add_wheeled_robot(
    spec: Any, robot: RobotModel, materials: Materials, solids: Solids, options: MujocoOptions
) -> None:
    """A differential drive; the origin of its body is the middle of the axle.

    Wheels touch the ground at one point below their middle, as thin wheels do: their contact
    geoms are spheres. The caster is a ball that slides without friction.
    """
    radius, mass = solids.wheel_radius, robot.mass
    body = spec.worldbody.add_body(name="robot", pos=[0.0, 0.0, radius])
    body.add_freejoint(name="robot")
    caster = caster_position(robot)
    height = solids.robot_height
    wheel_mass = _WHEEL_MASS * mass
    hull = robot.contact_parts[0]
    middle = [_BALANCE * caster, centroid(hull)[1], _MASS_HEIGHT * height - radius]
    set_mass(body, hull, height, mass - 2.0 * wheel_mass, middle)
    low = _CLEARANCE * radius
    add_hull(spec, body, robot, materials, solids, low=low, ground=radius)
    body.geoms[0].group = CONTACT_GROUP  # the shell is what one sees
    add_shell(spec, body, robot, solids)
    ball = _CASTER * radius
    # a body of its own, so that a sensor can tell its contacts from those of the hull
    body.add_body(name="caster", pos=[caster, 0.0, ball - radius]).add_geom(
        name="caster",
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[ball, 0.0, 0.0],
        **Surface(WHEEL_BIT, FLOOR_BIT, 0.0, 3, TYRE).options(),
    )
    torque = 0.5 * options.motor_force * mass * GRAVITY * radius
    rotor = options.rotor_inertia * mass * radius**2
    gain = (0.5 * mass * radius**2 + rotor) / options.motor_time
    for name, side in (("left wheel", 0.5), ("right wheel", -0.5)):
        y = side * robot.wheel_separation
        wheel = _add_wheel(body, name, y, radius, wheel_mass, rotor, options.wheel_friction)
        add_tyre(wheel, robot, radius, 2.0 * side)
        motor = spec.add_actuator(
            name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, forcerange=[-torque, torque]
        )
        motor.set_to_velocity(gain)
        motor.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE


def _add_wheel(
    body: Any, name: str, y: float, radius: float, mass: float, rotor: float, friction: float
) -> Any:
    """One driven wheel at the end of the axle.

    Args:
        body: the chassis.
        name: of the wheel, its joint and its geom.
        y: where it is, to the left [m].
        radius: [m].
        mass: [kg].
        rotor: inertia of the motor's rotor as the wheel feels it through the gear [kg m²].
        friction: of the tyre on the ground.
    """
    wheel = body.add_body(name=name, pos=[0.0, y, 0.0])
    wheel.mass = mass
    wheel.ipos = [0.0, 0.0, 0.0]
    width = 0.4 * radius
    across = mass * (3.0 * radius**2 + width**2) / 12.0
    wheel.inertia = [across, 0.5 * mass * radius**2, across]
    wheel.explicitinertial = True
    wheel.add_joint(
        name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, 1.0, 0.0], armature=rotor
    )
    options = Surface(WHEEL_BIT, FLOOR_BIT, friction, 3, TYRE).options()
    size = [radius, 0.0, 0.0]
    wheel.add_geom(
        name=name, type=mujoco.mjtGeom.mjGEOM_SPHERE, size=size, group=CONTACT_GROUP, **options
    )
    return wheel


def add_hull(
    spec: Any,
    body: Any,
    robot: RobotModel,
    materials: Materials,
    solids: Solids,
    *,
    low: float,
    ground: float,
) -> None:
    """The footprint's parts: chassis or hull first, then the bumper.

    Args:
        spec: the model.
        body: that gets them.
        robot: footprint.
        materials: friction.
        solids: heights.
        low: height of the lower side above the ground [m].
        ground: height of the body's frame above the ground [m].
    """
    palette = palette_of(materials)
    meets = FLOOR_BIT | STATIC_BIT | OBJECT_BIT
    for i, part in enumerate(robot.contact_parts):
        top = solids.bumper_height if i else solids.robot_height
        color = color_of(palette.bumper if i else palette.robot)
        surface = Surface(ROBOT_BIT, meets, materials.robot_object, 2, color)
        bottom = min(low, 0.5 * top)
        add_prism(spec, body, f"robot {i}", part, bottom - ground, top - ground, surface)


def add_ship(
    spec: Any, robot: RobotModel, materials: Materials, solids: Solids, options: MujocoOptions
) -> None:
    """A floating body with thrusters that hold its speed ahead, sideways and its turn rate."""
    body = add_floating(spec, "robot")
    hull = robot.contact_parts[0]
    set_mass(body, hull, solids.robot_height, robot.mass, [*centroid(hull), 0.0])
    half = 0.5 * solids.object_height
    add_hull(spec, body, robot, materials, solids, low=-half, ground=0.0)
    add_superstructure(spec, body, robot, solids)
    body.add_site(name="thrusters")
    force = options.thrust * robot.mass
    moment = 0.5 * float(np.ptp(robot.vertices[:, 0])) * options.thruster_lever * force
    for name, axis, limit, top in (
        ("surge", 0, force, robot.max_speed),
        ("sway", 1, force, robot.max_speed),
        ("yaw", 5, moment, robot.max_turn_rate),
    ):
        thruster = spec.add_actuator(
            name=name,
            target="thrusters",
            trntype=mujoco.mjtTrn.mjTRN_SITE,
            gear=np.eye(6)[axis],
            forcerange=[-limit, limit],
        )
        thruster.set_to_velocity(limit / (options.thrust_droop * top))
        thruster.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE


def add_floating(spec: Any, name: str) -> Any:
    """A body that slides along x and y and turns about the vertical axis."""
    body = spec.worldbody.add_body(name=name)
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    body.add_joint(type=slide, axis=[1.0, 0.0, 0.0])
    body.add_joint(type=slide, axis=[0.0, 1.0, 0.0])
    body.add_joint(type=hinge, axis=[0.0, 0.0, 1.0])
    return body
