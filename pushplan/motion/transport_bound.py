"""Lower bound on the work of robot and objects for a rearrangement goal."""

from __future__ import annotations

import numpy as np

from pushplan.geometry import object_ways
from pushplan.motion.length_bound import too_long
from pushplan.world import AreaGoal, World
from pushplan.world.outline import inscribed_radius


def transport_bound(world: World) -> float:
    """A lower bound on m₀ l₀ + Σ mᵢ lᵢ of a robot that brings all objects to their goal [kg m].

    The middle of each object that is not done travels at least the shortest path of a point around
    what is static, and for an area its inscribed radius more, as all of the object has to be in
    it, or out of it over an open edge. The robot drives at least up to the nearest object, done or
    not, as that may push the others; how far beyond that has no such bound, as it may push several
    objects at once. Objects that are fixed are static, and need not get anywhere.

    Raises:
        InvalidInputError: if the goal is not one for the objects.
    """
    world = world.with_fixed_as_static()
    goal = world.manipulation_goal
    movables = world.movables
    robot = world.robot
    left = np.flatnonzero(~world.completed)
    if len(left) == 0:
        return 0.0
    ways = object_ways(world.static, goal, movables.ids[left], movables.poses[left, :2])
    lengths = ways / (1.0 + too_long(world.static))
    lengths[~np.isfinite(lengths)] = 0.0
    for i, (k, way) in enumerate(zip(left, lengths.tolist(), strict=True)):
        if isinstance(goal, AreaGoal) and way > 0.0:
            # an origin outside of its object may get past walls, and need not get anywhere
            inner = max(map(inscribed_radius, movables.drawn_parts(int(k))))
            lengths[i] = way + inner if inner > 0.0 else 0.0
    away = np.hypot(*(movables.poses[:, :2] - world.robot_pose[:2]).T)
    approach = max(0.0, float((away - movables.radii).min()) - robot.circumscribed_radius)
    return robot.mass * approach + float(movables.masses[left] @ lengths)
