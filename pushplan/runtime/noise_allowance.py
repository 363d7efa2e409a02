"""`NoiseAllowance`: what plans allow for, where poses are not exact."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace

import numpy as np
import shapely

from pushplan.world import (
    ClearanceArea,
    GoalDisc,
    GoalLine,
    GoalPose,
    InvalidInputError,
    ObjectGoals,
    Receptacle,
    RobotModel,
    StaticMap,
    World,
)
from pushplan.world.checks import FloatArray, expect
from pushplan.world.goals import AreaGoal
from pushplan.world.outline import outward_normals

_SURE = 3.0  # standard deviations by which the robot, or an object, has to be within its goal
_NARROWEST = 0.25  # part of a receptacle's width that is taken off each of its sides at most
_CORNER = 0.05  # sine of a turn below which two edges are one


@dataclass(frozen=True)
class NoiseAllowance:
    """Changes to a world, for noise, before a policy plans in it.

    Args:
        place: standard deviation of the noise that is left in places [m].
        heading: the same of headings [rad].
        period: between two commands [s].
        margin: distance that plans keep from what is static [m]; if None that of the world, and
            twice what noise leaves at the robot's farthest point, whichever is more.
    """

    place: float
    heading: float
    period: float
    margin: float | None

    @property
    def is_noisy(self) -> bool:
        """True if there is any noise."""
        return self.place + self.heading > 0.0

    def noise_margin(self, robot: RobotModel) -> float:
        """Twice what noise leaves at the robot's farthest point [m]."""
        return 2.0 * (self.place + self.heading * robot.circumscribed_radius)

    def planning_world(self, world: World) -> World:
        """The world with the margin, and with a goal in which the robot is sure to be."""
        world = expect("world", world, World)
        goal = world.goal
        inset = _SURE * self.place
        if isinstance(goal, GoalDisc):
            inset += world.robot.max_speed * self.period  # the last command acts
            goal = replace(goal, radius=max(goal.radius - inset, 0.5 * goal.radius))
            if isinstance(goal, GoalPose):
                turn = _SURE * self.heading + world.robot.max_turn_rate * self.period
                most = goal.heading_tolerance
                goal = replace(goal, heading_tolerance=max(most - turn, 0.5 * most))
            world = replace(world, goal=goal)
        elif isinstance(goal, GoalLine):
            if inset > 0.0:
                world = replace(world, goal=replace(goal, point=goal.point + inset * goal.normal))
        elif isinstance(goal, ObjectGoals):
            turns = goal.heading_tolerances
            less = np.where(
                turns < math.pi, np.maximum(turns - _SURE * self.heading, 0.5 * turns), turns
            )
            radii = np.maximum(goal.radii - inset, 0.5 * goal.radii)
            world = replace(world, goal=replace(goal, radii=radii, heading_tolerances=less))
        elif self.is_noisy:
            farthest = float(world.movables.radii.max(initial=0.0))
            inset = _SURE * math.hypot(self.place, self.heading * farthest)
            world = replace(world, goal=_surer_goal(goal, world.static, inset))
        margin = self.margin
        if margin is None:
            margin = max(world.margin, self.noise_margin(world.robot))
        if margin == world.margin:
            return world
        return replace(world, margin=margin)


@functools.lru_cache(maxsize=8)
def _surer_goal(goal: AreaGoal, static: StaticMap, inset: float) -> AreaGoal:
    """The goal for objects, farther out, or farther in except where a wall is behind it [m]."""
    corners = goal.polygon
    normals = outward_normals(corners)
    if isinstance(goal, ClearanceArea):
        by = np.full(len(corners), inset)
        return ClearanceArea(_with_edges_moved(corners, normals, by), goal.open_edges)
    widths = (corners * normals).sum(axis=1) - (corners @ normals.T).min(axis=0)
    inset = min(inset, _NARROWEST * float(widths.min()))
    middles = corners + 0.5 * (np.roll(corners, -1, axis=0) - corners)
    probes = shapely.linestrings(np.stack([middles, middles + inset * normals], axis=1))
    by = np.where(shapely.covers(shapely.box(*static.bounds), probes), -inset, 0.0)
    for part in static.convex_parts:
        by[shapely.intersects(shapely.Polygon(part), probes)] = 0.0
    try:
        return Receptacle(_with_edges_moved(corners, normals, by))
    except InvalidInputError:  # an edge is too short for it
        return goal


def _with_edges_moved(corners: FloatArray, normals: FloatArray, by: FloatArray) -> FloatArray:
    """(N, 2) corners of a convex outline after each edge has moved along its normal by (N,) [m]."""
    before = np.roll(normals, 1, axis=0)
    moved = np.roll(by, 1)
    turn = before[:, 0] * normals[:, 1] - before[:, 1] * normals[:, 0]
    x = moved * normals[:, 1] - by * before[:, 1]
    y = by * before[:, 0] - moved * normals[:, 0]
    corner = np.stack([x, y], axis=1) / np.maximum(turn, _CORNER)[:, None]
    shifted: FloatArray = corners + np.where(turn[:, None] > _CORNER, corner, by[:, None] * normals)
    return shifted
