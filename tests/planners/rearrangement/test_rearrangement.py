"""Candidate pushes, their graph, and set covering as a GTSP."""

import functools
import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from conftest import SQUARE, make_boxes
from scipy.sparse import dok_array
from scipy.sparse.csgraph import dijkstra

from pushplan.control import PoseFollower
from pushplan.core import rearrangement as core
from pushplan.gtsp import solve_gtsp
from pushplan.motion.room_ahead import recovery_path
from pushplan.planners.rearrangement import (
    PushScene,
    RearrangementConfig,
    build_push_graph,
    push_order,
)
from pushplan.planners.rearrangement.approach import approach_tree
from pushplan.planners.rearrangement.candidates import partial_pushes
from pushplan.planners.rearrangement.push import signature
from pushplan.planners.rearrangement.push_choice import select_push
from pushplan.planners.rearrangement.push_graph import (
    parts_of,
    reduce_to_gtsp,
    relocating_pushes,
)
from pushplan.planners.rearrangement.push_simulator import resimulate, simulate_primitive
from pushplan.planners.rearrangement.rollout_cache import RolloutCache
from pushplan.world import (
    ClearanceArea,
    InvalidInputError,
    MaxIterations,
    Movables,
    Receptacle,
    StaticMap,
    World,
    box_delivery_robot,
)
from pushplan.world.outline import transform

CORNER = Receptacle([(3.0, 3.0), (5.0, 3.0), (5.0, 5.0), (3.0, 5.0)])
COLUMN = [(-0.5, 0.0), (0.5, 0.0), (0.5, 1.0), (-0.5, 1.0)]
AREA = [(-3.0, -3.0), (3.0, -3.0), (3.0, 3.0), (-3.0, 3.0)]

QUARTER = ((1, 0), (2, 1), (1, 1), (1, 2))
MOVES = np.array(
    [*QUARTER]
    + [(-y, x) for x, y in QUARTER]
    + [(-x, -y) for x, y in QUARTER]
    + [(y, -x) for x, y in QUARTER]
)
"""(16, 2) cells along x and y that a straight move along each heading crosses."""
LENGTHS = np.hypot(MOVES[:, 0], MOVES[:, 1])


def columns_at(*corners):
    """Columns of 1 m, by their lower left corners."""
    return [[(x, y), (x + 1.0, y), (x + 1.0, y + 1.0), (x, y + 1.0)] for x, y in corners]


def bodies_along(path, robot):
    """The robot's shape at each pose of a path."""
    return [
        shapely.union_all([shapely.Polygon(transform(p, part)) for part in robot.parts])
        for p in path
    ]


def recovery_from(here):
    return recovery_path(here.world, 0.015 * here.size)


def scene(boxes, goal=CORNER, extra=(), pose=(-3.0, -3.0, 0.0), **config):
    world = World(
        robot=box_delivery_robot(),
        robot_pose=pose,
        static=StaticMap.build(polygons=list(extra), bounds=(-5, -5, 5, 5)),
        movables=make_boxes(boxes),
        goal=goal,
    )
    return PushScene(world, RearrangementConfig(**config))


@functools.cache
def example(kind):
    """A scene and its graph."""
    if kind == "delivery":
        here = scene([(-1.5, -1.5, 0.3), (0.5, -2.0, 0.0)], extra=[COLUMN])
    else:
        area = ClearanceArea(AREA, [True, True, False, True])
        here = scene([(2.0, -1.0, 0.0), (1.0, 1.5, 0.5), (-2.0, 2.0, 1.0)], area, [COLUMN])
    return here, build_push_graph(here)


