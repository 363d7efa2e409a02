"""`GivenPath`: a path that someone else has planned, as a planner."""

from __future__ import annotations

import numpy as np
import shapely

from pushplan.planners.following.replanning import rest_of
from pushplan.planners.following.splicing import passed
from pushplan.world import Plan, PlanResult, PlanStatus, Stop, World
from pushplan.world.plan import PlanStats

_LONGEST_WAY = 2.0  # time for which the robot may have driven since the path was planned [s]


class GivenPath:
    """A planner that returns the path that it was given, from where the robot is on it.

    There is no plan where the path leads through something static: the robot then waits.
    """

    def __init__(self) -> None:
        self.given: Plan | None = None
        self.made = 0.0
        self.left: float | None = None
        """What was left of the path when the robot was last on it [m]; None at its beginning."""
        self.blocked = ""
        """Why the last call returned no plan."""

    def plan(
        self, world: World, *, stop: Stop | None = None, rng: np.random.Generator | None = None
    ) -> PlanResult:
        """The rest of the path."""
        if self.given is None:
            return PlanResult(PlanStatus.TIMED_OUT, None, PlanStats(0.0))
        if self.left is None:
            driven = min(max(0.0, world.time - self.made), _LONGEST_WAY)
            index = passed(world, self.given, driven)
        else:  # the robot was stopped on its way, as by a clock that stepped back
            lengths = self.given.arc_lengths
            index = max(0, int(np.searchsorted(lengths, lengths[-1] - self.left)) - 1)
        rest = rest_of(self.given, index, None)
        self.blocked = _obstacle(world, rest)
        if self.blocked:
            return PlanResult(PlanStatus.GOAL_UNREACHABLE, None, PlanStats(0.0))
        return PlanResult(PlanStatus.SOLVED, rest, PlanStats(0.0))


def _obstacle(world: World, path: Plan) -> str:
    """What a path leads through, at whatever heading the robot drives it; else empty."""
    parts = np.array([shapely.Polygon(part) for part in world.static.convex_parts])
    clear = world.robot.inscribed_radius
    here = shapely.Point(world.robot_pose[:2])
    line = shapely.LineString(np.vstack([path.poses[:1, :2], path.poses[:, :2]]))
    hit = (shapely.distance(parts, line) < clear) & (shapely.distance(parts, here) >= clear)
    if not hit.any():
        return ""
    met = line.interpolate(min(line.project(part.centroid) for part in parts[hit]))
    return f"the path leads through something static near ({met.x:.2f}, {met.y:.2f})"
