"""Costs of rollouts: a list of terms that are added up, and to which a user may add."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from pushplan.errors import short
from pushplan.planners.mppi.approach_grid import (
    CLEARANCE,
    Approach,
    Field,
    object_field,
    robot_field,
    sample,
)
from pushplan.planners.mppi.mppi_config import MppiConfig
from pushplan.planners.mppi.rollout_model import BLOCKED, Rollouts
from pushplan.world import InvalidInputError, World
from pushplan.world.checks import FloatArray

_CELL = 0.3  # side of a cell of distance fields [R]
_MOST_CELLS = 20_000
_UNDONE = 0.5  # value of an object that is done: driving over this part of the map's diagonal
_GOAL_MISSED = 200.0  # cost of a collision to a robot that misses its own goal then [R]
_HELD_UP = 20.0  # the same to one whose objects have the goal: it can go on [R]
_DONE = 0.25  # distance up to which an object counts as done [cells]


@runtime_checkable
class RolloutCost(Protocol):
    """One term of the cost of rollouts."""

    def __call__(self, world: World, rollouts: Rollouts) -> FloatArray:
        """Costs (S,) of S rollouts [kg m], finite.

        Args:
            world: the snapshot that they start from, with the objects of ``rollouts.objects``.
            rollouts: to be weighed.
        """
        ...


def total_cost(costs: Sequence[RolloutCost], world: World, rollouts: Rollouts) -> FloatArray:
    """Sum (S,) of all terms [kg m].

    Raises:
        InvalidInputError: if a term does not give one finite number for each rollout.
    """
    total = np.zeros(len(rollouts.paths))
    for cost in costs:
        found = np.asarray(cost(world, rollouts), dtype=np.float64)
        if found.shape != total.shape or not np.isfinite(found).all():
            raise InvalidInputError(
                f"the cost {short(cost)} must give {len(total)} finite numbers, one for each "
                f"rollout, got {short(found)}"
            )
        total += found
    return total


@dataclass(frozen=True)
class DrivingCost:
    """m₀ l₀ + w Σ mᵢ lᵢ up to the horizon: the cost that the metrics count.

    Args:
        push_weight: w.
    """

    push_weight: float = 1.0

    def __call__(self, world: World, rollouts: Rollouts) -> FloatArray:
        """See `RolloutCost`."""
        steps = np.diff(rollouts.paths[:, :, :2], axis=1)
        lengths = np.hypot(steps[..., 0], steps[..., 1]).sum(axis=1)
        cost: FloatArray = world.robot.mass * lengths + self.push_weight * rollouts.works
        return cost


@dataclass(frozen=True)
class CollisionCost:
    """Cost of a rollout that is blocked: the whole of it at once, half of it at the horizon.

    Args:
        weight: the whole [kg m].
    """

    weight: float

    def __call__(self, world: World, rollouts: Rollouts) -> FloatArray:
        """See `RolloutCost`."""
        late = 0.5 * rollouts.ends / (rollouts.paths.shape[1] - 1)
        return np.where(rollouts.outcomes == BLOCKED, self.weight * (1.0 - late), 0.0)


@dataclass(frozen=True, eq=False)
class GoalCost:
    """Cost-to-go of a robot that has a goal itself: its way there around what is static.

    Args:
        field: of that way.
        weight: cost of a metre [kg].
    """

    field: Field
    weight: float

    def __call__(self, world: World, rollouts: Rollouts) -> FloatArray:
        """See `RolloutCost`."""
        return self.weight * sample(self.field, rollouts.paths[:, -1, :2])


@dataclass(frozen=True, eq=False)
class ObjectCost:
    """Cost-to-go of the objects: their ways to where they are done, and a cost of each undone one.

    Without that cost a robot that has just finished an object would be worse off, as the next one
    is far away.

    Args:
        field: of the way of an object's middle.
        weights: (K,) cost of a metre of it [kg].
        done: (K,) way up to which an object is done [m].
        undone: cost of each object that is not [kg m].
    """

    field: Field
    weights: FloatArray
    done: FloatArray
    undone: float

    def __call__(self, world: World, rollouts: Rollouts) -> FloatArray:
        """See `RolloutCost`."""
        left = self.ways_left(rollouts)
        costs = np.where(left > 0.0, self.undone + self.weights * left, 0.0)
        return np.asarray(costs.sum(axis=1))

    def ways_left(self, rollouts: Rollouts) -> FloatArray:
        """Ways (S, K) that the objects have still to go [m]; 0 of those that are done."""
        ways = sample(self.field, rollouts.objects[:, :, :2])
        left: FloatArray = np.maximum(ways - self.done, 0.0)
        return left


@dataclass(frozen=True, eq=False)
class ApproachCost:
    """Cost of the robot's way to behind the object that is to be pushed, while it is not done.

    Args:
        approach: the way, where the object lies now.
        objects: cost of the objects.
        weight: factor.
    """

    approach: Approach
    objects: ObjectCost
    weight: float

    def __call__(self, world: World, rollouts: Rollouts) -> FloatArray:
        """See `RolloutCost`."""
        approach = self.approach
        k = approach.target
        waits = self.objects.ways_left(rollouts)[:, k] > 0.0
        moved = rollouts.objects[:, k, :2] - world.movables.poses[k, :2]
        poses = rollouts.paths[:, -1]
        places = poses[:, :2] - moved
        ways = sample(approach.field, places)
        straight = np.hypot(*(places - approach.place[:2]).T)
        # near the place the way is straight, and the heading counts
        near = np.maximum(0.0, 1.0 - straight / approach.near)
        facing = 1.0 - np.cos(poses[:, 2] - approach.place[2])
        straight += approach.turned * facing * near
        ways = np.where(ways < approach.near, straight, ways)
        return np.where(waits, self.weight * approach.weight * ways, 0.0)


def navigation_costs(world: World, config: MppiConfig) -> list[RolloutCost]:
    """Terms for a robot that has a goal itself."""
    robot = world.robot
    goal_weight = 3.0 if config.goal_weight is None else config.goal_weight
    cell = _cell(world, robot.circumscribed_radius)
    field = robot_field(world.static, world.navigation_goal, robot.inscribed_radius, cell)
    costs = _driving_costs(world, config, _GOAL_MISSED)
    costs.append(GoalCost(field, goal_weight * robot.mass))
    return costs


def manipulation_costs(
    world: World, config: MppiConfig, approach: Approach | None
) -> list[RolloutCost]:
    """Terms for a robot that has to bring objects to their goal.

    Args:
        world: the snapshot.
        config: settings.
        approach: to the object that is to be pushed; None if there is none.
    """
    goal_weight = 2.0 if config.goal_weight is None else config.goal_weight
    objects = object_cost(world, config.push_weight, goal_weight)
    costs = _driving_costs(world, config, _HELD_UP)
    costs.append(objects)
    if approach is not None:
        costs.append(ApproachCost(approach, objects, goal_weight))
    return costs


def _driving_costs(world: World, config: MppiConfig, collision: float) -> list[RolloutCost]:
    """Terms of every task; a collision costs so much [R] where the settings leave it open."""
    robot = world.robot
    if config.collision_cost is not None:
        collision = config.collision_cost
    return [
        DrivingCost(config.push_weight),
        CollisionCost(collision * robot.mass * robot.circumscribed_radius),
    ]


def object_cost(world: World, push_weight: float, goal_weight: float) -> ObjectCost:
    """Cost-to-go of the objects; to bring one a metre nearer costs m₀ + w mᵢ."""
    movables = world.movables
    robot = world.robot
    static = world.static
    radius = robot.circumscribed_radius
    if len(movables):
        radius = float(movables.radii.max())
    field = object_field(static, world.area_goal, radius, CLEARANCE * radius, _cell(world, radius))
    done = np.full(len(movables), _DONE * field.cell)
    for k in np.flatnonzero(world.completed).tolist():
        way = float(sample(field, movables.poses[None, k, :2])[0])
        done[k] = max(done[k], way + _DONE * field.cell)
    sides = static.bounds[2:] - static.bounds[:2]
    return ObjectCost(
        field,
        goal_weight * (robot.mass + push_weight * movables.masses),
        done,
        goal_weight * _UNDONE * robot.mass * float(np.hypot(*sides)),
    )


def _cell(world: World, size: float) -> float:
    """Side of the cells of a distance field [m]."""
    sides = world.static.bounds[2:] - world.static.bounds[:2]
    return max(_CELL * size, float(np.sqrt(sides[0] * sides[1] / _MOST_CELLS)))
