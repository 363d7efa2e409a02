"""Worlds of a size that a planner can search: huge numbers would cost it huge memory."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pushplan.world import GoalDisc, GoalLine, InvalidInputError, Movables, ObjectGoals, World
from pushplan.world.checks import FloatArray

FARTHEST = 1e6
"""Greatest distance of anything from the origin, along x or y [m]."""
WIDEST = 1e5
"""Greatest extent of bounds, robot and goal along x or y [circumscribed radii of the robot]."""
FASTEST = 1e6
"""Greatest speed [m/s] and turn rate [rad/s] of anything."""
HEAVIEST = 1e12
"""Greatest mass of anything [kg]."""
LEAST = 1e-9
"""Least mass [kg], and least limit of the robot's motion [m/s, rad/s and their changes]: planners
divide by them."""


def check_scale(world: World) -> None:
    """Refuse a world whose map, goal, robot or objects are too large, far or fast.

    Raises:
        InvalidInputError: naming what is, the number, and the greatest one.
    """
    static = world.static
    goal = world.goal
    robot = world.robot
    _within("static.bounds", static.bounds, FARTHEST, "m")
    for name, lines in (("static.polygons", static.polygons), ("robot.parts", robot.contact_parts)):
        for line in lines:
            _within(name, line, FARTHEST, "m")
    _within("static.segments", static.segments, FARTHEST, "m")
    _within("static.radii", static.radii, FARTHEST, "m")
    _within("goal", _goal_points(world), FARTHEST, "m")
    if isinstance(goal, GoalDisc):
        _within("goal.radius", goal.radius, FARTHEST, "m")
    _within("robot.max_speed", robot.max_speed, FASTEST, "m/s", LEAST)
    _within("robot.min_speed", robot.min_speed, FASTEST, "m/s")
    _within("robot.max_turn_rate", robot.max_turn_rate, FASTEST, "rad/s", LEAST)
    _within("robot.mass", robot.mass, HEAVIEST, "kg", LEAST)
    changes = [robot.max_acceleration, robot.max_turn_acceleration]
    _within("accelerations of the robot", changes, np.inf, "m/s², rad/s²", LEAST)
    check_shapes(world.movables)
    check_motion(world)


def check_shapes(movables: Movables) -> None:
    """Refuse objects whose outlines are too large, or masses too large or small.

    Raises:
        InvalidInputError: as `check_scale`.
    """
    _within("the outline of an object", movables.vertices, FARTHEST, "m")
    _within("masses of objects", movables.masses, HEAVIEST, "kg", LEAST)


def check_motion(world: World) -> None:
    """Refuse a world whose robot or objects are too far or too fast, at the cost of a look.

    Raises:
        InvalidInputError: as `check_scale`.
    """
    assert world.robot_twist is not None
    _within("robot_pose", world.robot_pose, FARTHEST, "m, rad")
    _within("robot_twist", world.robot_twist, FASTEST, "m/s, rad/s")
    radius = world.robot.circumscribed_radius
    reach = world.static.bounds.reshape(2, 2)
    corners = np.vstack([reach, world.robot_pose[:2], _goal_points(world)])
    wide = float((corners.max(axis=0) - corners.min(axis=0)).max())
    if wide > WIDEST * radius:
        raise InvalidInputError(
            f"bounds, robot and goal may be {WIDEST:,.0f} times as far apart as the robot's "
            f"circumscribed radius, got {wide:g} m and {radius:g} m"
        )
    _within("poses of objects", world.movables.poses, FARTHEST, "m, rad")
    _within("twists of objects", world.movables.twists, FASTEST, "m/s, rad/s")


def _goal_points(world: World) -> FloatArray:
    goal = world.goal
    if isinstance(goal, GoalDisc):
        return goal.center
    if isinstance(goal, ObjectGoals):
        return goal.poses[:, :2]
    return goal.point if isinstance(goal, GoalLine) else goal.polygon


def _within(name: str, values: ArrayLike, most: float, unit: str, least: float = 0.0) -> None:
    sizes: FloatArray = np.abs(values)
    largest = sizes.max(initial=0.0)
    smallest = sizes.min(initial=np.inf)
    if largest > most:
        raise InvalidInputError(f"{name} must be at most {most:g} [{unit}], got {largest:g}")
    if smallest < least:
        raise InvalidInputError(f"{name} must be at least {least:g} [{unit}], got {smallest:g}")
