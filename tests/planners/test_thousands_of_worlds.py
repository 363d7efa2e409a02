"""A plan never touches a wall and keeps the turn limit, in any world; else there is a status."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from conftest import OCTAGON, SQUARE
from shapely import Polygon

from pushplan.planners import make_planner
from pushplan.world import (
    FirstSolution,
    GoalDisc,
    GoalLine,
    MaxIterations,
    Movables,
    PlanStatus,
    RobotModel,
    StaticMap,
    World,
)
from pushplan.world.outline import transform

pytestmark = pytest.mark.warm("push-aware", "kinodynamic-rrt")

HULLS = {
    "octagon": OCTAGON,
    "plank": SQUARE * [1.4, 0.2],
    "cart": 0.5 * SQUARE + [0.25, 0.0],  # turns about the middle of its rear edge
    "tractor": 0.5 * SQUARE + [0.6, 0.0],  # turns about a point outside of it
}
SOON = FirstSolution() | MaxIterations(400)
BETWEEN = np.array([0.0, 0.25, 0.5, 0.75])


def random_world(seed: int) -> World:
    """Ten metres of posts, slivers and walls; starts and goals may lie in them."""
    rng = np.random.default_rng(seed)
    hull = rng.choice(list(HULLS))
    robot = RobotModel.from_outline(
        HULLS[hull] * rng.uniform(0.3, 1.0),
        mass=10 ** rng.uniform(-2, 2),
        drive=str(rng.choice(["constant_speed", "differential"])),
        max_speed=0.15,
        max_turn_rate=10 ** rng.uniform(-1.5, 0.5),
    )
    posts = [
        SQUARE * rng.uniform(0.01, 0.8, 2) + spot
        for spot in rng.uniform(0, 10, (rng.integers(0, 16), 2))
    ]
    ends = rng.uniform(0, 10, (rng.integers(0, 4), 4))
    if rng.random() < 0.1:
        ends = np.array([[0, 5, 10, 5.0]])  # from side to side
    few = int(rng.integers(0, 10)) if rng.random() < 0.99 else 200
    boxes = [SQUARE * 10 ** rng.uniform(-3, 0, 2) for _ in range(few)]
    poses = np.column_stack([rng.uniform(0, 10, (few, 2)), rng.uniform(-3, 3, few)])
    goal = GoalDisc(rng.uniform(0, 10, 2), float(rng.uniform(0.05, 1.5)))
    return World(
        robot,
        [*rng.uniform(0, 10, 2), rng.uniform(-3, 3)],
        StaticMap.build(polygons=posts, segments=ends, radii=0.05, bounds=[0, 0, 10, 10]),
        Movables.from_outlines(boxes, poses.reshape(-1, 3)),
        goal if rng.random() < 0.7 else GoalLine([5.0, 8.5], [0.0, 1.0]),
    )


def walls_of(world: World) -> shapely.Geometry:
    return shapely.union_all([Polygon(part) for part in world.static.convex_parts])


def check_drivable(world: World, plan) -> None:
    """Free of walls at the poses and between them, and within the limits of the robot."""
    robot, walls, size = world.robot, walls_of(world), world.robot.circumscribed_radius
    shapely.prepare(walls)
    assert np.allclose(plan.poses[0], world.robot_pose, atol=1e-9)
    assert world.goal.distance(*plan.poses[-1, :2]) <= 1e-6
    steps, moved = np.diff(plan.times), np.diff(plan.poses, axis=0)
    assert np.all(np.abs(moved[:, 2]) <= robot.max_turn_rate * steps + 1e-6)
    assert np.all(np.hypot(moved[:, 0], moved[:, 1]) <= robot.max_speed * steps + 1e-6)
    shares = np.append((np.arange(len(moved))[:, None] + BETWEEN).ravel(), len(moved))
    for share in shares:
        k = min(int(share), len(moved) - 1)
        pose = plan.poses[k] + (share - k) * moved[k] if len(moved) else plan.poses[0]
        for part in robot.parts:
            outline = Polygon(transform(pose, part))
            if walls.intersects(outline):
                graze = 1e-9 if share == int(share) else (0.02 * size) ** 2
                assert outline.intersection(walls).area < graze


def plan_in(seed: int, name: str):
    world = random_world(seed)
    result = make_planner(name).plan(world, stop=SOON, rng=np.random.default_rng(seed))
    assert (result.plan is not None) == result.status.has_plan
    return world, result.plan, result.status


def run(name: str, seeds: range, check, least: float) -> None:
    """Check every plan that is called solved; so many of the worlds must have one."""
    solved = 0
    for seed in seeds:
        world, plan, status = plan_in(seed, name)
        if status is PlanStatus.SOLVED:
            solved += 1
            try:
                check(world, plan)
            except AssertionError as error:
                raise AssertionError(f"world {seed}: {error}") from error
    assert solved >= least * len(seeds)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["push-aware", "kinodynamic-rrt"])
def test_plans_can_be_driven(name):
    run(name, range(1000), check_drivable, least=0.2)


@pytest.mark.parametrize("name", ["push-aware", "kinodynamic-rrt"])
def test_some_plans_can_be_driven(name):
    run(name, range(2000, 2100), check_drivable, least=0.2)


@pytest.mark.parametrize("name", ["straight", "skeleton", "geometric-rrt"])
def test_paths_for_a_point_are_called_solved_where_they_can_be_driven(name):
    run(name, range(3000, 3100), check_drivable, least=0.0)
    aligned = random_world(7)
    free = StaticMap.build(bounds=[0, 0, 10, 10])
    easy = World(aligned.robot, [2.0, 5.0, 0.0], free, Movables.empty(), GoalDisc([8.0, 5.0], 0.5))
    if name == "straight":
        result = make_planner(name).plan(easy)
        assert result.status is PlanStatus.SOLVED
        check_drivable(easy, result.plan)
    turned = easy.moved(robot_pose=[2.0, 5.0, 1.0])
    assert make_planner(name).plan(turned, stop=SOON).status is PlanStatus.PATH_ONLY
