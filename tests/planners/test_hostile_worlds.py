"""Worlds, robots and threads that planners and policies have to cope with."""

from __future__ import annotations

import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from conftest import make_boxes, make_robot, make_u_maze, quickest, scattered_boxes, solved_by
from shapely import Polygon
from shapely.ops import unary_union

from pushplan.control import TwistLimiter
from pushplan.core import motion as core
from pushplan.interaction import QuasiStatic
from pushplan.planners import make_planner, make_policy, planner_names, policy_for
from pushplan.planners.rrt import GeometricRRT, GeometricRRTConfig, KinodynamicRRT
from pushplan.world import (
    Deadline,
    Drive,
    FirstSolution,
    GoalDisc,
    GoalLine,
    InvalidInputError,
    MaxIterations,
    Movables,
    PlanResult,
    PlanStats,
    PlanStatus,
    Receptacle,
    RobotModel,
    StaticMap,
    Twist,
    World,
    maze_robot,
)
from pushplan.world.outline import transform

SOON = FirstSolution() | MaxIterations(20_000)
SQUARE = 0.5 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])


def square_robot(side: float, **limits: object) -> RobotModel:
    fields = {"mass": 1.0, "drive": "differential", "max_speed": 0.5, "max_turn_rate": 1.0}
    return RobotModel.from_outline(side * SQUARE, **{**fields, **limits})


def hall(side: float, robot: RobotModel, start, goal, radius: float, walls=(), boxes=()) -> World:
    return World(
        robot=robot,
        robot_pose=start,
        static=StaticMap.build(segments=walls, radii=0.1, bounds=[0, 0, side, side]),
        movables=make_boxes(boxes),
        goal=GoalDisc(goal, radius),
    )


@pytest.mark.parametrize("name", planner_names(open_water=False))
@pytest.mark.parametrize("side", [20, 50, 100])
def test_a_small_goal_in_a_large_hall(name, side):
    world = hall(
        side, square_robot(0.35), [0.3 * side, 0.5 * side, 0], [0.75 * side, side / 2], 0.1
    )
    result = make_planner(name).plan(world, stop=SOON)
    if name != "geometric-rrt":  # a blind tree may miss it, and then says so
        assert result.status in solved_by(name)
    assert result.status in (*solved_by(name), PlanStatus.TIMED_OUT)


@pytest.mark.parametrize("name", planner_names())
@pytest.mark.parametrize(
    ("given", "what"),
    [
        (({}, None, None), "world must be a World"),
        ((make_u_maze(), 0.05, None), "stop must be a Stop"),
        ((make_u_maze(), None, 7), "rng must be a Generator"),
    ],
)
def test_wrong_arguments_are_named(name, given, what):
    world, stop, rng = given
    with pytest.raises(InvalidInputError, match=what):
        make_planner(name).plan(world, stop=stop, rng=rng)


@pytest.mark.parametrize("name", planner_names())
def test_wrong_settings_are_named(name):
    planner = make_planner(name)
    for option in ("config", "interaction", "network"):
        if hasattr(planner, option):
            with pytest.raises(InvalidInputError, match=f"{option} must be a"):
                replace(planner, **{option: {"price": 1}})


@pytest.mark.parametrize("name", planner_names())
def test_ships_that_hardly_turn(name):
    water = StaticMap.build(bounds=[0, 0, 12, 20])
    for rate in (1e-3, 1e-9):
        robot = make_robot(max_turn_rate=rate)
        world = World(robot, [6, 1, np.pi / 2], water, make_boxes([]), GoalLine([6, 9.0], [0, 1.0]))
        if rate == 1e-9 and name.startswith("ship"):
            with pytest.raises(InvalidInputError, match="turning radius"):
                make_planner(name).plan(world)
        else:
            assert make_planner(name).plan(world, stop=SOON).status.has_plan


