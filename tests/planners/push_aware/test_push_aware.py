"""What the push-aware planner promises, in ordinary and in hostile worlds."""

from __future__ import annotations

import time

import numpy as np
import pytest
from conftest import SQUARE, make_boxes, make_robot, make_u_maze, quickest, scattered_boxes
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon
from shapely.ops import unary_union

from pushplan.core import motion
from pushplan.envs import RolloutInteraction
from pushplan.motion.collision import goal_numbers
from pushplan.motion.work_bound import length_bound
from pushplan.planners import make_planner, make_policy, policy_names
from pushplan.planners.push_aware import PushAware, PushAwareConfig
from pushplan.planners.rrt import KinodynamicRRT, KinodynamicRRTConfig
from pushplan.world import (
    Deadline,
    FirstSolution,
    GoalDisc,
    GoalLine,
    InvalidInputError,
    MaxIterations,
    Movables,
    PlanStatus,
    Receptacle,
    RobotModel,
    StaticMap,
    World,
)
from pushplan.world.outline import transform
from pushplan.world.static_map import core_map


def generator(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


def price(result, planner: PushAware) -> float:
    return result.plan.travel_cost + planner.config.push_weight * result.plan.interaction_cost


def check_plan(world: World, result, planner: PushAware) -> None:
    """Free of walls, within the turn limit, without jams, and priced as the sweep prices it."""
    plan, robot = result.plan, world.robot
    walls = unary_union([Polygon(part) for part in world.static.convex_parts])
    for pose in plan.poses[::2]:
        for part in robot.parts:
            assert Polygon(transform(pose, part)).intersection(walls).area < 1e-9
    steps, turns = np.diff(plan.times), np.diff(plan.poses[:, 2])
    assert np.all(np.abs(turns) <= robot.max_turn_rate * steps + 1e-6)
    assert np.all(np.abs(plan.turn_rates) <= robot.max_turn_rate + 1e-9)
    moves = np.hypot(*np.diff(plan.poses[:, :2], axis=0).T)
    assert np.all(moves <= robot.max_speed * steps + 1e-6)
    assert world.goal.distance(*plan.poses[-1, :2]) <= 1e-6
    predicted = planner.interaction.sweep(world, plan.poses)
    assert predicted.jammed_at == -1
    assert plan.interaction_cost == pytest.approx(predicted.work, rel=0.02, abs=0.02)
    assert np.allclose(plan.object_poses[-1], predicted.object_poses[-1], atol=1e-3)
    detail = result.stats.detail
    assert detail["cost"] == pytest.approx(price(result, planner), rel=1e-6)
    assert detail["gap"] == pytest.approx(detail["cost"] / detail["bound"] - 1.0)
    assert detail["gap"] >= -1e-9


@pytest.mark.slow
@settings(max_examples=25)
@given(st.integers(0, 100_000), st.integers(0, 12), st.sampled_from([0.105, 0.3]))
def test_plans_can_be_driven_and_cost_what_is_predicted(seed, boxes, rate):
    world = make_u_maze(scattered_boxes(boxes, seed), robot=make_robot(max_turn_rate=rate))
    planner = PushAware()
    result = planner.plan(world, stop=MaxIterations(2500), rng=generator(seed))
    if result.plan is None:
        result = planner.plan(world, stop=FirstSolution() | MaxIterations(30_000))
    assert result.status is PlanStatus.SOLVED
    check_plan(world, result, planner)


@pytest.mark.slow
@settings(max_examples=30)
@given(st.integers(0, 100_000))
def test_any_room_gives_a_status_and_never_a_path_through_a_wall(seed):
    rng = generator(seed)
    posts = [rng.uniform(0.02, 0.8) * SQUARE + spot for spot in rng.uniform(0, 10, (12, 2))]
    sizes = rng.uniform(0.02, 0.8, (rng.integers(0, 8), 2))
    boxes = [SQUARE * size for size in sizes]
    poses = np.column_stack([rng.uniform(0, 10, (len(boxes), 2)), rng.uniform(-3, 3, len(boxes))])
    drive = str(rng.choice(["constant_speed", "differential"]))
    robot = make_robot(drive=drive, max_turn_rate=float(rng.uniform(0.02, 2.0)))
    world = World(
        robot,
        [*rng.uniform(0, 10, 2), rng.uniform(-3, 3)],
        StaticMap.build(polygons=posts, bounds=[0, 0, 10, 10]),
        Movables.from_outlines(boxes, poses.reshape(-1, 3)),
        GoalDisc(rng.uniform(0, 10, 2), float(rng.uniform(0.05, 1.5))),
    )
    planner = PushAware()
    result = planner.plan(world, stop=MaxIterations(700), rng=generator(seed))
    assert (result.plan is not None) == result.status.has_plan
    if result.plan is not None and result.plan.length > 0.0:
        walls = unary_union([Polygon(post) for post in posts])
        for pose in result.plan.poses[::2]:
            for part in robot.parts:
                assert Polygon(transform(pose, part)).intersection(walls).area < 1e-9
        assert planner.interaction.sweep(world, result.plan.poses).jammed_at == -1


def test_more_iterations_never_cost_more():
    world, planner = make_u_maze(scattered_boxes(8, 5)), PushAware()
    budgets = (600, 1500, 4000, 9000)
    costs = [
        price(planner.plan(world, stop=MaxIterations(n), rng=generator(1)), planner)
        for n in budgets
    ]
    assert costs == sorted(costs, reverse=True)


@pytest.mark.slow
def test_it_costs_no_more_than_the_random_tree():
    config = PushAwareConfig()
    same = {key: getattr(config, key) for key in ("push_weight", "margin", "turn_fraction")}
    planner = PushAware(config)
    tree = KinodynamicRRT(KinodynamicRRTConfig(**same), planner.interaction)
    ours, theirs = [], []
    for seed in (0, 1, 2):
        world = make_u_maze(scattered_boxes(12, seed))
        result = tree.plan(world, stop=MaxIterations(4000), rng=generator(seed)).plan
        theirs.append(result.travel_cost + config.push_weight * result.interaction_cost)
        # an arc of the search takes about half as long as a repair
        ours.append(
            price(planner.plan(world, stop=MaxIterations(8000), rng=generator(seed)), planner)
        )
    assert sum(ours) < 1.02 * sum(theirs)


@pytest.mark.parametrize("drive", ["constant_speed", "differential"])
def test_the_bound_holds_for_every_plan_of_a_long_run(drive):
    robot = make_robot(drive=drive, max_turn_rate=0.3)
    planner = PushAware(PushAwareConfig(margin=0.0))
    poses = ([11.25, 3.75, np.pi / 2], [10.0, 9.0, 2.0], [5.0, 9.0, 1.5], [3.0, 7.5, 1.5])
    for seed, pose in enumerate(poses[:: 1 if drive == "differential" else 3]):
        world = make_u_maze(scattered_boxes(2, seed), robot=robot, robot_pose=pose)
        result = planner.plan(world, stop=MaxIterations(4000), rng=generator(seed))
        detail = result.stats.detail
        assert 0.0 < detail["bound"] == length_bound(world) <= detail["cost"]
        if seed == 0 and drive == "differential":  # and not far, where nothing is in the way
            alone = make_u_maze(robot=robot, robot_pose=pose)
            assert planner.plan(alone, stop=MaxIterations(6000)).stats.detail["gap"] < 0.03


def turning_length(pose, goal, radius):
    """The part of the bound that knows of no walls, for a robot of 1 kg."""
    static = core_map(StaticMap.build(bounds=[-99.0, -99.0, 99.0, 99.0]))
    return motion.LengthBound(static, pose, goal_numbers(goal, 0.0), 1.0, 0.1, radius).cost()


@given(
    st.floats(-8.0, 8.0),
    st.floats(-8.0, 8.0),
    st.floats(-np.pi, np.pi),
    st.floats(0.2, 3.0),
    st.floats(0.01, 2.0),
)
def test_the_turning_bound_is_below_every_dubins_path(x, y, theta, radius, size):
    goal, pose = GoalDisc([x, y], size), np.array([0.0, 0.0, theta])
    bound = turning_length(pose, goal, radius)
    assert bound >= goal.distance(0.0, 0.0) - 1e-3 * (goal.distance(0.0, 0.0) + size)
    pieces, shortest = np.empty((5, 2)), np.inf
    for around in np.linspace(0.0, 2.0 * np.pi, 13):
        for heading in np.linspace(-np.pi, np.pi, 13):
            end = [x + 0.999 * size * np.cos(around), y + 0.999 * size * np.sin(around), heading]
            length = motion.shortest_curve(pose, np.array(end), radius, False, pieces)
            shortest = min(shortest, length)
    if goal.distance(0.0, 0.0) > 0.0:
        assert bound <= shortest + 1e-9


def test_the_bound_knows_that_a_robot_must_turn_round():
    goal, radius = GoalDisc([10.0, 0.0], 1.0), 4.0
    ahead = turning_length(np.array([0.0, 0.0, 0.0]), goal, radius)
    away = turning_length(np.array([0.0, 0.0, np.pi]), goal, radius)
    assert ahead == pytest.approx(9.0, abs=0.01)
    assert away > ahead + 0.9 * np.pi * radius
    assert turning_length(np.array([10.0, 0.5, 0.0]), goal, radius) == 0.0
    line = GoalLine(np.array([3.0, 0.0]), np.array([1.0, 0.0]))
    assert turning_length(np.array([0.0, 0.0, np.pi]), line, radius) == pytest.approx(
        np.pi * radius + 3.0
    )


@pytest.mark.parametrize("drive", ["constant_speed", "differential"])
def test_the_bound_holds_in_a_corridor_of_the_robots_own_width(drive):
    corners = 0.5 * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    robot = RobotModel.from_outline(
        corners, mass=1.0, drive=drive, max_speed=0.5, max_turn_rate=0.5
    )
    walls = [
        np.array([[4.0, y], [14.0, y], [14.0, y + 2.0], [4.0, y + 2.0]])
        for y in (5.5 + 1e-6, 2.5 - 1e-6)
    ]
    world = World(
        robot=robot,
        robot_pose=[7.0, 5.0, 0.0],
        static=StaticMap.build(polygons=walls, bounds=[0.0, 0.0, 24.0, 10.0]),
        movables=Movables.empty(),
        goal=GoalDisc([19.0, 5.0], 0.3),
    )
    result = PushAware().plan(world, stop=MaxIterations(2500))
    assert result.status is PlanStatus.SOLVED
    assert result.stats.detail["gap"] >= 0.0
    assert length_bound(world) > 11.0


@pytest.mark.slow
def test_thin_posts_are_not_missed_where_the_robot_starts_at_a_wall():
    diamond = np.array([[0.5, 0.0], [0.0, 0.5], [-0.5, 0.0], [0.0, -0.5]])
    robot = RobotModel.from_outline(
        diamond, mass=1.0, drive="constant_speed", max_speed=0.3, max_turn_rate=0.3
    )
    behind = np.array([[1.2, 4.0], [1.5 - 1e-6, 4.0], [1.5 - 1e-6, 6.0], [1.2, 6.0]])
    post = 0.01 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    solved = 0
    for seed in range(12):
        places = generator(seed).uniform(1.0, 9.0, (10, 2))
        posts = [place + post for place in places if np.hypot(*(place - [2.0, 5.0])) > 1.2]
        world = World(
            robot=robot,
            robot_pose=[2.0, 5.0, 0.0],
            static=StaticMap.build(polygons=[*posts, behind], bounds=[0.0, 0.0, 10.0, 10.0]),
            movables=Movables.empty(),
            goal=GoalDisc([9.0, 5.0], 0.4),
        )
        result = PushAware().plan(world, stop=MaxIterations(1500), rng=generator(seed))
        if result.plan is None:
            continue
        solved += 1
        hit = unary_union([Polygon(one) for one in posts])
        between, poses, plan = np.empty(3), result.plan.poses, result.plan
        for n, span in enumerate(np.diff(plan.times)):
            for share in (0.0, 0.5):
                length = plan.speeds[n] * span * share
                motion.along_arc(poses[n], length, plan.turn_rates[n] / plan.speeds[n], between)
                cut = Polygon(transform(between, diamond)).intersection(hit).area
                assert cut < 0.2 * 4e-4
    assert solved > 4


def test_the_first_plan_needs_no_search_where_the_taut_path_is_free():
    for world in (make_u_maze(), make_u_maze(scattered_boxes(3, 0))):
        result = PushAware().plan(world, stop=FirstSolution() | MaxIterations(20_000))
        assert result.status is PlanStatus.SOLVED
        assert result.stats.iterations < 50
        check_plan(world, result, PushAware())


def doorway() -> World:
    """Two rooms; a box stands in the only door, and two more behind it."""
    walls = [[0, 0, 16, 0], [0, 8, 16, 8], [0, 0, 0, 8], [16, 0, 16, 8]]
    door = [[7, 0, 7, 2.9], [7, 5.1, 7, 8]]
    return make_u_maze(
        [[7.0, 4.3, 0.3], [9.2, 3.2, 0.2], [8.9, 5.2, 0.5]],
        static=StaticMap.build(segments=[*walls, *door], radii=0.2, bounds=[0, 0, 16, 8]),
        robot=make_robot(max_turn_rate=0.3),
        robot_pose=[2, 4, 0],
        goal=GoalDisc([14, 4], 0.8),
    )


def test_it_clears_the_only_door_and_drives_through():
    world, planner = doorway(), PushAware()
    result = planner.plan(world, stop=MaxIterations(5000))
    assert result.status is PlanStatus.SOLVED
    check_plan(world, result, planner)
    assert result.plan.interaction_cost > 0.8
    pushed = result.plan.object_poses[-1, 0, :2]
    assert pushed[0] > 7.2  # out of the door, on the far side
    # and a simulator agrees
    driven = RolloutInteraction().sweep(world, result.plan.poses)
    assert driven.jammed_at == -1
    assert driven.work == pytest.approx(result.plan.interaction_cost, rel=0.5)


@pytest.mark.usefixtures("cpu_time")
def test_a_deadline_is_kept_among_many_columns_that_were_never_seen():
    planner, took = PushAware(), []
    for shift in (0.0, 0.01, 0.02):
        spots = [(x + shift, y) for x in np.arange(3, 40, 4.0) for y in np.arange(3, 40, 4.0)]
        world = make_u_maze(
            static=StaticMap.build(
                polygons=[SQUARE + spot for spot in spots], bounds=[0, 0, 42, 42]
            ),
            robot_pose=[1, 1, 0.7],
            goal=GoalDisc([37, 39.0], 1.5),
        )
        began = time.perf_counter()
        result = planner.plan(world, stop=Deadline(0.1))
        took.append(time.perf_counter() - began)
        assert result.status in (PlanStatus.SOLVED, PlanStatus.TIMED_OUT)
    assert min(took) < 0.1 + 0.4


def test_it_pushes_a_box_out_of_the_way_and_drives_through():
    walls = StaticMap.build(
        segments=[[0, 0, 16, 0], [0, 3, 16, 3]], radii=0.1, bounds=[0, 0, 16, 3]
    )
    world = make_u_maze(
        [[6, 1.5, 0.2]], static=walls, robot_pose=[1.5, 1.5, 0], goal=GoalDisc([14, 1.5], 1.0)
    )
    planner = PushAware()
    result = planner.plan(world, stop=MaxIterations(6000))
    assert result.status is PlanStatus.SOLVED
    assert result.plan.interaction_cost > 0.4
    check_plan(world, result, planner)


def test_the_price_of_pushing_is_respected():
    walls = StaticMap.build(
        segments=[[0, 0, 16, 0], [0, 6, 16, 6]], radii=0.1, bounds=[0, 0, 16, 6]
    )
    world = make_u_maze(
        [[8, 3, 0.0]], static=walls, robot_pose=[1.5, 3, 0], goal=GoalDisc([14.5, 3], 1.0)
    )
    cheap, dear = (
        PushAware(PushAwareConfig(push_weight=w)).plan(world, stop=MaxIterations(3000)).plan
        for w in (0.0, 20.0)
    )
    assert cheap.travel_cost < dear.travel_cost
    assert dear.interaction_cost < 0.05


def test_a_far_box_changes_nothing_about_a_path():
    near, far = (
        PushAware().plan(make_u_maze(boxes), stop=MaxIterations(3000)).plan
        for boxes in ([], [[2.0, 13.0, 0.0]])
    )
    assert far.interaction_cost == 0.0
    assert far.length == pytest.approx(near.length, rel=0.01)


def test_lines_and_differential_drives():
    robot = make_robot(drive="differential", max_speed=0.22, max_turn_rate=2.84)
    world = make_u_maze([[10, 9, 0]], robot=robot, goal=GoalLine([0, 12], [0, 1]))
    planner = PushAware()
    result = planner.plan(world, stop=MaxIterations(2500))
    check_plan(world, result, planner)
    assert result.plan.length < 8.25 + 0.6


@pytest.mark.usefixtures("cpu_time")
def test_two_hundred_boxes_and_a_deadline():
    spots = [[x, y, 0.1] for x in np.arange(1, 14.2, 0.75) for y in np.arange(5.5, 14.2, 0.75)]
    small = np.array([spot for spot in spots if abs(spot[0] - 7.5) > 1.0 or spot[1] > 11])[:200]
    world = make_u_maze(movables=Movables.from_outlines([0.5 * SQUARE] * len(small), small))
    assert len(world.movables) > 140
    planner = PushAware()
    planner.plan(world, stop=Deadline(0.1))
    assert quickest(lambda: planner.plan(world, stop=Deadline(0.1))) < 0.1 + 1.0


@pytest.mark.usefixtures("cpu_time")
def test_a_deadline_is_kept_on_a_map_that_was_never_seen():
    planner = PushAware()
    took = []
    for shift in (0.0, 0.01, 0.02):
        walls = [[0, 0, 15, 0], [0, 0, 0, 15], [15, 0, 15, 15], [0, 15, 15, 15]]
        static = StaticMap.build(segments=[*walls, [7.5, 0, 7.5, 10 - shift]], radii=0.5)
        began = time.perf_counter()
        planner.plan(make_u_maze(scattered_boxes(6, 0), static=static), stop=Deadline(0.06))
        took.append(time.perf_counter() - began)
    assert min(took) < 0.06 + 0.3


def test_a_map_too_large_for_a_table_is_planned_without():
    world = make_u_maze(
        [[10.0, 10.5, 0.0]],
        static=StaticMap.build(bounds=[0, 0, 2000, 2000]),
        robot_pose=[5, 10, 0],
        goal=GoalDisc([20, 10], 1.0),
    )
    result = PushAware().plan(world, stop=FirstSolution() | MaxIterations(5000))
    assert result.status is PlanStatus.SOLVED
    assert result.stats.detail["searches"] == 0.0


@pytest.mark.parametrize("name", ["push-aware", "push-aware-constant-speed"])
def test_its_policies_plan_and_drive(name):
    assert name in policy_names()
    policy = make_policy(name)
    world = make_u_maze(make_boxes([[10.0, 9.0, 0.0]]).poses)
    policy.reset(world, generator(0))
    assert policy.act(world).linear == pytest.approx(0.15)
    assert policy.current_plan is not None


def test_goals_for_objects_are_refused():
    with pytest.raises(InvalidInputError, match="goal for the robot"):
        make_planner("push-aware").plan(
            make_u_maze(goal=Receptacle([[1, 1], [2, 1], [2, 2], [1, 2]]))
        )


@pytest.mark.parametrize(
    "options",
    [
        {"push_weight": -1},
        {"differential_radius": 0},
        {"heuristic_inflation": np.nan},
    ],
)
def test_bad_parameters(options):
    with pytest.raises(InvalidInputError):
        PushAwareConfig(**options)
