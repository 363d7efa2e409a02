"""A random tree in the space of poses and costs, with the objects carried along; compiled.

AO-RRT (Hauser and Zhou, "Asymptotically optimal planning by feasible kinodynamic planning in a
state-cost space", arXiv 1505.04098; Kleinbort, Granados, Solovey, Bonalli, Bekris and Halperin,
"Refined analysis of asymptotically-optimal kinodynamic planning in the state-cost space", 2020):
targets are drawn uniformly from poses and costs, the node that is nearest in both is driven on
with a random curvature over a random length, and what cannot become cheaper than the best plan is
thrown away. Nothing in it depends on a table, a lattice or a coarse path. The best-first search is
far quicker to good plans; this is what finds, in the end, any plan that it cannot represent.
"""

from __future__ import annotations

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.motion.arc_rollout import make_arc_memory, work_of
from pushplan.motion.dubins import along_arc
from pushplan.motion.goal_region import distance_to_goal, in_goal
from pushplan.motion.path_problem import PathProblem
from pushplan.planners.push_aware.push_tree import PushTree, drive
from pushplan.world.checks import FloatArray

DRAWS = 6
"""Random numbers that one iteration takes."""


@kernel
def nearest(
    tree: PushTree,
    target: FloatArray,  # (4,) x, y [m], theta [rad], cost [kg m]
    scales: FloatArray,  # (3,) metres, radians and cost that count as one unit of distance
    bound: float,  # [kg m]
) -> int:
    """The node nearest to a target among those that cost less than a bound."""
    best = 0
    least = np.inf
    for i in range(tree.counts[0]):
        if tree.costs[i] >= bound:
            continue
        turn = (tree.poses[i, 2] - target[2] + np.pi) % (2.0 * np.pi) - np.pi
        gap = (tree.poses[i, 0] - target[0]) ** 2 + (tree.poses[i, 1] - target[1]) ** 2
        gap = gap / scales[0] ** 2 + (turn / scales[1]) ** 2
        gap += ((tree.costs[i] - target[3]) / scales[2]) ** 2
        if gap < least:
            best = i
            least = gap
    return best


@kernel(allocates=True)
def grow(
    tree: PushTree,
    draws: FloatArray,  # (I, 6) in [0, 1): target x, y, heading, cost, then curvature and length
    bound: float,  # cost that a plan has to undercut [kg m]
    longest: float,  # longest arc [m]
    scales: FloatArray,  # of distances, as in `nearest`
    problem: PathProblem,
) -> int:
    """Add a random arc for each row of ``draws``; a node in the goal, -1: none, -2: memory full."""
    memory = make_arc_memory(problem)
    target = np.empty(4)
    low = problem.walls.bounds[:2]
    high = problem.walls.bounds[2:]
    for i in range(draws.shape[0]):
        new = int(tree.counts[0])
        if new == tree.poses.shape[0] or tree.counts[1] == tree.objects.shape[0]:
            return -2
        draw = draws[i]
        for axis in range(2):
            target[axis] = low[axis] + draw[axis] * (high[axis] - low[axis])
        target[2] = 2.0 * np.pi * draw[2]
        target[3] = bound * draw[3]
        near = nearest(tree, target, scales, bound)
        curvature = (2.0 * draw[4] - 1.0) / problem.turning_radius
        length = longest * (1.0 - draw[5])
        tree.parents[new] = near
        tree.arcs[new, 0] = length
        tree.arcs[new, 1] = curvature
        along_arc(tree.poses[near], length, curvature, tree.poses[new])
        length = drive(tree, new, problem, memory)
        if length == 0.0:
            continue
        work = work_of(memory.moved, problem.contacts.inverse_masses)
        cost = tree.costs[near] + problem.robot_mass * length + problem.push_weight * work
        x = tree.poses[new, 0]
        y = tree.poses[new, 1]
        left = distance_to_goal(x, y, problem.goal)
        if not cost + problem.robot_mass * left < bound:
            continue
        tree.arcs[new, 0] = length
        tree.costs[new] = cost
        tree.rows[new] = tree.rows[near]
        if work > 0.0:
            tree.rows[new] = tree.counts[1]
            copy_into(tree.objects[tree.counts[1]], memory.objects)
            tree.counts[1] += 1
        tree.counts[0] += 1
        if in_goal(x, y, problem.goal):
            return new
    return -1
