"""`GeometricRRT`: the two-pass random tree that the Bench-Push paper compares with."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from ompl import base, geometric, util

from pushplan.core import motion as core
from pushplan.motion.collision import obstacles
from pushplan.motion.keep_out import keep_out
from pushplan.motion.polyline_plan import polyline_result
from pushplan.motion.speed_profile import goal_is_outside, start_margin
from pushplan.planners.rrt.ompl_calls import (
    GoalRegion,
    grow_to,
    ompl_alone,
    own_state,
    plane_bounds,
)
from pushplan.world import MaxIterations, NavigationGoal, PlanResult, PlanStatus, Stop, World
from pushplan.world.checked_fields import CheckedFields, PositiveFloat, PositiveInt
from pushplan.world.checks import FloatArray, expect
from pushplan.world.planning_call import PlanningCall

_GOAL_BIAS = 0.1  # fraction of samples that are drawn from the goal
_GOAL_TRIES = 30  # random points among which one in the goal is looked for
_STEP = 1.0  # longest edge of the tree [R]
_RESOLUTION = 0.1  # distance between collision checks along an edge [R]
_SPACING = 0.15  # distance between the poses of the plan [R]


@dataclass(frozen=True)
class GeometricRRTConfig(CheckedFields):
    """Parameters of `GeometricRRT`. Lengths are in units of the robot's circumscribed radius R.

    Args:
        clearance: distance kept between the robot's centre and obstacles [R], as far as there is
            room; the reference grows its robot by about as much.
        pass_iterations: samples in each pass.
    """

    clearance: PositiveFloat = 1.9
    pass_iterations: PositiveInt = 20_000


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
        self, world: World, *, stop: Stop | None = None, rng: np.random.Generator | None = None
    ) -> PlanResult:
        """Plan from ``world``; see `pushplan.world.Planner`. One iteration is one sample.

        The status is `PATH_ONLY` where the robot cannot drive the path as it stands.
        """
        config = self.config
        call = PlanningCall(world, stop, rng, MaxIterations(4 * config.pass_iterations))
        objects = world.movables
        boxes = [part for k in range(len(objects)) for part in objects.parts_world(k)]
        iterations = 0
        if start_margin(world, 0.0) is None:
            return call.result(PlanStatus.START_BLOCKED)
        if goal_is_outside(world):
            return call.result(PlanStatus.GOAL_UNREACHABLE)
        x, y = world.robot_pose[:2].tolist()
        size = world.robot.circumscribed_radius
        wide = config.clearance * size
        narrow = world.robot.inscribed_radius
        passes = [(boxes, wide), ([], wide), ([], min(size, wide)), ([], min(narrow, wide))]
        for blocked, radius in passes:
            among = obstacles(keep_out(world), blocked)
            if among.touches_disc(x, y, radius):
                continue  # the robot starts closer to something than this pass allows
            points, used = self._grow(call, among, radius, iterations)
            iterations += used
            if points is not None:
                return polyline_result(call, points, _SPACING, iterations)
            if call.check(iterations, np.inf):
                break
        return call.result(call.stopped_status, iterations=iterations)

    def _grow(
        self, call: PlanningCall, among: core.ConvexObstacles, radius: float, before: int
    ) -> tuple[FloatArray | None, int]:
        """One pass: the corners of a path, or None, and the samples that it took."""
        config = self.config
        world = call.world
        bounds = world.static.bounds
        check = call.check
        rng = call.rng
        used = 0

        def done() -> bool:
            nonlocal used
            used += 1
            return used >= config.pass_iterations or check(before + used, np.inf)

        seed = int(rng.integers(1, 2**31))
        with ompl_alone(lambda: check(before + used, np.inf)) as ready:
            if not ready:
                return None, used
            util.RNG.setSeed(seed)
            space = _plane()
            space.setBounds(plane_bounds(bounds))
            info = base.SpaceInformation(space)

            def valid(state: base.State) -> bool:
                if not space.satisfiesBounds(state):
                    return False
                return not among.touches_disc(state[0], state[1], radius)

            info.setStateValidityChecker(valid)
            size = world.robot.circumscribed_radius
            step = _RESOLUTION * size / space.getMaximumExtent()
            info.setStateValidityCheckingResolution(min(step, 0.5))
            info.setup()
            start = own_state(_plane)
            start[0] = float(world.robot_pose[0])
            start[1] = float(world.robot_pose[1])
            planner = geometric.RRT(info)
            planner.setRange(_STEP * size)
            planner.setGoalBias(_GOAL_BIAS)

            def draw(state: base.State) -> None:
                state[0], state[1] = _goal_point(world.navigation_goal, bounds, rng).tolist()

            def distance(state: base.State) -> float:
                return world.navigation_goal.distance(state[0], state[1])

            path = grow_to(GoalRegion(info, draw, distance), planner, start, done)
            if path is None:
                return None, used
            return np.array([[state[0], state[1]] for state in path.getStates()]), used


def _plane() -> base.RealVectorStateSpace:
    return base.RealVectorStateSpace(2)


def _goal_point(goal: NavigationGoal, bounds: FloatArray, rng: np.random.Generator) -> FloatArray:
    """A random point (2,) of the goal; its centre or any other where it is too small to be met."""
    low = bounds[:2]
    high = bounds[2:]
    point: FloatArray = low + rng.random(2) * (high - low)
    for _ in range(_GOAL_TRIES):
        candidate: FloatArray = low + rng.random(2) * (high - low)
        if goal.contains(candidate):
            return candidate
    return np.clip(getattr(goal, "center", point), low, high)
