from __future__ import annotations

import math
import time

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.ops import nearest_points

from pushplan.core import geometry as core
from pushplan.geometry import (
    Grid,
    VisibilityGraph,
    clearance_field,
    geodesic_field,
    goal_distances,
    shortest_path,
)
from pushplan.world import GoalDisc, GoalLine, InvalidInputError, StaticMap

U_WALLS = [
    [0, 0, 15, 0],
    [15, 0, 15, 15],
    [15, 15, 0, 15],
    [0, 15, 0, 0],
    [7.5, 0, 7.5, 10],
]
U_MAZE = StaticMap.build([], U_WALLS, 0.5, bounds=[0, 0, 15, 15])
GOAL = GoalDisc(np.array([3.75, 3.75]), 1.86)


def with_many_corners(static: StaticMap) -> StaticMap:
    """A map that counts as large, by a round pillar out of its bounds."""
    angles = np.linspace(0.0, 2.0 * np.pi, 2300, endpoint=False)
    circle = 0.1 * np.column_stack([np.cos(angles), np.sin(angles)])
    pillar = static.bounds[2:] + 1.0 + circle
    return StaticMap((*static.polygons, pillar), static.segments, static.radii, static.bounds)


@pytest.fixture(params=[False, True], ids=["small", "large"])
def either_size(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Searches as on small maps, and with the estimates that large maps need."""
    if request.param:
        plain = VisibilityGraph

        def large(static: StaticMap, clearance: float = 0.0) -> VisibilityGraph:
            return plain(with_many_corners(static), clearance)

        monkeypatch.setitem(globals(), "VisibilityGraph", large)
        monkeypatch.setattr(shortest_path, "_USUAL", core.Estimates.ALWAYS)


def free_space(static: StaticMap, clearance: float) -> shapely.Geometry:
    """The plane region where paths may run, with arcs of 24 corners a quarter turn."""
    shapes = [shapely.Polygon(p).buffer(clearance, quad_segs=24) for p in static.polygons]
    for line, radius in zip(static.segments, static.radii, strict=True):
        core = shapely.LineString(line.reshape(2, 2))
        shapes.append(core.buffer(max(radius + clearance, 1e-4), quad_segs=24))
    return shapely.box(*static.bounds) - shapely.union_all(shapes)


class ReferenceGraph:
    """Plain visibility graph over every corner of the free space; slow and simple."""

    def __init__(self, static: StaticMap, clearance: float) -> None:
        self.free = free_space(static, clearance)
        self.room = self.free.buffer(1e-6)  # paths may touch
        shapely.prepare(self.room)
        parts = getattr(self.free, "geoms", [self.free])
        rings = [r for p in parts for r in (p.exterior, *p.interiors) if not p.is_empty]
        corners = [np.array(r.coords)[:-1] for r in rings]
        self.corners = np.concatenate(corners) if corners else np.zeros((0, 2))
        self.graph = nx.Graph()
        self._connect(self.corners, self.corners)

    def sees(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return shapely.covers(self.room, shapely.linestrings(np.stack([a, b], axis=1)))

    def _connect(self, a: np.ndarray, b: np.ndarray) -> None:
        for point in a:
            others = b[(b != point).any(axis=1)]
            if len(others) == 0:
                continue
            seen = others[self.sees(np.broadcast_to(point, others.shape), others)]
            for other in seen:
                self.graph.add_edge(tuple(point), tuple(other), weight=math.dist(point, other))

    def distances(self, target: shapely.Geometry, starts: np.ndarray) -> np.ndarray:
        """Shortest distance of each start to the nearest free point of the target."""
        graph, reachable = self.graph.copy(), target & self.free
        out = np.full(len(starts), np.inf)
        if reachable.is_empty:
            return out
        graph.add_node("goal")
        rim = [
            np.array(g.coords) for g in getattr(reachable.boundary, "geoms", [reachable.boundary])
        ]
        ends = np.concatenate(rim) if target.area > 0.0 else np.array([reachable.coords[0]])
        for group, name in ((self.corners, "corner"), (starts, "start")):
            for i, point in enumerate(group):
                # every rim corner is a candidate: the rim is finely divided
                near = nearest_points(reachable, shapely.Point(point))[0]
                options = np.vstack([ends, [[near.x, near.y]]])
                lengths = np.hypot(*(options - point).T)
                seen = self.sees(np.broadcast_to(point, options.shape), options)
                if seen.any():
                    key = tuple(point) if name == "corner" else (name, i)
                    graph.add_edge(key, "goal", weight=float(lengths[seen].min()))
        for i, point in enumerate(starts):
            if len(self.corners):
                seen = self.corners[
                    self.sees(np.broadcast_to(point, self.corners.shape), self.corners)
                ]
                for other in seen:
                    graph.add_edge(("start", i), tuple(other), weight=math.dist(point, other))
        lengths = nx.single_source_dijkstra_path_length(graph, "goal", weight="weight")
        for i in range(len(starts)):
            out[i] = lengths.get(("start", i), np.inf)
        return out


def random_map(rng: np.random.Generator) -> StaticMap:
    """Polygons and thick segments that overlap, touch the bounds and each other."""
    polygons = []
    for _ in range(rng.integers(0, 4)):
        points = rng.uniform(0, 10, 2) + rng.uniform(0.3, 1.2) * rng.standard_normal((5, 2))
        polygons.append(np.array(shapely.MultiPoint(points).convex_hull.exterior.coords)[:-1])
    count = int(rng.integers(0, 4))
    lines, radii = rng.uniform(-1, 11, (count, 4)), rng.choice([0.0, 0.05, 0.4], count)
    return StaticMap.build(polygons, lines, radii, bounds=[0, 0, 10, 10])


def free_starts(static: StaticMap, clearance: float, rng: np.random.Generator) -> np.ndarray:
    free = free_space(static, clearance).buffer(-0.01)
    points = rng.uniform(0, 10, (60, 2))
    return points[shapely.contains_xy(free, *points.T)][:12]


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("kind", ["disc", "line", "polygon"])
@pytest.mark.slow
def test_lengths_equal_the_plain_visibility_graph(seed: int, kind: str) -> None:
    rng = np.random.default_rng(seed)
    static = random_map(rng)
    clearance = float(rng.choice([0.0, 0.3]))
    starts = free_starts(static, clearance, rng)
    if kind == "disc":
        goal = GoalDisc(rng.uniform(0, 10, 2), float(rng.uniform(0.2, 2.0)))
        target = shapely.Point(goal.center).buffer(goal.radius, quad_segs=256)
    elif kind == "line":
        goal = GoalLine(np.array([5.0, 8.0]), np.array([0.2, 1.0]))
        along = 100.0 * np.array([goal.normal[1], -goal.normal[0]])
        far = goal.point + 100.0 * goal.normal
        target = shapely.Polygon([goal.point - along, goal.point + along, far + along, far - along])
    else:
        goal = [np.array([[6.0, 1.0], [9.0, 2.0], [8.0, 3.0]])]
        target = shapely.Polygon(goal[0])
    expected = ReferenceGraph(static, clearance).distances(target, starts)
    graph = VisibilityGraph(static, clearance)
    paths = [graph.to_goal(start, goal) for start in starts]
    lengths = np.array([path.length for path in paths])
    np.testing.assert_array_equal(np.isinf(lengths), np.isinf(expected))
    reached = np.isfinite(lengths)
    np.testing.assert_allclose(lengths[reached], expected[reached], rtol=1e-3, atol=1e-3)
    room = free_space(static, clearance).buffer(1e-3)
    for path in (p for p in paths if math.isfinite(p.length)):
        steps = np.diff(path.points, axis=0)
        assert np.hypot(*steps.T).sum() == pytest.approx(path.length, abs=1e-9)
        assert target.distance(shapely.Point(path.points[-1])) < 1e-3
        if len(path.points) > 1:
            assert room.covers(shapely.LineString(path.points))


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.slow
def test_field_equals_the_plain_visibility_graph(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    static = random_map(rng)
    clearance = float(rng.choice([0.0, 0.3]))
    goal = GoalDisc(rng.uniform(0, 10, 2), 0.7)
    target = shapely.Point(goal.center).buffer(goal.radius, quad_segs=256)
    field = geodesic_field(static, goal, resolution=0.4, clearance=clearance)
    x, y = np.meshgrid(field.grid.x, field.grid.y)
    sure = np.abs(clearance_field(static, field.grid) - clearance) > 0.01
    free = shapely.contains_xy(free_space(static, clearance), x, y)
    assert np.isinf(field.values[~free & sure]).all()
    rows, cols = np.nonzero(free & sure)
    pick = rng.permutation(len(rows))[:25]
    rows, cols = rows[pick], cols[pick]
    expected = ReferenceGraph(static, clearance).distances(
        target, np.stack([x[rows, cols], y[rows, cols]], axis=1)
    )
    got = field.values[rows, cols]
    np.testing.assert_array_equal(np.isinf(got), np.isinf(expected))
    reached = np.isfinite(got)
    np.testing.assert_allclose(got[reached], expected[reached], rtol=1e-3, atol=1e-3)


def exact_u_length(clearance: float, start: tuple[float, float]) -> float:
    """Tangent, arc around the inner wall's end, tangent to the goal's centre, minus its radius."""
    radius, end = 0.5 + clearance, np.array([7.5, 10.0])
    a, b = np.array(start) - end, np.asarray(GOAL.center) - end
    la, lb = math.hypot(*a), math.hypot(*b)
    angle = 2.0 * math.pi - math.acos(float(a @ b) / (la * lb))
    arc = angle - math.acos(radius / la) - math.acos(radius / lb)
    legs = math.sqrt(la**2 - radius**2) + math.sqrt(lb**2 - radius**2)
    return legs + radius * arc - GOAL.radius


@pytest.mark.parametrize("clearance", [0.0, 0.3, 0.6])
def test_u_maze_against_the_formula(clearance: float) -> None:
    path = VisibilityGraph(U_MAZE, clearance).to_goal((11.25, 3.75), GOAL)
    exact = exact_u_length(clearance, (11.25, 3.75))
    assert exact <= path.length <= 1.0002 * exact
    end = path.points[-1]
    assert math.dist(end, GOAL.center) == pytest.approx(GOAL.radius)
    field = geodesic_field(U_MAZE, GOAL, resolution=0.1, clearance=clearance)
    for x, y in ((11.25, 3.75), (9.33, 2.07), (13.0, 6.0)):
        exact = exact_u_length(clearance, (x, y))
        assert field.sample(x, y) == pytest.approx(exact, rel=1e-3)
        assert field.exact(x, y) == pytest.approx(exact, rel=2e-4)


def test_to_center_adds_the_radius_where_the_last_leg_is_straight() -> None:
    rim = geodesic_field(U_MAZE, GOAL, resolution=0.5)
    centre = geodesic_field(U_MAZE, GOAL, resolution=0.5, to_center=True)
    row, col = rim.grid.cell(11.25, 3.75)
    assert centre.values[row, col] == pytest.approx(rim.values[row, col] + GOAL.radius)


def test_an_empty_map_measures_straight_distances() -> None:
    static = StaticMap.build(bounds=[0, 0, 4, 3])
    path = VisibilityGraph(static).shortest_path((0.5, 0.5), (3.5, 2.5))
    assert path.length == pytest.approx(math.hypot(3, 2))
    np.testing.assert_allclose(path.points, [[0.5, 0.5], [3.5, 2.5]])
    field = geodesic_field(static, GoalDisc(np.array([1.0, 1.0]), 0.5), resolution=0.25)
    x, y = np.meshgrid(field.grid.x, field.grid.y)
    np.testing.assert_allclose(
        field.values, np.maximum(np.hypot(x - 1, y - 1) - 0.5, 0.0), atol=1e-12
    )


def test_start_in_the_goal_has_no_way_to_go() -> None:
    path = VisibilityGraph(U_MAZE).to_goal((3.0, 3.0), GOAL)
    assert path.length == 0.0
    np.testing.assert_array_equal(path.points, [[3.0, 3.0]])


@pytest.mark.usefixtures("either_size")
def test_a_sealed_goal_cannot_be_reached() -> None:
    box = [[4, 4, 6, 4], [6, 4, 6, 6], [6, 6, 4, 6], [4, 6, 4, 4]]
    static = StaticMap.build([], box, 0.0, bounds=[0, 0, 10, 10])
    goal = GoalDisc(np.array([5.0, 5.0]), 0.5)
    path = VisibilityGraph(static).to_goal((1.0, 1.0), goal)
    assert math.isinf(path.length) and path.points.shape == (0, 2)
    field = geodesic_field(static, goal, resolution=0.5)
    assert np.isinf(field.values[0, 0])
    assert math.isfinite(field.values[10, 10])
    assert math.isinf(field.sample(1.0, 1.0))
    buried = GoalDisc(np.array([7.5, 5.0]), 0.2)
    assert math.isinf(VisibilityGraph(U_MAZE).to_goal((2.0, 2.0), buried).length)


@pytest.mark.usefixtures("either_size")
def test_touching_blocks_leave_no_passage_but_slits_do() -> None:
    left = np.array([[0, 4], [5, 4], [5, 6], [0, 6]], float)
    for slit, open_ in ((0.0, False), (1e-3, True)):
        right = np.array([[5 + slit, 4], [10, 4], [10, 6], [5 + slit, 6]], float)
        static = StaticMap.build([left, right], bounds=[0, 0, 10, 10])
        path = VisibilityGraph(static).shortest_path((5.0, 1.0), (5.0, 9.0))
        assert math.isfinite(path.length) == open_
    field = geodesic_field(static, GoalDisc(np.array([5.0, 1.0]), 0.1), resolution=0.5)
    assert math.isfinite(field.values[-1, -1])


def test_a_start_in_the_inflation_leaves_by_the_shortest_way() -> None:
    wall = np.array([[4, 0], [6, 0], [6, 10], [4, 10]], float)
    static = StaticMap.build([wall], bounds=[0, 0, 10, 10])
    graph = VisibilityGraph(static, 0.5)
    path = graph.shortest_path((6.2, 5.0), (9.0, 5.0))
    np.testing.assert_allclose(path.points, [[6.2, 5.0], [6.5, 5.0], [9.0, 5.0]], atol=1e-4)
    assert path.length == pytest.approx(2.8, abs=1e-5)
    assert math.isinf(graph.shortest_path((5.0, 5.0), (9.0, 5.0)).length)
    assert math.isinf(graph.shortest_path((9.0, 5.0), (6.2, 5.0)).length)
    # in a corner of two walls neither wall's own way out is free
    floor = np.array([[6, 0], [10, 0], [10, 1], [6, 1]], float)
    static = StaticMap.build([wall, floor], bounds=[0, 0, 10, 10])
    path = VisibilityGraph(static, 0.5).shortest_path((6.1, 1.1), (8.0, 5.0))
    np.testing.assert_allclose(path.points[1], [6.5, 1.5], atol=1e-4)


def test_paths_stay_inside_the_bounds() -> None:
    wall = np.array([[4, -1], [6, -1], [6, 4], [4, 4]], float)
    inside = StaticMap.build([wall], bounds=[0, 0, 10, 10])
    path = VisibilityGraph(inside).shortest_path((2.0, 1.0), (8.0, 1.0))
    assert path.points[:, 1].max() == pytest.approx(4.0, abs=1e-4)
    closed = StaticMap.build([wall], bounds=[0, 0, 10, 3])
    assert math.isinf(VisibilityGraph(closed).shortest_path((2.0, 1.0), (8.0, 1.0)).length)
    field = geodesic_field(
        inside, GoalDisc(np.array([8.0, 1.0]), 0.1), resolution=0.5, bounds=[0, 0, 10, 3]
    )
    assert np.isinf(field.values[:, 0]).all()


def test_targets_may_be_segments_and_unions() -> None:
    static = StaticMap.build(bounds=[0, 0, 10, 10])
    graph = VisibilityGraph(static)
    exits = [np.array([[0.0, 0.0], [10.0, 0.0]]), np.array([[9.0, 4.0], [10.0, 4.0], [10.0, 9.0]])]
    assert graph.to_goal((3.0, 4.0), exits).length == pytest.approx(4.0)
    assert graph.to_goal((8.0, 4.0), exits).length == pytest.approx(1.0)


@pytest.mark.parametrize(
    "goal",
    [
        (),
        "goal",
        3.0,
        [np.zeros((1, 2))],
    ],
)
def test_what_is_no_goal_is_refused(goal: object) -> None:
    with pytest.raises(InvalidInputError):
        VisibilityGraph(U_MAZE).to_goal((1.0, 1.0), goal)  # type: ignore[arg-type]


def test_negative_clearance_and_bad_points_are_refused() -> None:
    with pytest.raises(InvalidInputError):
        VisibilityGraph(U_MAZE, -0.1)
    with pytest.raises(InvalidInputError):
        VisibilityGraph(U_MAZE).shortest_path((1.0, math.nan), (2.0, 2.0))
    with pytest.raises(InvalidInputError):
        geodesic_field(U_MAZE, GOAL, resolution=-1.0)


def test_equal_maps_share_the_field() -> None:
    again = StaticMap.build([], U_WALLS, 0.5, bounds=[0, 0, 15, 15])
    first = geodesic_field(U_MAZE, GOAL, resolution=0.2)
    assert geodesic_field(again, GoalDisc(GOAL.center, GOAL.radius), resolution=0.2) is first


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=60)
def test_sampling_is_close_to_exact_and_never_reads_across_a_wall(seed: int) -> None:
    rng = np.random.default_rng(seed)
    wall = StaticMap.build([], [[5, -1, 5, 8]], 0.01, bounds=[0, 0, 10, 10])
    goal = GoalDisc(np.array([2.0, 2.0]), 0.5)
    field = geodesic_field(wall, goal, resolution=0.25)
    for x, y in rng.uniform(0, 10, (20, 2)):
        # half a cell's diagonal where only the point's own cell counts, half of that elsewhere
        bound = 0.25 * math.sqrt(0.5) * (1.0 if abs(x - 5.0) < 0.3 else 0.5)
        inside = 0.125 < min(x, y) and max(x, y) < 9.875
        if inside and abs(x - 5.0) > 0.01:
            assert field.sample(x, y) == pytest.approx(field.exact(x, y), abs=bound + 1e-9)


def test_sampling_beside_walls_and_outside_is_finite() -> None:
    field = geodesic_field(U_MAZE, GOAL, resolution=0.1, clearance=0.6)
    assert np.isinf(field.values[0, 0])
    assert np.isfinite(field.filled).all()
    near_wall, free = field.sample(8.4, 5.0), field.sample(8.7, 5.0)
    assert free <= near_wall <= free + 0.5
    assert math.isfinite(field.sample(-3.0, 40.0))


def test_bounds_that_cells_do_not_fill_leave_the_rest_unreached() -> None:
    static = StaticMap.build(bounds=[0, 0, 1.04, 1.0])
    field = geodesic_field(static, GoalDisc(np.array([0.2, 0.2]), 0.1), resolution=0.1)
    assert field.grid == Grid(np.zeros(2), 0.1, (10, 11))
    assert np.isinf(field.values[:, -1]).all()
    assert np.isfinite(field.values[:, :-1]).all()


@pytest.mark.usefixtures("either_size")
@pytest.mark.parametrize(
    "seed", [*range(4), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(4, 12))]
)
def test_the_lazy_search_finds_what_the_complete_graph_holds(seed: int) -> None:
    rng = np.random.default_rng(200 + seed)
    static, clearance = random_map(rng), float(rng.choice([0.0, 0.3]))
    goals = [
        GoalDisc(rng.uniform(0, 10, 2), float(rng.uniform(0.2, 2.0))),
        GoalLine(np.array([5.0, 8.0]), np.array([0.2, 1.0])),
        [np.array([[6.0, 1.0], [9.0, 2.0], [8.0, 3.0]]), np.array([[0.0, 0.0], [1.0, 0.0]])],
    ]
    for goal in goals:
        complete = goal_distances(static, goal, clearance=clearance)
        for start in rng.uniform(0, 10, (8, 2)):
            path = VisibilityGraph(static, clearance).to_goal(start, goal)
            expected = complete.path_from(start)
            estimated = shortest_path._USUAL is core.Estimates.ALWAYS
            longest = 1.05 if estimated else 1.0 + 3e-7
            assert (1.0 - 3e-7) * expected.length <= path.length <= longest * expected.length
            if math.isfinite(path.length):
                assert np.hypot(*np.diff(path.points, axis=0).T).sum() == pytest.approx(path.length)


def test_a_search_among_ten_thousand_walls_can_be_stopped() -> None:
    rng = np.random.default_rng(0)
    ends = rng.uniform(0, 300, (10_000, 2))
    static = StaticMap.build(
        segments=np.hstack([ends, ends + rng.normal(0, 1, ends.shape)]), bounds=[0, 0, 300, 300]
    )
    looks: list[float] = []

    def stopped() -> bool:
        looks.append(time.thread_time())
        return len(looks) >= 40

    path = VisibilityGraph(static, 0.2).to_goal(
        (150.0, 150.0), GoalDisc((299.0, 299.0), 0.5), stopped
    )
    assert math.isinf(path.length) and len(looks) == 40
    assert np.median(np.diff(looks)) < 0.1  # a whole graph takes minutes


def test_the_way_out_of_a_crowded_dead_end_is_found_soon() -> None:
    square = np.array([[0.0, 0.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]])
    wall = [square + np.array([10.0, 0.5 * i]) for i in range(40)]  # but the goal is behind it
    posts = [0.5 * square + 1.2 * np.array([i, j]) for i in range(1, 8) for j in range(2, 16)]
    static = StaticMap.build(wall + posts, bounds=[0, -2, 14, 20])
    goal = GoalDisc((13.0, 18.0), 0.2)
    looks: list[None] = []

    def stopped() -> bool:
        looks.append(None)
        return False

    found = []
    graphs = (
        VisibilityGraph(static, 0.2, exact=True),
        VisibilityGraph(with_many_corners(static), 0.2),
    )
    for graph in graphs:
        looks.clear()
        path = graph.to_goal((9.2, 18.0), goal, stopped)
        found.append((path.length, len(looks)))
    (shortest, slow), (length, quick) = found
    assert shortest <= length <= 1.05 * shortest
    assert 5 * quick < slow, (quick, slow)


@pytest.mark.usefixtures("either_size")
@pytest.mark.parametrize("bounds", [[0.3, 0.3, 10.3, 8.3], [-1.3, -2.7, 11.1, 5.5]])
def test_goals_on_corners_and_edges_of_the_map_are_reached(bounds: list[float]) -> None:
    left, low, right, high = bounds
    corner = np.array([left + 5.0, low + 4.0])
    block = 0.1 * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) + corner
    static = StaticMap.build([block], bounds=bounds)
    start = np.array([left + 2.0, low + 5.6])
    goals = [(x, y) for x in (left, right, 0.5 * (left + right)) for y in (low, high)]
    for goal in goals:
        path = VisibilityGraph(static).shortest_path(start, goal)
        assert path.length == pytest.approx(math.dist(start, goal), rel=0.05)


def test_that_no_way_leads_to_the_goal_is_found_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shortest_path, "_USUAL", core.Estimates.ALWAYS)
    square = np.array([[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]])
    wall = [square + np.array([7.0, 0.1 * i]) for i in range(100)]
    posts = [square + np.array([0.9 * i, 0.9 * j]) for i in range(1, 7) for j in range(1, 11)]
    room = [[7.5, 4, 9.5, 4], [9.5, 4, 9.5, 6], [9.5, 6, 7.5, 6], [7.5, 6, 7.5, 4]]
    block = 5.0 * square + np.array([8.2, 4.7])
    static = StaticMap.build([*wall, *posts, block], room, 0.01, bounds=[0, 0, 10, 10])
    looks: list[None] = []

    def stopped() -> bool:
        looks.append(None)
        return False

    path = VisibilityGraph(static).to_goal((0.1, 0.1), GoalDisc((9.8, 9.8), 0.1), stopped)
    assert math.isinf(path.length)
    assert len(looks) < 400