@pytest.mark.parametrize("kind", ["delivery", "clearing"])
def test_candidate_pushes_keep_clear_of_what_is_static(kind):
    here, graph = example(kind)
    assert {i for push in graph.pushes for i in push.delivers} == set(range(len(here.poses)))
    walls = shapely.Polygon(COLUMN)
    room = shapely.box(-5, -5, 5, 5)
    for push in graph.pushes:
        for x, y, theta in push.poses[::4]:
            c, s = math.cos(theta), math.sin(theta)
            for part in here.world.robot.parts:
                body = shapely.Polygon(part @ np.array([[c, s], [-s, c]]) + [x, y])
                assert body.intersection(walls).area < 1e-3
                assert body.difference(room).area < 1e-3


@pytest.mark.parametrize("kind", ["delivery", "clearing"])
def test_costs_are_no_less_than_the_straight_ways(kind):
    here, graph = example(kind)
    count = len(graph.pushes)
    assert graph.costs.shape == (count + 1, count)
    assert np.isinf(graph.costs[np.arange(count), np.arange(count)]).all()
    assert np.isfinite(graph.costs[-1]).all()
    assert not np.isnan(graph.costs).any()
    slack = 1.5 * here.coarse.grid.step  # where a push begins between the lattice's poses
    for n, push in enumerate(graph.pushes):
        assert push.length > 0.0 and push.cost >= push.length
        assert push.work > 0.0
        ends = [other.end for other in graph.pushes] + [here.world.robot_pose]
        for m, end in enumerate(ends):
            if m != n:
                straight = math.dist(end[:2], push.start[:2])
                assert graph.costs[m, n] >= straight + push.length - slack


@pytest.mark.parametrize("kind", ["delivery", "clearing"])
def test_what_a_push_delivers_is_done_where_it_is_predicted_to_end(kind):
    here, graph = example(kind)
    for push in graph.pushes:
        done = here.are_done(push.object_poses)
        assert done[list(push.delivers)].all()


def test_a_row_of_boxes_is_swept_by_one_push():
    goal = ClearanceArea(AREA, [False, True, False, False])
    here = scene([(1.0, 0.2, 0.0), (2.2, -0.2, 0.0)], goal, work_weight=0.5)
    graph = build_push_graph(here)
    assert any(set(push.delivers) == {0, 1} for push in graph.pushes)
    order, cost = push_order(graph)
    assert len(order) == 1 and cost == pytest.approx(graph.costs[-1, order[0]])


def test_a_push_that_is_tabu_is_left_out():
    here, graph = example("delivery")
    tabu = signature(graph.pushes[0])
    again = build_push_graph(here, lambda push: math.inf if signature(push) == tabu else 0.0)
    assert again.pushes and tabu not in {signature(push) for push in again.pushes}


def brute_force(costs, masks, boxes):
    """The cheapest sequence of pushes that delivers everything, each adding something."""
    every, best = (1 << boxes) - 1, math.inf
    for size in range(1, boxes + 1):
        for order in itertools.permutations(range(len(masks)), size):
            delivered, total, last = 0, 0.0, len(masks)
            for n in order:
                if delivered | masks[n] == delivered:
                    break
                delivered |= masks[n]
                total += costs[last, n]
                last = n
            else:
                if delivered == every:
                    best = min(best, total)
    return best


def test_set_covering_is_solved_as_by_brute_force():
    rng = np.random.default_rng(3)
    for _ in range(40):
        boxes, count = int(rng.integers(1, 5)), int(rng.integers(2, 7))
        masks = rng.integers(1, 1 << boxes, count)
        starts, ends = rng.uniform(0.0, 9.0, (count, 2)), rng.uniform(0.0, 9.0, (count + 1, 2))
        pushes = np.hypot(*(ends[:count] - starts).T) + rng.uniform(0.0, 5.0, count)
        costs = np.hypot(*np.moveaxis(ends[:, None] - starts[None], 2, 0)) + pushes
        costs[:, rng.random(count) < 0.15] = np.inf
        np.fill_diagonal(costs[:-1], np.inf)
        truth = brute_force(costs, masks.tolist(), boxes)
        best, _ = core.cost_to_go(costs, masks, boxes)
        assert best[0, count] == pytest.approx(truth)
        reduced = reduce_to_gtsp(costs, masks.tolist(), boxes)
        if not all(reduced.clusters):
            assert math.isinf(truth)
            continue
        tour = solve_gtsp(reduced.costs, reduced.clusters, stop=MaxIterations(300))
        if math.isinf(truth):
            assert not tour.status.has_tour
        else:
            assert tour.cost == pytest.approx(truth)
            order = reduced.order([int(node) for node in tour.nodes])
            steps = zip([count, *order[:-1]], order, strict=True)
            assert sum(costs[a, b] for a, b in steps) == pytest.approx(truth)