@pytest.mark.usefixtures("cpu_time")
def test_a_heap_of_boxes_does_not_stop_the_clock():
    rng = np.random.default_rng(7)
    heap = np.column_stack([rng.uniform(0, 10, (200, 2)), rng.uniform(-3, 3, 200)])
    world = hall(10, make_robot(), [1, 1, 0.8], [9, 9], 0.5)
    boxes = Movables.from_outlines([SQUARE * 10 ** rng.uniform(-3, 0, 2) for _ in heap], heap)
    world = World(world.robot, world.robot_pose, world.static, boxes, world.goal)
    for name in ("kinodynamic-rrt", "push-aware"):
        planner = make_planner(name)
        assert quickest(lambda planner=planner: planner.plan(world, stop=Deadline(0.05))) < 0.2


@pytest.mark.parametrize("door", [0.8, 1.3])
@pytest.mark.parametrize("at", [11.3, 29.9, 44.4])
def test_a_door_in_a_large_hall(door, at):
    walls = [[30, 0, 30, at - door / 2 - 0.1], [30, at + door / 2 + 0.1, 30, 60]]
    world = hall(60, square_robot(0.35), [20, 30, 0], [40, 30], 1.0, walls)
    assert make_planner("kinodynamic-rrt").plan(world, stop=SOON).status is PlanStatus.SOLVED


@pytest.mark.parametrize(("box_mass", "robot_mass"), [(1e6, 1.0), (1.0, 1e-6), (1e-6, 1e6)])
def test_masses_of_any_ratio(box_mass, robot_mass):
    walls = [[0, 8.5, 20, 8.5], [0, 11.5, 20, 11.5]]
    world = hall(20, make_robot(mass=robot_mass), [3, 10, 0], [16, 10], 1.0, walls)
    box = Movables.from_outlines([2.7 * SQUARE], [[8, 10, 0]], masses=[box_mass])
    world = World(world.robot, world.robot_pose, world.static, box, world.goal)
    result = make_planner("kinodynamic-rrt").plan(world, stop=SOON)
    assert result.status is PlanStatus.SOLVED
    assert result.plan.interaction_cost > box_mass


@pytest.mark.usefixtures("cpu_time")
def test_a_speck_does_not_stop_the_clock():
    speck = Movables.from_outlines([SQUARE, 1e-5 * SQUARE], [[10, 9, 0.0], [9, 9, 0]])
    world = make_u_maze(movables=speck)
    planner = make_planner("kinodynamic-rrt")
    assert planner.plan(world, stop=Deadline(0.15)).plan is not None
    assert quickest(lambda: planner.plan(world, stop=Deadline(0.15))) < 0.35


@pytest.mark.usefixtures("cpu_time")
def test_many_columns_do_not_stop_the_clock():
    columns = [
        SQUARE + np.array([x, y])
        for x in np.arange(3, 58, 4.0)
        for y in np.arange(3, 58, 4.0)
        if x != y
    ]
    world = make_u_maze(
        static=StaticMap.build(polygons=columns, bounds=[0, 0, 60, 60]),
        robot_pose=[1, 1, 0.7],
        goal=GoalDisc([55, 57.0], 1.5),
    )
    planner = make_planner("kinodynamic-rrt")
    began = time.perf_counter()
    planner.plan(world, stop=Deadline(0.3))  # the first call: nothing is cached for this map
    assert time.perf_counter() - began < 0.8


@pytest.mark.usefixtures("cpu_time")
def test_a_busy_thread_does_not_break_anothers_deadline():
    sealed = make_u_maze(
        static=StaticMap.build(
            segments=[
                [0, 0, 15, 0],
                [0, 0, 0, 15],
                [15, 0, 15, 15],
                [0, 15, 15, 15],
                [7, 0, 7, 15],
            ],
            radii=0.5,
        )
    )
    slow = GeometricRRT(GeometricRRTConfig(pass_iterations=10**6))
    busy = threading.Thread(target=lambda: slow.plan(sealed, stop=Deadline(0.8)))
    world, planner = make_u_maze(scattered_boxes(3, 0)), make_planner("kinodynamic-rrt")
    busy.start()
    time.sleep(0.2)
    began = time.perf_counter()
    planner.plan(world, stop=Deadline(0.1))
    took = time.perf_counter() - began
    busy.join()
    assert took < 0.5


