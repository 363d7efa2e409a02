"""The planner and the policy for navigation among movable obstacles."""

from __future__ import annotations

import functools
import time
import weakref
from dataclasses import replace

import numpy as np
import pytest

from pushplan.core import motion as core
from pushplan.envs.tasks.namo import NamoTask
from pushplan.evaluation import JobSettings, run_episode
from pushplan.interaction import QuasiStatic
from pushplan.motion.collision import footprint, obstacles
from pushplan.motion.keyholes import KeyholeConfig, KeyholeSearch
from pushplan.perception.movability import Movability
from pushplan.planners import make_planner, make_policy
from pushplan.scenarios import suite, suite_names
from pushplan.world import (
    Cancellation,
    Deadline,
    GoalDisc,
    GoalLine,
    GoalPose,
    InvalidInputError,
    MaxIterations,
    Movables,
    Plan,
    PlanResult,
    PlanStatus,
    StaticMap,
    Twist,
    World,
    maze_robot,
    stream,
)

ENOUGH = MaxIterations(700)
SQUARE = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


@functools.cache
def start(layout: str, seed: int = 1) -> tuple[World, tuple[int, ...]]:
    """A start, and the boxes that its opening moves."""
    task = NamoTask(variations={"layout": layout})
    world = task.start(stream(seed, "layout"))
    return world, tuple(box for step in task.opening for box in step.boxes)


def plan(world: World, stop: object = ENOUGH, **options: object) -> PlanResult:
    planner = make_planner("namo", **options)
    return planner.plan(world, stop=stop, rng=np.random.default_rng(3))  # type: ignore[arg-type]


def digest(found: Plan) -> bytes:
    assert found.object_poses is not None
    return found.poses.tobytes() + found.times.tobytes() + found.object_poses.tobytes()


def dead_end() -> World:
    """A corridor with the goal at its end, and a box as wide as the corridor before it."""
    ends = [[[-7, 0], [-6, 0], [-6, 2.2], [-7, 2.2]], [[10, 0], [11, 0], [11, 2.2], [10, 2.2]]]
    sides = [[[-7, y], [11, y], [11, y + 1], [-7, y + 1]] for y in (-1.0, 2.2)]
    return World(
        robot=maze_robot("differential"),
        robot_pose=[0.0, 1.1, 0.0],
        static=StaticMap.build([*sides, *ends], bounds=[-6, 0, 10, 2.2]),
        movables=Movables.from_outlines([0.8 * SQUARE], [[7.0, 1.1, 0.0]]),
        goal=GoalDisc(np.array([9.0, 1.1]), 0.5),
    )


def keeps_from_walls(found: Plan, world: World, margin: float = 0.0) -> bool:
    """Whether the robot, grown by a margin in R, touches no wall on a plan."""
    shape = footprint(world.robot, margin * world.robot.circumscribed_radius)
    checker = core.CollisionChecker(shape, obstacles(world.static))
    return checker.first_blocked(found.poses) == len(found.poses)


@pytest.mark.parametrize(
    "layout", ["one_box", "aside", pytest.param("order", marks=pytest.mark.slow)]
)
def test_plans_open_the_way_and_touch_no_wall(layout: str) -> None:
    world, boxes = start(layout)
    found = plan(world, straight_iterations=0)
    assert found.status is PlanStatus.SOLVED and found.plan is not None
    poses = found.plan.poses
    assert keeps_from_walls(found.plan, world)
    np.testing.assert_array_equal(poses[0], world.robot_pose)
    assert world.navigation_goal.distance(*poses[-1, :2]) == 0.0
    assert QuasiStatic(friction=0.1, static_friction=0.5).sweep(world, poses).jammed_at == -1
    assert found.stats.detail["openings"] == len(boxes)
    assert (found.plan.speeds < 0.0).any()  # backs off
    assert digest(found.plan) == digest(plan(world, straight_iterations=0).plan)  # type: ignore[arg-type]


def test_a_plan_that_opens_the_way_ends_at_a_pose() -> None:
    world, boxes = start("one_box")
    place = world.navigation_goal.center  # type: ignore[union-attr]
    world = replace(world, goal=GoalPose(place, 0.02, 2.0, 0.05))
    found = plan(world, straight_iterations=0)
    assert found.plan is not None
    assert found.stats.detail["openings"] == len(boxes)
    assert world.navigation_goal.reached_by(found.plan.poses[-1])
    assert keeps_from_walls(found.plan, world)


@pytest.mark.parametrize("margin", [0.0, 0.15])
def test_a_plan_straight_through_keeps_its_margin_where_pushes_are_found(margin: float) -> None:
    world, _ = start("one_box")
    found = plan(world, MaxIterations(10_000), straight_margin=margin)
    assert found.plan is not None and "openings" not in found.stats.detail  # the navigator's
    assert keeps_from_walls(found.plan, world, margin)
    assert keeps_from_walls(found.plan, world, 0.15) == (margin > 0.0)


def test_an_open_way_is_the_navigators() -> None:
    world, _ = start("one_box")
    opened = world.moved(movable_poses=world.movables.poses + np.array([2.9, 0.0, 0.0]))
    rng = np.random.default_rng(3)
    expected = make_planner("push-aware").plan(opened, stop=ENOUGH, rng=rng)
    assert digest(plan(opened).plan) == digest(expected.plan)  # type: ignore[arg-type]