def test_a_push_graph_is_a_networkx_graph_that_the_solver_takes():
    boxes = [(-1.0, 1.0, 0.3), (0.5, -0.5, 0.0), (1.5, 2.0, 0.8)]
    here = scene(boxes, ClearanceArea(AREA, [True] * 4))
    pushes = build_push_graph(here)
    graph = pushes.to_networkx()
    order, cost = push_order(pushes)
    tour = solve_gtsp(graph)
    assert tour.cost == pytest.approx(cost) and math.isfinite(cost)
    clusters = {graph.nodes[node]["cluster"] for node in tour.nodes}
    assert clusters == {"robot", *here.world.movables.ids.tolist()}
    delivered = {i for n in order for i in pushes.pushes[n].serves}
    assert delivered == clusters - {"robot"}


def test_a_push_stands_for_its_parts():
    assert parts_of(0b101) == [(0,), (2,), (0, 2)]
    assert parts_of(0b11111) == [(0, 1, 2, 3, 4), (0,), (1,), (2,), (3,), (4,)]


def test_more_objects_than_can_be_solved_exactly():
    boxes = [(x, y, 0.0) for x in (-2.2, -0.7, 0.8, 2.3) for y in (-2.2, -0.4, 1.4)]
    graph = build_push_graph(scene(boxes, ClearanceArea(AREA, [True] * 4), per_object=2))
    order, cost = push_order(graph, iterations=30)
    delivered = {i for n in order for i in graph.pushes[n].delivers}
    assert delivered == set(range(12)) and math.isfinite(cost)
    steps = zip([len(graph.pushes), *order[:-1]], order, strict=True)
    assert sum(graph.costs[a, b] for a, b in steps) == pytest.approx(cost)


def test_a_walled_in_box_is_infeasible():
    ring = [
        [(-2, -2), (2, -2), (2, -1.5), (-2, -1.5)],
        [(-2, 1.5), (2, 1.5), (2, 2), (-2, 2)],
        [(-2, -2), (-1.5, -2), (-1.5, 2), (-2, 2)],
        [(1.5, -2), (2, -2), (2, 2), (1.5, 2)],
    ]
    graph = build_push_graph(scene([(0.0, 0.0, 0.0), (0.0, -3.5, 0.0)], extra=ring))
    assert list(graph.infeasible) == [0]
    assert {i for push in graph.pushes for i in push.delivers} == {1}


@pytest.mark.slow
def test_a_box_at_a_wall_is_relocated():
    here = scene([(0.0, -4.49, 0.0)])
    graph = build_push_graph(here, relocations=1)
    assert graph.pushes and not graph.infeasible


def test_a_relocation_that_leaves_its_object_behind_is_none():
    here = scene([(0.0, 0.5, 0.4)])
    push = next(push for _, pushes in partial_pushes(here, 0) for push in pushes)
    [again] = resimulate(here, push, push.start)
    assert np.array_equal(again.object_poses, push.object_poses)
    aside = here.poses + np.array([0.0, 3.0 * here.size, 0.0])
    assert resimulate(here, push, push.start, poses=aside) == []
    other = scene([(0.0, 0.5, 0.4), (4.0, -4.0, 0.0)])
    assert resimulate(other, push, push.start) == []  # among other objects


