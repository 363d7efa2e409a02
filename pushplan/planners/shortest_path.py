"""`ShortestPath`: the shortest path around the walls, through all objects. The lower reference."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pushplan.control import PurePursuit
from pushplan.geometry import VisibilityGraph
from pushplan.motion.keep_out import keep_out
from pushplan.motion.polyline_plan import polyline_result
from pushplan.motion.speed_profile import start_margin
from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.world import Planner, PlanResult, PlanStatus, Stop, World
from pushplan.world.checks import number
from pushplan.world.planning_call import PlanningCall


@dataclass(frozen=True)
class ShortestPath:
    """The shortest path around static obstacles; movable objects are ignored.

    It is what a robot does that knows its map and not its surroundings, so every other planner is
    measured against it. The clearance is the circumscribed radius of the footprint, or, where the
    goal cannot be reached with that, the inscribed one.

    Args:
        spacing: distance between the poses of the plan, in circumscribed radii.
    """

    spacing: float = 0.15

    def __post_init__(self) -> None:
        number("spacing", self.spacing, low=0.0, open_low=True)

    def plan(
        self, world: World, *, stop: Stop | None = None, rng: np.random.Generator | None = None
    ) -> PlanResult:
        """Plan from ``world``; exact and without chance, so ``rng`` is not needed.

        An iteration is about a millisecond of the search. The status is `PATH_ONLY` where the
        robot cannot drive the path as it stands.
        """
        call = PlanningCall(world, stop, rng)
        world = call.world
        robot = world.robot
        goal = world.navigation_goal
        start = world.robot_pose[:2]
        looks = 0
        late = False

        def stopped() -> bool:
            nonlocal looks, late
            late = call.check(looks, math.inf)
            looks = looks + 1
            return late

        for clearance in (robot.circumscribed_radius, robot.inscribed_radius):
            path = VisibilityGraph(keep_out(world), clearance).to_goal(start, goal, stopped)
            if late:
                return call.result(call.stopped_status, iterations=looks)
            if np.isfinite(path.length):
                return polyline_result(call, path.points, self.spacing, looks)
        if start_margin(world, 0.0) is None:
            return call.result(PlanStatus.START_BLOCKED)
        return call.result(PlanStatus.GOAL_UNREACHABLE)


def straight(planner: Planner | None = None) -> PlanFollower:
    """Follows the shortest path around the walls through whatever is in the way."""
    return PlanFollower(planner or ShortestPath(), PurePursuit())
