"""Objectives of a decision: costs of rollouts, for a goal of the robot or one of the objects."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pushplan.compiled import owned
from pushplan.planners.mppi.fields import CLEARANCE, object_field, robot_field
from pushplan.planners.mppi.mppi_config import MppiConfig
from pushplan.planners.mppi.rollout_cost_kernels import (
    Approach,
    CostWeights,
    ObjectCosts,
    manipulation_costs,
    navigation_costs,
    sample,
)
from pushplan.planners.mppi.rollout_kernels import Rollouts
from pushplan.world import World
from pushplan.world.checks import FloatArray

Objective = Callable[[Rollouts], FloatArray]
"""Costs (S,) of S rollouts [kg m]."""

_CELL = 0.3  # side of a cell of distance fields [R]
_MOST_CELLS = 20_000


class _Defaults(NamedTuple):
    """Settings that depend on who has the goal; see `MppiConfig`."""

    goal_weight: float
    collision_cost: float


_NAVIGATION = _Defaults(3.0, 200.0)
_MANIPULATION = _Defaults(2.0, 20.0)


def _cell(world: World, size: float) -> float:
    """Side of the cells of a distance field [m]."""
    sides = world.static.bounds[2:] - world.static.bounds[:2]
    return max(_CELL * size, float(np.sqrt(sides[0] * sides[1] / _MOST_CELLS)))


def _weights(world: World, config: MppiConfig, defaults: _Defaults) -> CostWeights:
    robot = world.robot
    goal_weight = config.goal_weight
    collision = config.collision_cost
    if goal_weight is None:
        goal_weight = defaults.goal_weight
    if collision is None:
        collision = defaults.collision_cost
    collision *= robot.mass * robot.circumscribed_radius
    return CostWeights(robot.mass, config.push_weight, goal_weight, collision)


def navigation_objective(world: World, config: MppiConfig) -> Objective:
    """Driving and pushing up to the horizon, and the way that is left to the goal."""
    robot = world.robot
    weights = _weights(world, config, _NAVIGATION)
    cell = _cell(world, robot.circumscribed_radius)
    field = robot_field(world.static, world.navigation_goal, robot.inscribed_radius, cell)

    def costs(rollouts: Rollouts) -> FloatArray:
        out = np.empty(len(rollouts.paths))
        navigation_costs(rollouts, weights, field, out)
        return out

    return costs


def object_costs(world: World, config: MppiConfig) -> ObjectCosts:
    """Return the remaining cost of the objects, as kernels read it.

    Bringing an object one metre nearer costs m₀ + w mᵢ. Each object that is not done costs as much
    as driving half across the map on top: without that a robot that has just finished one would
    be worse off, as the next one is far away.
    """
    movables = world.movables
    robot = world.robot
    static = world.static
    sides = static.bounds[2:] - static.bounds[:2]
    undone = 0.5 * robot.mass * float(np.hypot(*sides))
    radius = float(movables.radii.max()) if len(movables) else robot.circumscribed_radius
    field = object_field(
        static, world.manipulation_goal, radius, CLEARANCE * radius, _cell(world, radius)
    )
    done = np.full(len(movables), 0.25 * field.cell)
    completed = world.completed
    for k in np.flatnonzero(completed).tolist():
        x, y = movables.poses[k, :2].tolist()
        done[k] = max(done[k], sample(field, x, y) + 0.25 * field.cell)
    weights = robot.mass + config.push_weight * movables.masses
    return ObjectCosts(field, owned(weights), done, undone)


def manipulation_objective(world: World, config: MppiConfig, approach: Approach) -> Objective:
    """Driving and pushing up to the horizon, what is left for the objects, and the approach.

    Args:
        world: the snapshot.
        config: settings.
        approach: to the object that is to be pushed.
    """
    weights = _weights(world, config, _MANIPULATION)
    costs_left = object_costs(world, config)
    start = owned(world.movables.poses)

    def costs(rollouts: Rollouts) -> FloatArray:
        out = np.empty(len(rollouts.paths))
        manipulation_costs(rollouts, weights, costs_left, approach, start, out)
        return out

    return costs