@pytest.mark.slow
def test_boxes_wedged_between_columns_are_nudged_where_nothing_else_is_left():
    columns = [
        [(1.75, 0.96), (2.75, 0.96), (2.75, 1.96), (1.75, 1.96)],
        [(-0.12, 1.95), (0.88, 1.95), (0.88, 2.95), (-0.12, 2.95)],
    ]
    boxes = [(1.0905, 1.8834, 1.144), (1.5228, 1.6, 3.1381)]
    room = scene(boxes, extra=columns, pose=(3.9, 3.0, 1.1)).world
    small = Movables.from_outlines([0.44 * SQUARE] * 2, boxes)
    here = PushScene(replace(room, movables=small), RearrangementConfig())
    approach = approach_tree(here)
    few, many = (
        [push for k in (0, 1) for push in relocating_pushes(here, k, approach, thorough)]
        for thorough in (False, True)
    )
    assert not few and many
    to_go = here.push_cost_to_go(0)
    for push in many:
        k = int(push.target)
        assert to_go.at(push.object_poses[k]) < to_go.at(here.poses[k])


@pytest.mark.parametrize("seed", range(10))
def test_costs_of_pushes_are_those_of_scipy(seed):
    rng = np.random.default_rng(seed)
    rows, cols = rng.integers(2, 30, 2)
    is_open = rng.random((rows, cols)) < 0.8
    pushable = rng.random((16, rows, cols)) < 0.6
    graph = dok_array((rows * cols, rows * cols))  # backward
    for t, (x, y) in enumerate(MOVES):
        for i, j in np.argwhere(is_open):
            a, b = i + y, j + x
            if 0 <= a < rows and 0 <= b < cols and is_open[a, b]:
                length = LENGTHS[t] * 0.1
                graph[a * cols + b, i * cols + j] = length if pushable[t, i, j] else 7.0 * length
    goals = np.flatnonzero(is_open)[:2]
    wanted = dijkstra(graph.tocsr(), indices=goals, min_only=True).reshape(rows, cols)
    np.testing.assert_array_equal(core.push_costs(is_open, pushable, goals, 0.1, 7.0), wanted)


def small_box(pose, extra=(), robot=(-3.0, -3.0, 0.0)):
    room = scene([(0.0, 0.0, 0.0)], extra=extra, pose=robot)
    small = Movables.from_outlines([0.44 * SQUARE], [pose])
    return PushScene(replace(room.world, movables=small), room.config)


GAP = [
    [(-1.6, -0.5), (-0.4, -0.5), (-0.4, 0.5), (-1.6, 0.5)],
    [(0.4, -0.5), (1.6, -0.5), (1.6, 0.5), (0.4, 0.5)],
]
"""Columns between which the robot's body fits, but not its bumper."""


@pytest.mark.parametrize("drive_back", [True, False])
@pytest.mark.parametrize(
    ("pose", "extra"), [((-4.5, -4.5, 0.3), ()), ((0.1, 0.05, 0.2), GAP), ((0.0, -4.7, 0.0), ())]
)
@pytest.mark.slow
def test_a_box_in_a_tight_place_is_brought_out_of_it(pose, extra, drive_back):
    here = small_box(pose, extra)
    if not drive_back:
        ahead = replace(here.world.robot, min_speed=0.0)
        here = PushScene(replace(here.world, robot=ahead), here.config)
    found = relocating_pushes(here, 0, approach_tree(here))
    assert found or not drive_back
    walls = [shapely.Polygon(part).buffer(-0.01) for part in here.world.static.convex_parts]
    for push in found:
        assert push.relocates and here.starts.is_clear(push.start)
        assert math.dist(push.object_poses[0, :2], pose[:2]) > 0.02
        assert np.abs(np.diff(push.poses, axis=0)).max() < 0.3 * here.size
        for robot_pose in push.poses:
            body = [shapely.Polygon(transform(robot_pose, p)) for p in here.world.robot.parts]
            assert not any(part.intersects(wall) for part in body for wall in walls)
        if not drive_back:
            moves = np.diff(push.poses[:, :2], axis=0)
            ahead = np.column_stack([np.cos(push.poses[:-1, 2]), np.sin(push.poses[:-1, 2])])
            assert ((moves * ahead).sum(axis=1) > -1e-9).all()
        [again] = resimulate(here, push, push.start)
        assert np.array_equal(again.object_poses, push.object_poses)