@pytest.mark.parametrize("rate", [0.5, pytest.param(3.0, marks=pytest.mark.slow), 1e4])
def test_tight_turns_do_not_touch_walls_between_poses(rate):
    plank = RobotModel.from_outline(
        SQUARE * [1.2, 0.2],
        mass=1.0,
        drive=Drive.CONSTANT_SPEED,
        max_speed=0.15,
        max_turn_rate=rate,
    )
    rng = np.random.default_rng(0)
    posts = [0.02 * SQUARE + spot for spot in rng.uniform(1, 9, (25, 2))]
    for seed in range(2):
        world = World(
            plank,
            [0.7, 0.7, 0.8],
            StaticMap.build(polygons=posts, bounds=[0, 0, 10, 10]),
            Movables.empty(),
            GoalDisc([9.2, 9.2], 0.5),
        )
        stop = FirstSolution() | MaxIterations(6000)
        plan = (
            make_planner("kinodynamic-rrt")
            .plan(world, stop=stop, rng=np.random.default_rng(seed))
            .plan
        )
        assert plan is not None
        walls = unary_union([Polygon(post) for post in posts])
        assert np.abs(np.diff(plan.poses[:, 2])).max() < 0.2
        for a, b in zip(plan.poses[:-1], plan.poses[1:], strict=True):
            for share in (0.0, 0.25, 0.5, 0.75):
                outline = Polygon(transform(a + share * (b - a), plank.parts[0]))
                assert outline.intersection(walls).area < 0.02**2  # at most a corner's graze


@pytest.mark.parametrize("rate", [0.4, 1.0])
def test_headings_of_a_plan_never_jump(rate):
    for seed in range(3):
        world = make_u_maze(scattered_boxes(5, seed), robot=make_robot(max_turn_rate=rate))
        plan = (
            KinodynamicRRT()
            .plan(world, stop=MaxIterations(2500), rng=np.random.default_rng(seed))
            .plan
        )
        assert np.abs(np.diff(plan.poses[:, 2])).max() < 0.3


def test_headings_may_be_given_with_any_number_of_turns():
    world = make_u_maze([[9, 9, 0]])
    path = np.empty((60, 3))
    path[0] = [11.25, 3.75, np.pi / 2]
    for i in range(1, 60):
        core.along_arc(path[i - 1], 0.1, 0.05, path[i])
    turned = path + np.outer(np.arange(60) % 3, [0, 0, 2 * np.pi])
    plain, wound = (QuasiStatic().sweep(world, p) for p in (path, turned))
    assert wound.work == pytest.approx(plain.work, abs=1e-9)


def test_thin_things_do_not_tunnel():
    plank = Movables.from_outlines([SQUARE * [0.1, 2.0]], [[2.0, 0.0, 0.0]])
    wall = StaticMap.build(polygons=[SQUARE * [0.1, 8.0] + [3.0, 0.0]], bounds=[-5, -5, 8, 5])
    world = make_u_maze(movables=plank, static=wall, robot_pose=[0, 0, 0])
    path = np.column_stack([np.linspace(0, 6, 61), np.zeros(61), np.zeros(61)])
    result = QuasiStatic().sweep(world, path)
    assert result.jammed_at > 0
    assert result.object_poses[:, 0, 0].max() < 3.0


def test_a_plan_that_is_solved_ends_in_the_goal():
    for rate in (1e-9, 1e-8, 1e-3):
        world = make_u_maze(
            static=StaticMap.build(bounds=[0, 0, 10, 10]),
            robot=make_robot(max_turn_rate=rate),
            robot_pose=[2, 5, 0],
            goal=GoalDisc([8, 5.3], 0.8),
        )
        result = make_planner("kinodynamic-rrt").plan(world, stop=MaxIterations(1500))
        if result.plan is not None:
            assert world.goal.distance(*result.plan.poses[-1, :2]) <= 1e-6


@pytest.mark.parametrize("name", planner_names(open_water=False))
def test_a_start_in_a_wall_or_out_of_bounds_is_blocked(name):
    inside = make_u_maze(robot_pose=[7.5, 3.0, 0.0])
    assert make_planner(name).plan(inside, stop=MaxIterations(100)).status is (
        PlanStatus.START_BLOCKED
    )


