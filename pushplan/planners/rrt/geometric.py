"""`GeometricRRT`: the two-pass random tree that the Bench-Push paper compares with."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np
from ompl import base, geometric

from pushplan.compiled import kernel, owned
from pushplan.geometry import core_distance
from pushplan.motion.collision import ConvexObstacles, obstacles
from pushplan.motion.polyline import polyline_plan
from pushplan.motion.random_tree.ompl_lock import own_state, seeded_ompl
from pushplan.motion.speed_profile import start_margin
from pushplan.planners.arguments import check_call
from pushplan.world import (
    MaxIterations,
    NavigationGoal,
    Plan,
    PlanResult,
    PlanStats,
    PlanStatus,
    Stop,
    StopCheck,
    World,
)
from pushplan.world.checks import FloatArray, expect, integer, number


@dataclass(frozen=True)
class GeometricRRTConfig:
    """Parameters of `GeometricRRT`. Lengths are in units of the robot's circumscribed radius R.

    Args:
        clearance: distance kept between the robot's centre and obstacles [R], as far as there is
            room; the reference grows its robot by about as much.
        step: longest edge of the tree [R].
        goal_bias: fraction of samples drawn from the goal.
        resolution: distance between collision checks along an edge [R].
        pass_iterations: samples in each pass.
        spacing: distance between the poses of the plan [R].
    """

    clearance: float = 1.9
    step: float = 1.0
    goal_bias: float = 0.1
    resolution: float = 0.1
    pass_iterations: int = 20_000
    spacing: float = 0.15

    def __post_init__(self) -> None:
        for name in ("clearance", "step", "resolution", "spacing"):
            number(name, getattr(self, name), low=0.0, open_low=True)
        number("goal_bias", self.goal_bias, low=0.0, high=1.0)
        integer("pass_iterations", self.pass_iterations, low=1)


@dataclass(frozen=True)
class GeometricRRT:
    """RRT for a disc (LaValle 1998): first around the objects, then, if that fails, through them.

    Where the second pass fails too, it is repeated with less clearance.

    The plan is the raw path of the tree, a zigzag that ignores how the robot turns and what
    pushing costs: the reference that the other planners improve on.

    Args:
        config: parameters.
    """

    config: GeometricRRTConfig = field(default_factory=GeometricRRTConfig)

    def __post_init__(self) -> None:
        expect("config", self.config, GeometricRRTConfig)

    def plan(
        self,
        world: World,
        *,
        stop: Stop | None = None,
        rng: np.random.Generator | None = None,
    ) -> PlanResult:
        """Plan from ``world``; see `pushplan.world.Planner`. One iteration is one sample."""
        began = time.perf_counter()
        check_call(world, stop, rng)
        config = self.config
        stop = MaxIterations(4 * config.pass_iterations) if stop is None else stop
        rng = np.random.default_rng(0) if rng is None else rng
        check = stop.start()
        objects = world.movables
        boxes = [objects.outline_world(k) for k in range(len(objects))]
        iterations, status, plan = 0, PlanStatus.TIMED_OUT, None
        if start_margin(world, 0.0) is None:
            return _result(PlanStatus.START_BLOCKED, None, 0, time.perf_counter() - began)
        start = owned(world.robot_pose[:2])
        size = world.robot.circumscribed_radius
        wide, narrow = config.clearance * size, world.robot.inscribed_radius
        passes = [(boxes, wide), ([], wide), ([], min(size, wide)), ([], min(narrow, wide))]
        for blocked, radius in passes:
            among = obstacles(world.static, blocked)
            if _near(start, among, radius):
                continue  # the robot starts closer to something than this pass allows
            points, used = self._grow(world, among, radius, check, iterations, rng)
            iterations += used
            if points is not None:
                plan, status = (
                    polyline_plan(world, points, config.spacing * size),
                    PlanStatus.SOLVED,
                )
                break
            if check(iterations, np.inf):
                break
        if plan is None and stop.cancelled:
            status = PlanStatus.CANCELLED
        return _result(status, plan, iterations, time.perf_counter() - began)

    def _grow(
        self,
        world: World,
        among: ConvexObstacles,
        radius: float,
        check: StopCheck,
        before: int,
        rng: np.random.Generator,
    ) -> tuple[FloatArray | None, int]:
        """One pass: the corners of a path, or None, and the samples that it took."""
        config = self.config
        used = 0

        def done() -> bool:
            nonlocal used
            used += 1
            return used >= config.pass_iterations or check(before + used, np.inf)

        seed = int(rng.integers(1, 2**31))
        with seeded_ompl(seed, lambda: check(before + used, np.inf)) as ready:
            if not ready:
                return None, used
            space = base.RealVectorStateSpace(2)
            bounds = base.RealVectorBounds(2)
            for axis in range(2):
                bounds.setLow(axis, float(among.bounds[axis]))
                bounds.setHigh(axis, float(among.bounds[axis + 2]))
            space.setBounds(bounds)
            info = base.SpaceInformation(space)
            point = np.empty(2)

            def valid(state: base.State) -> bool:
                point[0], point[1] = state[0], state[1]
                return bool(space.satisfiesBounds(state)) and not _near(point, among, radius)

            info.setStateValidityChecker(valid)
            size = world.robot.circumscribed_radius
            step = config.resolution * size / space.getMaximumExtent()
            info.setStateValidityCheckingResolution(min(step, 0.5))
            info.setup()
            problem = base.ProblemDefinition(info)
            start = own_state(base.RealVectorStateSpace, 2)
            start[0], start[1] = float(world.robot_pose[0]), float(world.robot_pose[1])
            problem.addStartState(start)
            region = _GoalRegion(info, world.navigation_goal, among.bounds, rng)
            problem.setGoal(region)
            planner = geometric.RRT(info)
            planner.setRange(config.step * size)
            planner.setGoalBias(config.goal_bias)
            planner.setProblemDefinition(problem)
            planner.setup()
            planner.solve(base.PlannerTerminationCondition(done))
            if not problem.hasExactSolution():
                return None, used
            states = problem.getSolutionPath().getStates()
            return np.array([[state[0], state[1]] for state in states]), used


class _GoalRegion(base.GoalSampleableRegion):
    """The goal as OMPL wants it: points to grow towards, and whether a point is inside."""

    def __init__(
        self,
        info: base.SpaceInformation,
        goal: NavigationGoal,
        bounds: FloatArray,
        rng: np.random.Generator,
    ) -> None:
        super().__init__(info)
        self.goal, self.bounds, self.rng = goal, bounds, rng
        self.setThreshold(1e-9)

    def sampleGoal(self, state: base.State) -> None:
        low, high = self.bounds[:2], self.bounds[2:]
        point = low + self.rng.random(2) * (high - low)
        for _ in range(30):
            candidate = low + self.rng.random(2) * (high - low)
            if self.goal.contains(candidate):
                point = candidate
                break
        else:
            point = np.clip(getattr(self.goal, "center", point), low, high)
        state[0], state[1] = float(point[0]), float(point[1])

    def maxSampleCount(self) -> int:
        return 1_000_000_000

    def distanceGoal(self, state: base.State) -> float:
        return self.goal.distance(state[0], state[1])


@kernel(allocates=True)
def _near(point: FloatArray, among: ConvexObstacles, radius: float) -> bool:
    """Whether a disc about ``point`` (2,) touches an obstacle."""
    x, y = point[0], point[1]
    for s in range(among.boxes.shape[0]):
        box = among.boxes[s]
        if x + radius < box[0] or x - radius > box[2] or y + radius < box[1] or y - radius > box[3]:
            continue
        first, last = among.offsets[s], among.offsets[s + 1]
        if core_distance(x, y, among.vertices, first, last) < radius:
            return True
    return False


def _result(status: PlanStatus, plan: Plan | None, iterations: int, wall: float) -> PlanResult:
    first = wall if plan is not None else float("nan")
    return PlanResult(status, plan, PlanStats(wall, first, iterations))
