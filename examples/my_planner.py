"""A planner of one's own: A* on a grid, round the walls, and round boxes where that is cheaper."""

import heapq
import math
import time
from itertools import product

import numpy as np

from pushplan.geometry import Grid, clearance_field
from pushplan.motion.polyline_plan import polyline_plan, polyline_status
from pushplan.world import MaxIterations, PlanResult, PlanStats, PlanStatus


class GridAStar:
    """A metre costs 1, more near walls, and more where the robot would meet a box."""

    def plan(self, world, *, stop=None, rng=None):
        """Search from the robot's cell to the first one in the goal."""
        began, goal, iterations = time.perf_counter(), world.navigation_goal, 0
        check = (stop or MaxIterations(100_000)).start()
        grid = Grid.cover(world.static.bounds, 0.3 * world.robot.circumscribed_radius)
        x, y = np.meshgrid(grid.x, grid.y)
        price, start = costs_per_metre(world, grid, x, y), grid.cell(*world.robot_pose[:2])
        costs, parents, heap = {start: 0.0}, {}, [(0.0, start)]
        while heap and not check(iterations, math.inf):
            at, iterations = heapq.heappop(heap)[1], iterations + 1
            if goal.distance(x[at], y[at]) == 0.0:
                break
            for row, col in product((-1, 0, 1), repeat=2):
                to = (at[0] + row, at[1] + col)
                cost = costs[at] + grid.resolution * math.hypot(row, col) * price[to]
                if cost < costs.get(to, math.inf):
                    costs[to], parents[to] = cost, at
                    heapq.heappush(heap, (cost + goal.distance(x[to], y[to]), to))
        else:  # the loop ended without a break
            status = PlanStatus.TIMED_OUT if heap else PlanStatus.GOAL_UNREACHABLE
            return PlanResult(status, None, PlanStats(time.perf_counter() - began))
        points = []
        while at != start:
            points, at = [(x[at], y[at]), *points], parents[at]
        plan = polyline_plan(world, np.array([world.robot_pose[:2], *points]), grid.resolution)
        stats = PlanStats(time.perf_counter() - began, iterations=iterations)
        return PlanResult(polyline_status(world, plan), plan, stats)


def costs_per_metre(world, grid, x, y):
    """(rows, columns) the price of each cell; inf at the border and where walls are too near."""
    size, boxes = world.robot.circumscribed_radius, world.movables
    walls = clearance_field(world.static, grid) - size - world.margin
    price = 1.0 + np.clip(1.0 - walls / size, 0.0, 1.0)
    for pose, radius, mass in zip(boxes.poses, boxes.radii, boxes.masses, strict=True):
        near = np.hypot(x - pose[0], y - pose[1]) < radius + 0.8 * size
        price[near] += 2.0 * mass / world.robot.mass
    price[walls < 0.0] = price[[0, -1]] = price[:, [0, -1]] = np.inf
    price[grid.cell(*world.robot_pose[:2])] = 1.0  # it stands there already
    return price
