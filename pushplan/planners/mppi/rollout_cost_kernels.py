"""Compiled costs of rollouts: the metric's own cost up to the horizon, and the cost-to-go there."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry.distance_field import sample_values
from pushplan.planners.mppi.rollout_kernels import BLOCKED, Rollouts
from pushplan.world.checks import FloatArray


class Field(NamedTuple):
    """A distance field as kernels read it."""

    values: FloatArray  # (rows, columns) [m], finite
    x: float  # Least x of the grid [m]
    y: float  # Least y
    cell: float  # Side of a cell [m]


class CostWeights(NamedTuple):
    """Weights that all tasks share."""

    robot_mass: float  # m₀ [kg]
    push_weight: float  # w
    goal_weight: float  # Factor on the cost-to-go
    collision: float  # Cost of a rollout that is blocked at once; down to half of it later [kg m]


class Approach(NamedTuple):
    """The robot's way to behind the object that is to be pushed."""

    target: int  # Index of the object, -1 for none
    field: Field  # Way to behind it, where it lies now
    place: FloatArray  # (3,) pose behind it, facing along the push
    near: float  # Up to here the way is straight, and the heading counts [m]
    weight: float  # Cost of a metre of the way [kg]
    turned: float  # Way that facing away is worth [m]


class ObjectCosts(NamedTuple):
    """Remaining cost of the objects."""

    field: Field  # Way of an object's middle to where it is done
    weights: FloatArray  # (K,) cost of a metre of it [kg]; 0 for objects that do not count
    done: FloatArray  # (K,) way up to which an object is done [m]
    undone: float  # Cost of each object that is not [kg m]


@kernel
def sample(field: Field, x: float, y: float) -> float:
    """Distance at a point [m]."""
    found: float = sample_values(field.values, field.x, field.y, field.cell, x, y)
    return found


@kernel
def driving_cost(s: int, rollouts: Rollouts, weights: CostWeights) -> float:
    """m₀ l₀ + w Σ mᵢ lᵢ of a rollout [kg m], and what is added where it is blocked."""
    path = rollouts.paths[s]
    end = rollouts.ends[s]
    length = 0.0
    for n in range(end):
        dx = path[n + 1, 0] - path[n, 0]
        dy = path[n + 1, 1] - path[n, 1]
        length += np.sqrt(dx * dx + dy * dy)
    cost = weights.robot_mass * length + weights.push_weight * rollouts.works[s]
    if rollouts.outcomes[s] == BLOCKED:
        cost += weights.collision * (1.0 - 0.5 * end / (path.shape[0] - 1))
    return float(cost)


@kernel
def navigation_costs(
    rollouts: Rollouts, weights: CostWeights, field: Field, out: FloatArray
) -> None:
    """Costs (S,) of rollouts of a robot that has a goal itself [kg m]."""
    for s in range(out.shape[0]):
        end = rollouts.paths[s, rollouts.ends[s]]
        left = sample(field, end[0], end[1])
        out[s] = driving_cost(s, rollouts, weights)
        out[s] += weights.goal_weight * weights.robot_mass * left


@kernel
def _way_behind(robot: FloatArray, dx: float, dy: float, approach: Approach) -> float:
    """Way of the robot to behind the target [m], which has moved by (dx, dy)."""
    x = robot[0] - dx
    y = robot[1] - dy
    way = sample(approach.field, x, y)
    place = approach.place
    if way < approach.near:
        way = np.sqrt((x - place[0]) ** 2 + (y - place[1]) ** 2)
        facing = 1.0 - np.cos(robot[2] - place[2])
        way += approach.turned * facing * max(0.0, 1.0 - way / approach.near)
    return float(way)


@kernel
def manipulation_costs(
    rollouts: Rollouts,
    weights: CostWeights,
    costs: ObjectCosts,
    approach: Approach,
    start: FloatArray,  # (K, 3) poses of the objects at the beginning
    out: FloatArray,
) -> None:
    """Costs (S,) of rollouts of a robot that has to bring objects to their goal [kg m]."""
    for s in range(out.shape[0]):
        left = 0.0
        waiting = False
        objects = rollouts.objects[s]
        target = approach.target
        for k in range(start.shape[0]):
            if costs.weights[k] == 0.0:
                continue
            way = sample(costs.field, objects[k, 0], objects[k, 1])
            if way > costs.done[k]:
                left += costs.undone + costs.weights[k] * (way - costs.done[k])
                waiting = waiting or k == target
        if waiting:
            dx = objects[target, 0] - start[target, 0]
            dy = objects[target, 1] - start[target, 1]
            robot = rollouts.paths[s, rollouts.ends[s]]
            left += approach.weight * _way_behind(robot, dx, dy, approach)
        out[s] = driving_cost(s, rollouts, weights) + weights.goal_weight * left
