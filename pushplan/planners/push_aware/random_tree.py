"""A random tree in the space of poses and costs, with the objects carried along; compiled.

AO-RRT (Hauser and Zhou, "Asymptotically optimal planning by feasible kinodynamic planning in a
state-cost space", arXiv 1505.04098; Kleinbort, Granados, Solovey, Bonalli, Bekris and Halperin,
"Refined analysis of asymptotically-optimal kinodynamic planning in the state-cost space", 2020):
targets are drawn uniformly from poses and costs, the node that is nearest in both is driven on
with a random curvature over a random length, and what cannot become cheaper than the best plan is
thrown away. Nothing in it depends on a table, a lattice or a guide. The best-first search is far
quicker to good plans; this is what finds, in the end, any plan that it cannot represent.
"""

from __future__ import annotations

import numpy as np

from pushplan.compiled import kernel
from pushplan.interaction.kernels import Bodies, Settings, make_scratch
from pushplan.motion.collision import Footprint, Obstacles
from pushplan.motion.dubins import along_arc
from pushplan.motion.shortcutting import Pricing, in_goal
from pushplan.planners.push_aware.nodes import Nodes, drive
from pushplan.world.checks import FloatArray

DRAWS = 6
"""Random numbers that one iteration takes."""


@kernel(allocates=True)
def straight_to_goal(x: float, y: float, goal: FloatArray) -> float:
    """Distance [m] to the goal as `Pricing` holds it, 0 inside."""
    if goal[0] == 0.0:
        gap = np.sqrt((x - goal[1]) ** 2 + (y - goal[2]) ** 2) - goal[3]
    else:
        gap = -((x - goal[1]) * goal[3] + (y - goal[2]) * goal[4])
    left: float = max(gap, 0.0)
    return left


@kernel(allocates=True)
def nearest(nodes: Nodes, target: FloatArray, scales: FloatArray, bound: float) -> int:
    """The node nearest to a target (4,) x, y, theta, cost, among those that cost less than a bound.

    Args:
        nodes: the tree.
        target: what to be near to.
        scales: (3,) metres, radians and cost [kg m] that count as one unit of distance.
        bound: [kg m].
    """
    best, least = 0, np.inf
    for i in range(nodes.counts[0]):
        if nodes.costs[i] >= bound:
            continue
        turn = (nodes.poses[i, 2] - target[2] + np.pi) % (2.0 * np.pi) - np.pi
        gap = (nodes.poses[i, 0] - target[0]) ** 2 + (nodes.poses[i, 1] - target[1]) ** 2
        gap = gap / scales[0] ** 2 + (turn / scales[1]) ** 2
        gap += ((nodes.costs[i] - target[3]) / scales[2]) ** 2
        if gap < least:
            best, least = i, gap
    return best


@kernel(allocates=True)
def grow(
    nodes: Nodes,
    draws: FloatArray,
    bound: float,
    longest: float,
    scales: FloatArray,
    pricing: Pricing,
    shape: Footprint,
    among: Obstacles,
    bodies: Bodies,
    settings: Settings,
) -> int:
    """Add one random arc to the tree for each row of ``draws``, where it may still pay.

    Args:
        nodes: the tree.
        draws: (I, 6) uniform in [0, 1): target x, y, heading, cost, then curvature and length.
        bound: cost that a plan has to undercut [kg m].
        longest: longest arc [m].
        scales: of distances, as in `nearest`.
        pricing: of the path.
        shape: footprint with its margin.
        among: the walls.
        bodies: shapes for the sweep.
        settings: of the sweep.

    Returns:
        A node in the goal, -1 if there is none yet, -2 if the memory is full.
    """
    scratch = make_scratch(bodies)
    corners = np.empty_like(shape.vertices)
    count = nodes.objects.shape[1]
    poses, objects, moved = np.empty((2, 3)), np.empty((count, 3)), np.empty(count)
    target = np.empty(4)
    low, high = among.bounds[:2], among.bounds[2:]
    for i in range(draws.shape[0]):
        new = int(nodes.counts[0])
        if new == nodes.poses.shape[0] or nodes.counts[1] == nodes.objects.shape[0]:
            return -2
        draw = draws[i]
        target[:2] = low + draw[:2] * (high - low)
        target[2], target[3] = 2.0 * np.pi * draw[2], bound * draw[3]
        near = nearest(nodes, target, scales, bound)
        curvature, length = (2.0 * draw[4] - 1.0) / pricing.radius, longest * (1.0 - draw[5])
        nodes.parents[new] = near
        nodes.arcs[new, 0], nodes.arcs[new, 1] = length, curvature
        along_arc(nodes.poses[near], length, curvature, nodes.poses[new])
        length = drive(
            nodes, new, pricing, shape, among, bodies,
            settings, scratch, corners, poses, objects, moved,
        )  # fmt: skip
        if length == 0.0:
            continue
        work = 0.0
        for k in range(count):
            work += moved[k] / bodies.inverse_masses[k]
        cost = nodes.costs[near] + pricing.robot_mass * length + pricing.push_weight * work
        x, y = nodes.poses[new, 0], nodes.poses[new, 1]
        left = straight_to_goal(x, y, pricing.goal)
        if not cost + pricing.robot_mass * left < bound:
            continue
        nodes.arcs[new, 0] = length
        nodes.costs[new] = cost
        nodes.rows[new] = nodes.rows[near]
        if work > 0.0:
            nodes.rows[new] = nodes.counts[1]
            nodes.objects[nodes.counts[1]] = objects
            nodes.counts[1] += 1
        nodes.counts[0] += 1
        if in_goal(x, y, pricing.goal):
            return new
    return -1
