"""What a `Runner` makes of a world before the policy sees it: a margin, and a surer goal."""

import numpy as np
import shapely
from conftest import make_robot, make_u_maze

from pushplan.control.executors import ImmediateExecutor
from pushplan.runtime import Runner, StateEstimator
from pushplan.world import Drive, Plan, World

ROBOT = make_robot(drive=Drive.DIFFERENTIAL, max_speed=0.5, min_speed=-0.3, max_turn_rate=1.0)
MAZE = make_u_maze(robot=ROBOT)


def first_plan(world: World, **options: float) -> Plan:
    runner = Runner("push-aware", period=0.05, executor=ImmediateExecutor(), **options)
    plan = runner.start(world).plan
    assert plan is not None
    return plan


def clearance(plan: Plan) -> float:
    walls = shapely.union_all([shapely.Polygon(part) for part in MAZE.static.convex_parts])
    return min(
        float(shapely.distance(shapely.Polygon(part), walls))
        for pose in plan.poses
        for part in MAZE.moved(robot_pose=pose).robot_outline_world()
    )


def test_plans_of_a_runner_keep_its_margin() -> None:
    assert clearance(first_plan(MAZE)) < 0.8
    assert clearance(first_plan(MAZE, margin=0.8)) >= 0.8 - 1e-3


def test_with_noise_a_plan_ends_so_deep_in_the_goal_that_the_robot_is_in_it() -> None:
    noise = 0.5

    def depth(plan: Plan) -> float:
        goal = MAZE.goal
        return goal.radius - float(np.hypot(*(plan.poses[-1, :2] - goal.center)))

    estimator = StateEstimator(0.0, 0.3, np.array([noise, noise, 0.0]), 1.0)
    sure = 3.0 * estimator.remaining_noise(MAZE.robot, 0.05)[0]
    assert depth(first_plan(MAZE)) < sure
    assert depth(first_plan(MAZE, position_noise=noise)) >= sure