def test_the_recovery_path_of_a_gap_touches_nothing():
    tight = small_box((0.0, 0.25, 0.0), GAP, robot=(0.0, -0.35, -0.5 * math.pi))
    path = recovery_from(tight)
    assert path is not None and path[-1, 1] < -0.8
    assert simulate_primitive(tight, path, 0)[0].work == 0.0
    assert recovery_from(small_box((0.0, 0.8, 0.0), GAP)) is None


def test_the_recovery_path_from_between_two_columns_is_to_and_fro():
    """Neither straight on nor along one arc, and there is no room to turn about."""
    columns = columns_at((0.0, 0.0), (0.0, 2.0))
    for pose in ((0.8, 1.47, -1.57), (0.4, 1.5, 1.4)):
        tight = scene([(4.0, -4.0, 0.0)], extra=columns, pose=pose)
        path = recovery_from(tight)
        assert path is not None and len(path) > 20
        moves = np.diff(path, axis=0)
        assert np.abs(moves[:, 2]).max() < 0.1 and np.hypot(*moves[:, :2].T).max() < 0.1
        walls = shapely.union_all([shapely.Polygon(column) for column in columns])
        bodies = bodies_along(path, tight.world.robot)
        assert shapely.area(shapely.intersection(walls, bodies)).max() < 1e-3
        assert shapely.distance(walls, shapely.Point(path[-1, :2])) > tight.size
        assert np.array_equal(path, recovery_from(tight))


def test_the_recovery_path_of_a_wedged_robot_leads_deeper_into_neither_column():
    """The bumper is 4 mm in one, 15 mm from the other, and the only way out is a slight bend."""
    columns = columns_at((-2.1318, 0.7832), (-0.1196, 1.3619))
    tight = scene([(4.0, -4.0, 0.0)], extra=columns, pose=(-0.5417, 1.7491, -1.7874))
    path = recovery_from(tight)
    assert path is not None
    bodies = bodies_along(path, tight.world.robot)
    for column in columns:
        inside = shapely.area(shapely.intersection(shapely.Polygon(column), bodies))
        assert inside.max() < inside[0] + 1e-5


def test_the_recovery_path_pushes_what_closes_the_only_way_out():
    side = [(-1.0, 0.56), (0.6, 0.56), (0.6, 1.0), (-1.0, 1.0)]
    walls = [side, [(x, -y) for x, y in side], [(-1, -1), (-0.6, -1), (-0.6, 1), (-1, 1)]]
    for box, pushes in (((4.0, 4.0, 0.0), False), ((0.5, 0.0, 0.0), True)):
        tight = scene([box], extra=walls, pose=(-0.2, 0.0, 0.0))
        path = recovery_from(tight)
        assert path is not None and path[-1, 0] > 0.8
        work = simulate_primitive(tight, path, 0)[0].work
        assert (work > 0.0) == pushes


def test_a_route_leads_around_the_box_that_it_would_push_away():
    """The box fills the passage, and the other way is five times as long."""
    room = [[(-5, 2.5), (5, 2.5), (5, 5), (-5, 5)], [(-5, -5), (5, -5), (5, -2.5), (-5, -2.5)]]
    columns = columns_at((-2.62, -0.72), (1.64, -0.84), (-0.58, -0.27))
    here = scene(
        [(0.06, 1.583, 0.14)],
        Receptacle([(3.5, 1.0), (5.0, 1.0), (5.0, 2.5), (3.5, 2.5)]),
        [*room, *columns],
        pose=(0.929, 1.708, -0.438),
    )
    first = select_push(here).first
    assert first is not None and first.push.delivers
    assert first.route.cost > 6.0