def test_statuses_without_a_plan() -> None:
    world, _ = start("one_box")
    held = plan(world.believing([True]))
    assert held.status is PlanStatus.GOAL_UNREACHABLE and held.plan is None
    assert plan(world, MaxIterations(1)).status is PlanStatus.TIMED_OUT
    token = Cancellation()
    token.cancel()
    assert plan(world, token).status is PlanStatus.CANCELLED
    stuck = dead_end()
    assert plan(stuck).status is PlanStatus.WAY_CLOSED
    rest = plan(stuck, ENOUGH, straight_iterations=0)
    assert rest.status is PlanStatus.WAY_CLOSED and "held not to move" in rest.status.remedy


def test_bad_input_is_named() -> None:
    world, _ = start("one_box")
    with pytest.raises(InvalidInputError, match="world"):
        plan("a world")  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="clearance"):
        make_planner("namo", clearance=-1.0)
    with pytest.raises(InvalidInputError, match="straight_margin"):
        make_planner("namo", straight_margin=np.nan)
    for wrong in ((np.nan,), (), ("a",), 5):
        with pytest.raises(InvalidInputError, match="offsets"):
            make_planner("namo", offsets=wrong)
    with pytest.raises(InvalidInputError, match=r"movables\.fixed"):
        world.believing([True, False, True])
    line = GoalLine(np.array([13.0, 4.0]), np.array([1.0, 0.0]))
    assert plan(World(world.robot, world.robot_pose, world.static, world.movables, line)).plan


def test_what_stops_the_robot_is_believed_fixed_until_it_moves() -> None:
    world, _ = start("one_box")
    box = world.movables.poses[0]
    there = world.moved(robot_pose=[box[0] - 0.5 - 0.7, box[1], 0.0])
    movability = Movability(there.robot)
    believed = there
    for step in range(8):
        believed = movability.update(there.moved(time=float(step)))
        movability.send(Twist(0.15, 0.0))
    assert believed.movables.fixed.all() and movability.stopped_by == {0}
    later = there.moved(movable_poses=[box + np.array([0.2, 0.0, 0.0])], time=9.0)
    assert not movability.update(later).movables.fixed.any()


def test_what_was_told_is_dropped_where_nothing_else_is_left() -> None:
    world = start("one_box")[0].believing([True])
    movability = Movability(world.robot)
    assert movability.update(world).movables.fixed.all()
    movability.drop_prior()
    assert movability.update(world).movables.fixed.all()  # the same instant
    assert not movability.update(world.moved(time=1.0)).movables.fixed.any()


def test_the_same_instant_has_one_command_where_there_is_no_plan() -> None:
    world = start("one_box")[0].believing([True])
    policy = make_policy("namo", stop=MaxIterations(40))
    policy.reset(world, np.random.default_rng(0))
    assert policy.act(world) == policy.act(world)
    policy.act(world.moved(time=0.1))


def test_a_robot_that_cannot_turn_does_not_get_free_through_a_wall() -> None:
    """In a narrow dead end the nearest place to turn is behind the thin wall ahead."""
    sides = [[-4.0, 0.65, 0.75, 0.65], [-4.0, -0.65, 0.75, -0.65], [0.75, -0.65, 0.75, 0.65]]
    world = World(
        robot=maze_robot("differential"),
        robot_pose=[0.0, 0.0, 0.0],
        static=StaticMap.build(segments=sides, radii=0.01, bounds=[-8, -5, 12, 5]),
        movables=Movables.from_outlines([0.5 * SQUARE], [[8.0, 4.0, 0.0]]),
        goal=GoalDisc(np.array([9.0, 0.0]), 0.5),
    )
    ends = KeyholeSearch(world, KeyholeConfig(), QuasiStatic(), lambda pushes: pushes > 50)
    assert ends.run() is None
    search = weakref.ref(ends)
    del ends
    assert search() is None  # its distances are large: they do not wait for the garbage collector


@pytest.mark.slow
@pytest.mark.usefixtures("cpu_time")
def test_an_open_way_is_found_within_the_deadline() -> None:
    places = np.random.default_rng(0).uniform(2.0, 40.0, (2, 40)).T
    world = World(
        robot=maze_robot("differential"),
        robot_pose=[1.5, 1.5, 0.0],
        static=StaticMap.build([[[20, 20], [21, 20], [21, 21], [20, 21]]], bounds=[0, 0, 42, 42]),
        movables=Movables.from_outlines(
            [0.5 * SQUARE] * 40, np.column_stack([places, np.zeros(40)])
        ),
        goal=GoalDisc(np.array([40.0, 40.0]), 0.5),
    )
    plan(world, MaxIterations(10))  # of this size for the first time
    began = time.perf_counter()
    found = plan(world, Deadline(0.5))
    assert found.status is PlanStatus.SOLVED and time.perf_counter() - began < 1.0


def episode_succeeds(name: str, number: int) -> bool:
    scenario = suite(name, episodes=number + 1, first_seed=1000).scenarios[number]
    policy = make_policy("namo")
    return run_episode(JobSettings().environment(scenario, policy), policy, scenario).success


@pytest.mark.parametrize(
    ("name", "number"),
    [pytest.param("namo-2d-order", 0, marks=pytest.mark.slow), ("namo-2d-fixed", 2)],
)
def test_an_episode_ends_in_the_goal(name: str, number: int) -> None:
    assert episode_succeeds(name, number)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in suite_names() if name.startswith("namo-")])
def test_episodes_of_each_suite_end_in_the_goal(name: str) -> None:
    for number in range(3 if "fixed" in name else 1):  # three beliefs
        assert episode_succeeds(name, number)
