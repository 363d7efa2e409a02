"""Sensors against scenes whose visible parts are known, and the map and world made of them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from conftest import make_robot
from hypothesis import given, settings
from hypothesis import strategies as st

from pushplan.perception import (
    Detections,
    Detector,
    Lidar,
    LidarObservation,
    LidarScan,
    Movability,
    ScanMap,
    WorldEstimate,
)
from pushplan.world import GoalDisc, InvalidInputError, Movables, StaticMap, Twist, World

BOX = np.array([(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)])
ROBOT = make_robot(min_speed=-1.0)
GOAL = GoalDisc(np.array([3.0, 3.0]), 0.3)
HALL = (-4.0, -3.0, 4.0, 3.0)


def wall(x0: float, y0: float, x1: float, y1: float) -> list[tuple[float, float]]:
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def hall(boxes=(), walls=(), at=(0.0, 0.0, 0.0), time: float = 0.0) -> World:
    """A hall of 8 x 6 m with its robot, boxes of 0.4 m and some walls."""
    x0, y0, x1, y1 = HALL
    around = [
        wall(x0 - 0.2, y0, x0, y1),
        wall(x1, y0, x1 + 0.2, y1),
        wall(x0, y0 - 0.2, x1, y0),
        wall(x0, y1, x1, y1 + 0.2),
    ]
    static = StaticMap.build(polygons=[*around, *walls], bounds=HALL)
    poses = np.array(boxes, dtype=float).reshape(-1, 3)
    objects = Movables.from_outlines([BOX] * len(poses), poses)
    return World(ROBOT, np.array(at, dtype=float), static, objects, GOAL, time=time)


def to_walls(points: np.ndarray) -> np.ndarray:
    """(N,) distances of points (N, 2) to the nearest wall around the hall [m]."""
    return np.abs(np.abs(points) - [4.0, 3.0]).min(axis=1)


def inside(points: np.ndarray) -> np.ndarray:
    """(N,) how far points (N, 2) lie inside the hall [m]."""
    return ([4.0, 3.0] - np.abs(points)).min(axis=1)


def estimate(**options) -> WorldEstimate:
    return WorldEstimate(ROBOT, GOAL, HALL, cell=0.05, **options)


def look(belief: WorldEstimate, world: World, lidar=None, detector=None) -> World:
    """Take in what is seen of a world without noise."""
    belief.add_detections((detector or Detector()).detect(world))
    belief.add_scan((lidar or Lidar()).scan(world))
    return belief.world(world.robot_pose, world.robot_twist, world.time)


class _Turned:
    """A detector that says headings with noise."""

    def __init__(self, rng):
        self._rng = rng

    def detect(self, world: World) -> Detections:
        return Detector(heading_noise=0.05).detect(world, self._rng)


class TestLidar:
    @given(st.floats(-3.5, 3.5), st.floats(-2.5, 2.5), st.floats(-4.0, 4.0))
    @settings(max_examples=30, deadline=None)
    def test_ranges_in_an_empty_hall_end_on_its_walls(self, x, y, heading):
        scan = Lidar(beams=90, range=20.0).scan(hall(at=(x, y, heading)))
        angles = heading + scan.bearings
        with np.errstate(divide="ignore"):
            across = (4.0 - np.sign(np.cos(angles)) * x) / np.abs(np.cos(angles))
            along = (3.0 - np.sign(np.sin(angles)) * y) / np.abs(np.sin(angles))
        np.testing.assert_allclose(scan.ranges, np.minimum(across, along), rtol=1e-6)
        on_wall = np.minimum(
            np.abs(np.abs(scan.points[:, 0]) - 4.0), np.abs(np.abs(scan.points[:, 1]) - 3.0)
        )
        assert on_wall.max() < 1e-6

    def test_objects_are_hit_and_what_is_out_of_range_is_infinite(self):
        scan = Lidar(beams=4, range=3.5).scan(hall([(2.0, 0.0, 0.0)]))
        np.testing.assert_allclose(scan.ranges, [1.8, 3.0, np.inf, 3.0])

    def test_a_field_of_view_is_ahead(self):
        scan = Lidar(beams=360, field_of_view=math.pi).scan(hall())
        assert len(scan.bearings) == 181 and np.abs(scan.bearings).max() <= math.pi / 2 + 1e-9

    def test_what_drivers_write_where_nothing_is_met_is_no_hit(self):
        scan = LidarScan(0.0, np.zeros(3), np.zeros(4), np.array([0.0, 2.0, 1e300, 1.0]), 2.0)
        np.testing.assert_array_equal(scan.ranges, [np.nan, np.inf, np.inf, 1.0])
        assert len(scan.points) == 1

    def test_noise_and_drop_outs_are_as_large_as_asked_for(self):
        lidar = Lidar(beams=20_000, range=20.0, noise=0.03, drop_out=0.2)
        exact = Lidar(beams=20_000, range=20.0).scan(hall())
        scan = lidar.scan(hall(), np.random.default_rng(0))
        lost = np.isnan(scan.ranges)
        assert lost.mean() == pytest.approx(0.2, abs=0.01)
        assert np.std(scan.ranges[~lost] - exact.ranges[~lost]) == pytest.approx(0.03, rel=0.05)

    @pytest.mark.parametrize(
        ("options", "said"),
        [
            ({"beams": 2}, "beams must be in"),
            ({"range": math.nan}, "range must"),
            ({"range": 0.0}, "range must"),
            ({"noise": -1.0}, "noise must"),
            ({"drop_out": 1.5}, "drop_out must"),
            ({"field_of_view": 7.0}, "field_of_view must"),
        ],
    )
    def test_bad_settings_are_refused(self, options, said):
        with pytest.raises(InvalidInputError, match=said):
            Lidar(**options)

    def test_a_scan_with_too_few_ranges_is_refused(self):
        for ranges in (np.ones(3), "ab", [1.0, -1.0], None):
            with pytest.raises(InvalidInputError, match="ranges must be 2 distances"):
                LidarScan(0.0, np.zeros(3), np.zeros(2), ranges, 5.0)


class TestDetector:
    def test_what_stands_behind_a_wall_or_a_box_is_not_seen(self):
        boxes = [(1.5, 0.0, 0.0), (3.0, 0.0, 0.0), (-2.0, 0.0, 0.0), (0.0, 2.0, 0.5)]
        world = hall(boxes, [wall(-1.5, -1.0, -1.3, 1.0)])
        visible = Detector().visible(world)
        np.testing.assert_allclose(visible[[0, 3]], 1.0)
        assert visible[1] == visible[2] == 0.0
        assert Detector().detect(world).objects.ids.tolist() == [0, 3]

    def test_range_and_field_of_view(self):
        world = hall([(1.5, 0.0, 0.0), (-1.5, 0.0, 0.0), (3.0, 1.0, 0.0)])
        assert Detector(field_of_view=math.pi).detect(world).objects.ids.tolist() == [0, 2]
        assert Detector(range=2.0).detect(world).objects.ids.tolist() == [0, 1]

    def test_half_a_box_is_half_visible(self):
        world = hall([(3.0, 0.0, 0.0)], [wall(1.0, 0.0, 1.2, 2.5)])
        assert Detector().visible(world)[0] == pytest.approx(0.5, abs=0.1)
        assert len(Detector(least_visible=0.7).detect(world).objects) == 0
        assert len(Detector(least_visible=0.3).detect(world).objects) == 1

    def test_it_says_nothing_of_what_can_be_moved(self):
        world = hall([(1.5, 0.0, 0.0)]).believing([True])
        assert not Detector().detect(world).objects.fixed.any()


class TestScanMap:
    def test_walls_are_where_they_are(self):
        chart = ScanMap(HALL, 0.05, 0.3)
        column = wall(1.0, -0.3, 1.6, 0.3)
        for at in ((-2.0, 1.0, 0.0), (2.5, -1.0, 0.0), (2.0, 2.0, 0.0)):
            scan = Lidar().scan(hall(walls=[column], at=at))
            chart.add(scan, np.zeros(len(scan.bearings), dtype=bool))
        static = chart.static_map()
        corners = static.packed[0]
        on_walls = (
            np.minimum(4.0 - np.abs(corners[:, 0]), 3.0 - np.abs(corners[:, 1])) <= 0.05 + 1e-9
        )
        on_column = (np.abs(corners - [1.3, 0.0]) <= 0.3 + 0.05 + 1e-9).all(axis=1)
        assert (on_walls | on_column).all() and on_column.any() and on_walls.any()
        assert chart.static_map() is static

    @pytest.mark.parametrize("far", [1e6, 1e300])
    def test_beams_that_leave_the_map_are_free_up_to_its_end(self, far):
        chart = ScanMap(HALL, 0.1)
        nothing = np.full(720, np.inf)
        bearings = np.linspace(-math.pi, math.pi, 720, endpoint=False)
        chart.add(LidarScan(0.0, np.zeros(3), bearings, nothing, far), nothing < 0.0)
        assert chart.unseen.mean() < 0.1 and not chart.static_map().polygons

    def test_what_is_behind_something_is_unseen(self):
        chart = ScanMap(HALL, 0.1)
        scan = Lidar().scan(hall(walls=[wall(1.0, -3.0, 1.2, 3.0)]))
        chart.add(scan, np.zeros(len(scan.bearings), dtype=bool))
        unseen = chart.unseen
        assert unseen[:, 54:].all() and not unseen[5:-5, 5:48].any()
        solid = chart.static_map(unknown="obstacle")
        assert sum(len(part) for part in solid.polygons) > sum(
            len(part) for part in chart.static_map().polygons
        )

    def test_noise_of_a_cell_makes_no_walls(self):
        noise = 0.02
        chart = ScanMap(HALL, 0.02, 0.3, noise)
        rng = np.random.default_rng(3)
        for k in range(60):
            there = hall(at=(-3.5, 0.1 * k - 3.0, 0.1 * k))
            scan = Lidar(noise=noise, drop_out=0.2).scan(there, rng)
            chart.add(scan, np.zeros(len(scan.bearings), dtype=bool))
        static = chart.static_map()
        hits = shapely.union_all(shapely.polygons(list(static.polygons)))
        assert np.quantile(inside(static.packed[0]), 0.99) < 1.6 * noise
        scan = Lidar(beams=90).scan(there)
        assert np.quantile(shapely.distance(hits, shapely.points(scan.points)), 0.95) < 2.5 * noise

    @settings(max_examples=10)
    @given(seed=st.integers(0, 1000))
    def test_the_map_is_that_of_the_cells_whatever_was_done_before(self, seed):
        rng = np.random.default_rng(seed)
        chart = ScanMap(HALL, 0.1, 0.3, float(rng.choice([0.01, 0.1])))
        rows, columns = np.indices(chart.log_odds.shape)
        x, y = chart.origin[:, None, None] + 0.1 * (np.array([columns, rows]) + 0.5)
        for _ in range(6):
            at = (*rng.uniform(-2.0, 2.0, 2), rng.uniform(-3.0, 3.0))
            scan = Lidar(beams=90, range=2.5, noise=0.3).scan(hall(at=at), rng)
            chart.add(scan, np.zeros(len(scan.bearings), dtype=bool))
            if rng.random() < 0.3:
                box = shapely.box(*at[:2], at[0] + 0.5, at[1] + 0.5)
                chart.clear(np.array([box]), 0.05, np.array([0.05]), np.array([-math.inf]))
            unknown = str(rng.choice(["free", "obstacle"]))
            parts = map(shapely.Polygon, chart.static_map(unknown=unknown).polygons)
            solid = shapely.union_all(list(parts))
            within = shapely.contains_xy(solid, x, y)
            odds = chart.log_odds
            assert np.array_equal(chart.unseen, odds == 0.0)
            assert within[odds > 0.0].all() and not within[odds <= -1.0].any()
            assert (within[odds == 0.0] == (unknown == "obstacle")).all()

    def test_too_many_cells_are_refused(self):
        for cell in (1e-4, 1e-320):
            with pytest.raises(InvalidInputError, match="use larger cells"):
                ScanMap(HALL, cell)


class TestWorldEstimate:
    def test_an_object_behind_another_is_remembered(self):
        belief = estimate()
        seen = look(belief, hall([(1.0, 1.5, 0.3)]))
        hides = [wall(0.3, 0.5, 0.5, 2.9)]
        later = look(belief, hall([(1.0, 1.5, 0.3)], hides, time=4.0))
        np.testing.assert_array_equal(later.movables.poses, seen.movables.poses)
        assert belief.unseen_s.tolist() == [4.0]
        assert belief.deviations[0] == pytest.approx(0.04)

    def test_an_object_is_forgotten_when_its_place_is_seen_to_be_empty(self):
        belief = estimate()
        assert len(look(belief, hall([(1.0, 1.5, 0.3)])).movables) == 1
        assert len(look(belief, hall(time=1.0)).movables) == 0

    @pytest.mark.parametrize(
        "lidar",
        [
            Lidar(beams=36),
            Lidar(beams=72),
            Lidar(field_of_view=math.radians(20.0)),
            Lidar(field_of_view=math.radians(60.0)),
        ],
    )
    def test_an_object_that_no_beam_could_hit_is_not_forgotten(self, lidar):
        """It stands between two beams, or beside the field of view, and was not detected."""
        belief = estimate()
        edge = 0.5 * lidar.field_of_view + 0.15
        bearing = math.pi / 36 if lidar.beams < 100 else edge
        small = Movables.from_outlines(
            [0.2 * BOX], [[2.5 * math.cos(bearing), 2.5 * math.sin(bearing), 0.0]]
        )
        belief.add_detections(Detections(0.0, small))
        belief.add_scan(lidar.scan(replace(hall(time=1.0), movables=small)))
        assert len(belief.objects) == 1

    def test_unknown_space_may_be_closed(self):
        """Neither the robot nor an object is in what nobody has seen."""
        belief = estimate(unknown="obstacle")
        there = hall([(1.5, 0.4, 0.4)], at=(-2.0, 0.0, 0.0))
        world = look(belief, there, Lidar(field_of_view=4.7))
        solid = shapely.union_all([shapely.Polygon(part) for part in world.static.convex_parts])
        bodies = [*world.robot_outline_world(), *world.movables.every_part_world]
        assert solid.area > 5.0
        assert not any(solid.intersects(shapely.Polygon(part)) for part in bodies)

    def test_a_wall_behind_an_object_with_noise_stays(self):
        belief = estimate(position_noise=0.03)
        wall_of = [wall(1.5, -1.0, 1.7, 1.0)]
        for time in range(6):
            look(belief, hall(walls=wall_of, time=time))
        rng = np.random.default_rng(3)
        noisy = Detector(position_noise=0.03)
        for time in range(10, 30):
            there = hall([(1.28, 0.0, 0.0)], wall_of, time=time)
            belief.add_detections(noisy.detect(there, rng))
            belief.add_scan(Lidar().scan(there))
        solid = belief.world((0.0, 0.0, 0.0), None, 30.0).static
        walls = shapely.union_all([shapely.Polygon(part) for part in solid.convex_parts])
        assert walls.intersection(shapely.box(1.4, -0.15, 1.65, 0.15)).area > 0.01

    @pytest.mark.parametrize("depth", [0.0, 0.01, 0.03])
    def test_a_wall_along_which_an_object_slides_stays(self, depth):
        """Nobody sees the wall where the box leans on it; the map remembers it."""
        belief = estimate()
        wall_of = [wall(1.5, -1.0, 1.7, 1.0)]
        look(belief, hall(walls=wall_of))
        for time in range(1, 30):
            box = (1.3 + depth, -0.5 + 0.03 * time, 0.0)
            look(belief, hall([box], wall_of, time=time))
        solid = belief.world((0.0, 0.0, 0.0), None, 30.0).static
        walls = shapely.union_all([shapely.Polygon(part) for part in solid.convex_parts])
        face = shapely.LineString([(1.525, -0.8), (1.525, 0.8)])
        assert walls.buffer(1e-6).intersection(face).length > 0.98 * face.length

    @pytest.mark.parametrize("noise", [0.0, 1e-9, 0.001])
    def test_what_was_hit_of_an_object_before_it_was_detected_is_none(self, noise):
        """Its sides were walls for many scans; it is less than three cells wide."""
        belief = estimate(position_noise=noise)
        small = Movables.from_outlines([0.35 * BOX], [(1.2, 0.0, 0.4)])
        for time in range(6):
            there = replace(hall(at=(-0.1 * time, 0.3 * time, 0.0), time=time), movables=small)
            belief.add_scan(Lidar().scan(there))
        assert len(look(belief, replace(there, time=7.0)).static.polygons) > 0
        world = belief.world(there.robot_pose, None, 7.0)
        corners = world.static.packed[0]
        assert (np.hypot(*(corners - [1.2, 0.0]).T) > 0.5).all()

    def test_it_does_not_matter_how_often_the_world_is_asked_for(self):
        maps = []
        for asked in (False, True):
            belief = estimate()
            wall_of = [wall(1.5, -1.0, 1.7, 1.0)]
            for time in range(20):
                boxes = [] if time < 4 else [(1.32, -0.5 + 0.03 * time, 0.0)]
                there = hall(boxes, wall_of, time=time)
                belief.add_detections(Detector().detect(there))
                belief.add_scan(Lidar().scan(there))
                if asked:
                    belief.world(there.robot_pose, None, time)
            maps.append(belief.map.log_odds.copy())
        np.testing.assert_array_equal(*maps)

    def test_an_object_that_the_robot_has_pushed_is_not_forgotten(self):
        """A scan sees it elsewhere before the detector does."""
        belief = estimate()
        at = (0.75 - ROBOT.vertices[:, 0].max(), 0.0, 0.0)
        look(belief, hall([(1.0, 0.0, 0.0)], at=at))
        belief.add_scan(Lidar().scan(hall([(1.3, 0.0, 0.0)], at=at, time=1.0)))
        assert len(belief.objects) == 1

    def test_a_wall_beside_an_object_is_drawn(self):
        """The box hides none of it, and is a centimetre away."""
        belief = estimate()
        beside = [wall(1.0, 0.21, 1.4, 0.6)]
        for time in range(4):
            world = look(belief, hall([(1.2, 0.0, 0.0)], beside, (-1.0, 0.9, 0.0), time))
        walls = shapely.union_all([shapely.Polygon(part) for part in world.static.convex_parts])
        face = shapely.LineString([(1.0, 0.22), (1.0, 0.6)])
        assert walls.buffer(0.04).intersection(face).length > 0.95 * face.length

    def test_an_object_that_has_left_a_corner_is_forgotten(self):
        belief = estimate()
        rng = np.random.default_rng(0)
        assert len(look(belief, hall([(3.79, 2.79, 0.0)])).movables) == 1
        for time in range(1, 4):
            at = (*rng.uniform(-2.0, 2.0, 2), 0.0)
            belief.add_scan(Lidar().scan(hall(at=at, time=time)))
        assert len(belief.objects) == 0

    def test_a_turn_that_was_seen_wrongly_makes_no_walls(self):
        belief = estimate(heading_noise=0.05)
        rng = np.random.default_rng(2)
        long = Movables.from_outlines([[(-1, -0.2), (1, -0.2), (1, 0.2), (-1, 0.2)]], [(1.5, 0, 1)])
        for time in range(20):
            there = replace(hall(time=time), movables=long)
            world = look(belief, there, detector=_Turned(rng))
        assert (to_walls(world.static.packed[0]) < 0.2).all()

    def test_a_scan_from_beyond_the_map_says_nothing(self):
        chart = ScanMap(HALL, 0.1)
        far = LidarScan(0.0, (2.0, -9.0, math.pi / 2), [-0.3, 0.3], [3.0, 8.0], 10.0)
        chart.add(far, np.zeros(2, dtype=bool))
        assert chart.unseen.all() and not chart.static_map().polygons
        with pytest.raises(InvalidInputError, match="ignored must be 2 booleans"):
            chart.add(far, np.zeros(3, dtype=bool))
        with pytest.raises(InvalidInputError, match="unknown cells"):
            chart.static_map(unknown="blocked")

    def test_noise_is_no_motion(self):
        belief = estimate(position_noise=0.02)
        rng = np.random.default_rng(0)
        for time in range(200):
            noisy = Detector(position_noise=0.02).detect(hall([(1.5, 0.0, 0.0)], time=time), rng)
            belief.add_detections(noisy)
            world = belief.world((0.0, 0.0, 0.0), None, time)
        assert belief.movability.known(world.movables.ids) == ["unknown"]

    def test_objects_are_no_walls(self):
        world = look(estimate(), hall([(1.5, 0.4, 0.4), (-2.0, 0.0, 0.0)]))
        corners = world.static.packed[0]
        assert (to_walls(corners) < 0.2).all() and len(corners) > 4

    def test_an_object_that_was_taken_for_a_wall_is_one_no_more(self):
        belief = estimate()
        there = hall([(2.0, 0.0, 0.0)])
        blind = Detector(least_visible=1.0, range=0.5)
        assert (look(belief, there, detector=blind).static.packed[0][:, 0] < 2.0).any()
        world = look(belief, replace(there, time=1.0))
        near = np.abs(world.static.packed[0] - [2.0, 0.0]).max(axis=1) < 0.3
        assert not near.any() and len(world.movables) == 1

    def test_a_known_map_stays_and_prices_are_of_what_is_unseen(self):
        there = hall([(1.5, 0.0, 0.0)])
        belief = estimate(known=there.static, unknown_price=2.0)
        world = look(belief, there, Lidar(range=1.0), Detector(range=1.0))
        assert world.static is there.static and len(world.movables) == 0
        assert world.price is not None and world.unseen is not None
        assert set(np.unique(world.price.prices)) == {0.0, 2.0}
        np.testing.assert_array_equal(world.price.prices > 0.0, world.unseen.cells)

    def test_an_object_that_stops_the_robot_is_held_fixed_until_it_moves(self):
        belief = estimate()
        front = ROBOT.vertices[:, 0].max()
        at = (front + 0.2, 0.0, 0.0)
        for time in np.arange(0.0, 4.0, 0.2).tolist():
            belief.sent(Twist(1.0, 0.0))
            world = look(belief, hall([at], time=time))
        assert world.movables.fixed.tolist() == [True]
        assert belief.movability.known(world.movables.ids) == ["fixed"]
        moved = (front + 0.6, 0.0, 0.0)
        world = look(belief, hall([moved], time=9.0))
        assert world.movables.fixed.tolist() == [False]
        assert belief.movability.known(world.movables.ids) == ["movable"]

    def test_detections_that_come_late_change_nothing(self):
        belief = estimate()
        look(belief, hall([(1.0, 0.0, 0.0)], time=2.0))
        old = Detector().detect(hall([(2.0, 0.0, 0.0)], time=1.0))
        belief.add_detections(old)
        assert belief.objects.poses[0, 0] == 1.0

    @pytest.mark.parametrize("noise", [0.01, 0.03])
    def test_an_object_that_is_seen_with_noise_is_no_wall(self, noise):
        belief = WorldEstimate(
            ROBOT, GOAL, HALL, cell=0.01, position_noise=noise, range_noise=noise
        )
        detector = Detector(position_noise=noise, heading_noise=noise)
        rng = np.random.default_rng(2)
        for time in range(30):
            there = hall([(1.0, 0.3, 0.2)], at=(-1.0 + 0.02 * time, 0.0, 0.0), time=time)
            belief.add_detections(detector.detect(there, rng))
            belief.add_scan(Lidar(noise=noise).scan(there, rng))
        static = belief.world(there.robot_pose, None, there.time).static
        depths = inside(static.packed[0])
        assert len(depths) and not (depths > 0.3).any()

    def test_noise_moves_walls_little(self):
        belief = estimate()
        rng = np.random.default_rng(1)
        for time in range(20):
            there = hall([(1.5, 0.0, 0.0)], at=(-2.0 + 0.1 * time, 0.5, 0.1 * time), time=time)
            detector = Detector(position_noise=0.01, heading_noise=0.02, miss_rate=0.2)
            belief.add_detections(detector.detect(there, rng))
            belief.add_scan(Lidar(noise=0.02, drop_out=0.2).scan(there, rng))
        world = belief.world(there.robot_pose, None, there.time)
        corners = world.static.packed[0]
        assert np.quantile(to_walls(corners), 0.98) < 0.2
        assert np.abs(world.movables.poses[0, :2] - [1.5, 0.0]).max() < 0.05

    @pytest.mark.parametrize(
        ("options", "said"),
        [
            ({"unknown": "full"}, "unknown treatment of unknown cells 'full'"),
            ({"unknown_price": -1.0}, "unknown_price must"),
            ({"drift": math.inf}, "drift must"),
            ({"cell": 0.0}, "cell must"),
        ],
    )
    def test_bad_settings_are_refused(self, options, said):
        with pytest.raises(InvalidInputError, match=said):
            WorldEstimate(ROBOT, GOAL, HALL, **{"cell": 0.05, **options})

    def test_what_is_no_reading_is_refused(self):
        with pytest.raises(InvalidInputError, match="scan must be a LidarScan, got 5"):
            estimate().add_scan(5)
        with pytest.raises(InvalidInputError, match="detections must be a Detections"):
            estimate().add_detections(Movables.empty())
        with pytest.raises(InvalidInputError, match="time must be a number"):
            Detections("nan", Movables.empty())
        with pytest.raises(InvalidInputError, match="objects must be a Movables"):
            Detections(0.0, 5)
        with pytest.raises(InvalidInputError, match="known must be a StaticMap"):
            WorldEstimate(ROBOT, GOAL, HALL, known="x")
        with pytest.raises(InvalidInputError, match="goal must be"):
            WorldEstimate(ROBOT, None, HALL)
        with pytest.raises(InvalidInputError, match="robot must be a RobotModel"):
            WorldEstimate("jackal", GOAL, HALL)
        with pytest.raises(InvalidInputError, match="bounds"):
            WorldEstimate(ROBOT, GOAL, (0.0, 0.0, 0.0, math.nan))

    def test_no_reading_changes_nothing(self):
        belief = estimate()
        nothing = Movables.empty()
        belief.add_detections(Detections(0.0, nothing))
        belief.add_scan(LidarScan(0.0, np.zeros(3), np.zeros(0), np.zeros(0), 5.0))
        world = belief.world((0.0, 0.0, 0.0), None, 0.0)
        assert world.static.is_empty and world.unseen is not None and world.unseen.cells.all()


class TestMovability:
    def drive(self, commands, beside=(2.0, 0.0)) -> set[int]:
        """Ids of what has stopped a robot that hardly moves, next to a box."""
        x, y = beside
        world = hall([(x, y, 0.0)])
        x = x - 0.2 - ROBOT.vertices[:, 0].max() if abs(y) < 0.1 else x
        belief = Movability(ROBOT)
        for k, command in enumerate([*commands, Twist(0.0, 0.0)]):
            there = replace(world, robot_pose=(x + 0.002 * k / len(commands), 0.0, 0.0))
            belief.update(replace(there, time=0.1 * k))
            belief.send(command)
        return belief.stopped_by

    def test_what_is_ahead_has_stopped_it(self):
        assert self.drive([Twist(0.2, 0.0)] * 25) == {0}

    @pytest.mark.parametrize("before", [Twist(-0.2, 0.0), Twist(0.0, 0.8)])
    def test_what_it_meets_after_it_was_stopped_elsewhere_has_not(self, before):
        assert self.drive([before] * 25 + [Twist(0.2, 0.0)] * 2) == set()

    def test_what_is_beside_it_has_not(self):
        side = 0.2 + ROBOT.vertices[:, 1].max() - 1e-4
        assert self.drive([Twist(0.2, 0.0)] * 25, (0.0, side)) == set()

    def test_bad_input_is_refused(self):
        with pytest.raises(InvalidInputError, match="position_noise"):
            Movability(ROBOT, -1.0)
        with pytest.raises(InvalidInputError, match="robot must be a RobotModel"):
            Movability(None)
        with pytest.raises(InvalidInputError, match="command must be a Twist"):
            Movability(ROBOT).send((0.1, 0.0))


@pytest.mark.parametrize(
    "call",
    [
        lambda world, bad: Lidar().scan(bad),
        lambda world, bad: Lidar().scan(world, bad),
        lambda world, bad: Detector().detect(bad),
        lambda world, bad: Detector().detect(world, bad),
        lambda world, bad: Detector().visible(bad),
        lambda world, bad: LidarObservation().observe(bad),
        lambda world, bad: LidarObservation().observe_scan(bad, world),
        lambda world, bad: estimate().sent(bad),
        lambda world, bad: estimate().world(bad, None, 0.0),
        lambda world, bad: estimate(unknown="obstacle").world(bad, None, 0.0),
        lambda world, bad: ScanMap(HALL, 0.1).add(bad, np.zeros(1, dtype=bool)),
        lambda world, bad: Movability(ROBOT).update(bad),
        lambda world, bad: LidarScan(0.0, (0, 0, 0), [0.0], bad, 5.0),
    ],
)
@pytest.mark.parametrize("bad", ["abc", 5, [1.0, 2.0], [10**400], [1j]])
def test_what_has_the_wrong_type_is_refused(call, bad):
    with pytest.raises(InvalidInputError):
        call(hall(), bad)