def test_finer_lattices_lead_through_gaps_that_are_hardly_wider_than_the_robot():
    columns = columns_at((-1.578, -1.499), (0.311, -2.69), (0.514, -0.567))
    pocket = scene([(3.0, 3.0, 0.0)], extra=columns, pose=(0.158, -1.107, 0.0))

    def farthest(here):
        grid = here.fine.grid
        costs = approach_tree(here).costs.reshape(grid.blocked.shape)
        rows, columns = np.nonzero(np.isfinite(costs).any(axis=0))
        away = (grid.x + grid.step * columns - 0.158, grid.y + grid.step * rows + 1.107)
        return np.hypot(*away).max()

    assert farthest(pocket) < 2.0 * pocket.size
    assert farthest(pocket.on_finer_lattice()) > 6.0 * pocket.size


def test_there_is_no_recovery_path_out_of_a_cell():
    sides = [[(-1, -1), (1, -1), (1, -0.9), (-1, -0.9)], [(-1, 0.9), (1, 0.9), (1, 1), (-1, 1)]]
    sides += [[(-1, -1), (-0.9, -1), (-0.9, 1), (-1, 1)], [(0.9, -1), (1, -1), (1, 1), (0.9, 1)]]
    cell = [1.4 * 0.45 * np.array(side) for side in sides]
    assert recovery_from(scene([(4.0, -4.0, 0.0)], extra=cell, pose=(0.0, 0.0, 0.0))) is None


def test_an_object_that_cannot_be_got_to_later_does_not_keep_the_others_waiting():
    """From where some of these pushes end the robot cannot get to where others begin."""
    columns = [(1.82, -1.47), (0.92, 2.02), (0.49, -0.16), (1.34, 1.01), (-0.73, 0.01)]
    here = scene(
        [(3.77, -1.61, 1.01), (-0.3, 3.13, -2.82), (0.41, -0.63, -2.08)],
        extra=columns_at(*columns, (1.22, -3.56), (0.53, 1.15), (-1.21, -0.45), (-2.4, 0.55)),
        pose=(2.97, -2.73, -2.82),
    )
    graph = build_push_graph(here)
    assert len(graph.pushes) > 1
    later = graph.costs[:-1][~np.eye(len(graph.pushes), dtype=bool)]
    assert np.isfinite(later).all() and later.max() > 30.0


def test_a_bumper_that_hooks_on_a_corner_is_driven_ahead():
    column = [(-0.75, 0.47), (0.25, 0.47), (0.25, 1.47), (-0.75, 1.47)]
    hooked = scene([(4.0, -4.0, 0.0)], extra=[column], pose=(0.0, 0.0, 0.0))
    path = recovery_from(hooked)
    assert path is not None and path[1, 0] > 0.0
    parts = [
        shapely.Polygon(transform(pose, part)) for pose in path for part in hooked.world.robot.parts
    ]
    assert shapely.area(shapely.intersection(shapely.Polygon(column), parts)).max() < 1e-6


def test_a_path_is_traced_ahead_back_and_round():
    robot, steps = box_delivery_robot(), []
    pose = np.array([0.3, -0.2, 2.9])
    for length, turn in [(0.05, 0.08)] * 9 + [(-0.05, 0.0)] * 7 + [(0.0, -0.1)] * 5:
        middle = pose[2] + 0.5 * turn
        pose = pose + np.array([length * math.cos(middle), length * math.sin(middle), turn])
        steps.append(pose)
    path = np.array([[0.3, -0.2, 2.9], *steps])
    at, tracer = np.array([0.31, -0.21, 2.95]), PoseFollower(robot, path, 0.2)
    for step in range(60):
        twist = tracer.command(at, 0.2 * step, 0.2)
        if twist is None:
            break
        middle = at[2] + 0.1 * twist.angular
        velocity = [twist.linear * math.cos(middle), twist.linear * math.sin(middle)]
        at = at + 0.2 * np.array([*velocity, twist.angular])
    assert twist is None
    assert np.abs(at - path[-1]).max() < 0.05