@pytest.mark.parametrize("name", planner_names(open_water=False))
def test_a_goal_out_of_bounds_is_said_to_be_out_of_reach(name):
    world = make_u_maze(goal=GoalDisc((40.0, 4.0), 0.5))
    result = make_planner(name).plan(world, stop=MaxIterations(50))
    assert result.status is PlanStatus.GOAL_UNREACHABLE


def test_the_geometric_tree_stays_in_bounds():
    world = make_u_maze(
        static=StaticMap.build(bounds=[0, 0, 5, 5]),
        robot_pose=[2, 2, 0],
        goal=GoalDisc([8, 8], 1.0),
    )
    assert make_planner("geometric-rrt").plan(world, stop=MaxIterations(2000)).plan is None


class NoPlan:
    """A planner that never finds anything."""

    def plan(self, world, *, stop=None, rng=None):
        return PlanResult(PlanStatus.TIMED_OUT, None, PlanStats(0.0))


def test_a_robot_without_a_plan_stands_at_first():
    assert (
        policy_for(NoPlan()).act(make_u_maze(robot=make_robot(drive="differential"))).linear == 0.0
    )


def test_objects_may_come_and_go():
    policy = make_policy("kinodynamic-rrt")
    boxes = [[4, 9, 0.3], [10, 12, 0], [13, 8, 0.7]]
    policy.reset(make_u_maze(boxes), np.random.default_rng(0))
    for step, count in enumerate((3, 2, 0, 3)):
        policy.act(make_u_maze(boxes[:count], time=0.8 * step))
    assert len(policy.plan_log) == 4


@pytest.mark.parametrize(
    ("acceleration", "turning"), [(0.1, np.inf), (np.inf, 3.0), (1e-9, 1e9), (1e-12, 1e-12)]
)
def test_any_limits_of_acceleration(acceleration, turning):
    robot = make_robot(
        drive="differential",
        max_speed=1.0,
        max_turn_rate=1.0,
        max_acceleration=acceleration,
        max_turn_acceleration=turning,
    )
    limiter, rng, speed = TwistLimiter(robot), np.random.default_rng(0), 0.0
    for _ in range(100):
        now = limiter.step(Twist(rng.uniform(0, 1), rng.uniform(-1, 1)), 0.1)
        assert abs(now.linear - speed) <= acceleration * 0.1 + 1e-9
        speed = now.linear


def test_a_slow_axis_does_not_hold_up_the_other():
    robot = make_robot(
        drive="differential",
        max_speed=1.0,
        max_turn_rate=1.0,
        max_acceleration=0.1,
        max_turn_acceleration=100.0,
    )
    limiter = TwistLimiter(robot)
    for _ in range(5):
        now = limiter.step(Twist(1.0, 1.0), 0.1)
    assert now.angular == pytest.approx(1.0)
    assert now.linear < 0.06


def test_a_drive_that_cannot_stop_is_refused():
    with pytest.raises(InvalidInputError, match="min_speed"):
        make_robot(drive="differential", min_speed=0.05)


@pytest.mark.parametrize("name", ["greedy", "gtsp", "gtsp-mpc", "mppi"])
def test_nobody_pushes_boxes_that_are_fixed(name):
    world = World(
        robot=maze_robot("differential"),
        robot_pose=[2.0, 4.0, 0.0],
        static=StaticMap.build([], bounds=[0, 0, 12, 8]),
        movables=Movables.from_outlines([0.5 * SQUARE], [[4.0, 4.0, 0.0]], fixed=[True]),
        goal=Receptacle([[10, 2], [12, 2], [12, 6], [10, 6]]),
    )
    policy = make_policy(name)
    policy.reset(world, np.random.default_rng(0))
    assert policy.act(world) == Twist(0.0, 0.0)
    free = world.believing([False])
    policy.reset(free, np.random.default_rng(0))
    assert policy.act(free) != Twist(0.0, 0.0)
