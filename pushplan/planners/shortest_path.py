"""`ShortestPath`: the shortest path around the walls, through all objects. The lower reference."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass, replace

import numpy as np

from pushplan.geometry import VisibilityGraph
from pushplan.interaction import QuasiStatic
from pushplan.motion.keep_out import keep_out
from pushplan.motion.path_planner import plan_path
from pushplan.motion.path_search_config import PathSearchConfig
from pushplan.motion.polyline_plan import polyline_result
from pushplan.motion.speed_profile import start_margin
from pushplan.planners.following.plan_controller import PlanController
from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.world import Drive, Movables, Planner, PlanResult, PlanStatus, Stop, World
from pushplan.world.checks import number
from pushplan.world.planning_call import PlanningCall


@dataclass(frozen=True)
class ShortestPath:
    """The shortest path around static obstacles; movable objects are ignored.

    It is what a robot does that knows its map and not its surroundings, so every other planner is
    measured against it. The clearance is the circumscribed radius of the footprint, or, where the
    goal cannot be reached with that, the inscribed one. A car is led along it by the shortest
    curves that it can drive, where those touch no wall.

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
                result = polyline_result(call, path.points, self.spacing, looks)
                if (
                    robot.drive is Drive.CAR or robot.slides
                ) and result.status is not PlanStatus.SOLVED:
                    return _in_curves(call, looks) or result
                return result
        if start_margin(world, 0.0) is None:
            return call.result(PlanStatus.START_BLOCKED)
        return call.result(PlanStatus.GOAL_UNREACHABLE)


def _in_curves(call: PlanningCall, looks: int) -> PlanResult | None:
    """The path as a car or an omnidirectional robot can drive it; None where it hits a wall."""
    alone = copy.copy(call)
    alone.world = replace(call.world, movables=Movables.empty())
    found = plan_path(alone, PathSearchConfig(), QuasiStatic(), "shortest_path").plan
    if found is None:
        return None
    plan = replace(found, object_poses=None)
    return call.result(PlanStatus.SOLVED, plan, call.elapsed, looks)


def straight(planner: Planner | None = None) -> PlanFollower:
    """Follows the shortest path around the walls through whatever is in the way."""
    return PlanFollower(
        planner or ShortestPath(), PlanController(follows=(Drive.CAR, Drive.OMNIDIRECTIONAL))
    )