def test_what_is_remembered_comes_to_the_same():
    rng, cache = np.random.default_rng(4), RolloutCache()
    boxes = np.column_stack([rng.uniform(-2.5, 2.5, (4, 2)), rng.uniform(-3.0, 3.0, 4)])
    first = scene(boxes, ClearanceArea(AREA, [True] * 4))
    known = 0
    for _ in range(2):
        fresh = PushScene(first.world.moved(movable_poses=boxes), first.config)
        kept = replace(fresh, cache=cache)
        before = len(cache)
        one, other = (build_push_graph(here).pushes for here in (fresh, kept))
        known += len(one) > len(cache) - before
        assert len(one) == len(other)
        for a, b in zip(one, other, strict=True):
            assert a == b
        cache.age()
        boxes = boxes.copy()
        boxes[rng.integers(4)] += rng.uniform(-0.4, 0.4, 3)
    assert known


def test_the_search_is_that_of_dijkstra():
    here, _ = example("clearing")
    grid, layers = here.coarse
    depths, touch = core.add_layers(layers, here.contact_weights)
    problem = (*grid.near_poses(here.world.robot_pose, 1.5), depths, touch, 0.02, 0.5)
    best, before = grid.search(*problem, np.zeros(0, dtype=np.int64))
    assert np.isfinite(best).mean() > 0.3
    targets = np.argsort(best)[:50]
    some, _ = grid.search(*problem, targets)
    assert (some[targets] == best[targets]).all()
    # every cost is that of the pose before it and the step from there, and no step is cheaper
    count, rows, cols = depths.shape
    headings = np.arctan2(MOVES[:, 1], MOVES[:, 0])
    steps = np.roll(headings, -1) - headings
    turns = np.abs(np.arctan2(np.sin(steps), np.cos(steps)))
    flat, near, shut = depths.ravel(), touch.ravel(), grid.blocked.ravel()
    for node in np.flatnonzero(np.isfinite(best))[::37].tolist():
        t, i, j = node // (rows * cols), node // cols % rows, node % cols
        steps = []
        for sign in (1, -1):
            y, x = i + sign * MOVES[t, 1], j + sign * MOVES[t, 0]
            if 0 <= y < rows and 0 <= x < cols:
                length, at = LENGTHS[t] * grid.step, (i, j) if sign > 0 else (y, x)
                if not grid.blocked_moves[0, t, *at]:
                    steps.append(((t * rows + y) * cols + x, length, length))
        for to, turn, first in (
            ((t + 1) % count, turns[t], t),
            (t - 1, turns[t - 1], t - 1),
        ):
            if not grid.blocked_moves[1, first, i, j]:
                steps.append(((to % count * rows + i) * cols + j, 0.02 * turn, 0.5 * turn))
        for other, step_cost, motion in steps:
            if not shut[node] and np.isfinite(best[other]):
                touched = near[node] > 0.0 and flat[node] >= flat[other]
                cost = best[other] + (step_cost + motion * near[node] if touched else step_cost)
                assert best[node] <= cost * (1.0 + 1e-12)  # other order of the same sum
                assert before[node] != other or best[node] == pytest.approx(cost)


@pytest.mark.parametrize(
    "changes",
    [
        {"work_weight": -1.0},
        {"work_weight": math.nan},
        {"later_fraction": 2.0},
        {"max_searches": 0},
        {"per_object": 0},
        {"max_simulations": 2.5},
        {"response": "soon"},
        {"mpc": 1},
    ],
)
def test_settings_are_checked(changes):
    with pytest.raises(InvalidInputError):
        RearrangementConfig(**changes)
