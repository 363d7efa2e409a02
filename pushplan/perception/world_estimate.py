"""`WorldEstimate`: the world of a robot that knows only what it has seen."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from pushplan.errors import InvalidInputError, short
from pushplan.perception.detector import Detections
from pushplan.perception.lidar import LidarScan, object_outlines
from pushplan.perception.movability import Movability
from pushplan.perception.scan_map import ScanMap
from pushplan.world import Goal, Movables, PriceMap, RobotModel, StaticMap, Twist, World
from pushplan.world.checks import FloatArray, array, checked_bounds, choice, expect, number
from pushplan.world.occupancy_grid import UNKNOWN
from pushplan.world.outline import transform
from pushplan.world.scene import Unseen

_CELLS = 8.0  # to the inscribed radius of the robot
_RIM = 1.5  # cells around an object in which a beam that meets it is taken to have hit it
_MEETS = 0.5  # cells within which a beam meets an object, or a cell of the map is of the object
_INEXACT = 0.75  # cells by which a wall may stand nearer than the map has it
_INTO = 2.0  # cells that most beams which would hit an object have to reach into it: it is gone
_PUSHED = 1.5  # distance up to which the robot may have pushed an object [circumscribed radii]
_MOST_CELLS = 4e6  # of a map whose cells nobody has chosen


class WorldEstimate:
    """Builds a `World` from laser scans and detected objects.

    What scans hit is static, unless it belongs to an object that was detected. Objects stay where
    they were seen last, until they are seen elsewhere or a scan sees through the place where they
    were. Poses of the robot are taken to be known.

    Args:
        robot: its footprint and limits.
        goal: where the robot, or the objects, have to go.
        bounds: (4,) x_min, y_min, x_max, y_max of the scene [m].
        known: what is known to be static; then scans say nothing new of what is static.
        cell: side of the cells of the map [m]; if None an eighth of the robot's inscribed radius,
            and more where that were more than 4 million cells; never less than ``range_noise``.
        position_noise: standard deviation of the positions of detected objects [m].
        heading_noise: the same of their headings [rad].
        range_noise: standard deviation of the distances in scans [m].
        unknown: ``"free"`` or ``"obstacle"``, what counts where nobody has looked.
        unknown_price: price of a metre where nobody has looked, see `pushplan.world.PriceMap`.
        drift: by how much the place of an object becomes uncertain that is not seen [m/√s].
        margin: distance that plans keep from what is static [m]; if None three quarters of a cell,
            by which a wall may stand nearer than the map has it, or 0 with a known map.

    Attributes:
        map: log-odds of what scans have hit.
        objects: those that were detected, as they were seen last.
        movability: what is known of which objects can be moved.

    Raises:
        InvalidInputError: if an argument is out of range.

    Example:
        >>> estimate = WorldEstimate(robot, goal, (0, 0, 9, 9))  # doctest: +SKIP
        >>> estimate.add_scan(scan)  # doctest: +SKIP
        >>> world = estimate.world(pose, twist, scan.time)  # doctest: +SKIP
    """

    def __init__(
        self,
        robot: RobotModel,
        goal: Goal,
        bounds: ArrayLike,
        *,
        known: StaticMap | None = None,
        cell: float | None = None,
        position_noise: float = 0.0,
        heading_noise: float = 0.0,
        range_noise: float = 0.0,
        unknown: str = "free",
        unknown_price: float = 0.0,
        drift: float = 0.02,
        margin: float | None = None,
    ) -> None:
        self._robot = expect("robot", robot, RobotModel)
        if not isinstance(goal, Goal):
            raise InvalidInputError(f"goal must be the goal of a World, got {short(goal)}")
        self._goal = goal
        self._known = known
        if known is not None:
            expect("known", known, StaticMap)
        self._unknown = choice("treatment of unknown cells", unknown, UNKNOWN)
        self._unknown_price = number("unknown_price", unknown_price, low=0.0)
        self._drift = number("drift", drift, low=0.0)
        place = number("position_noise", position_noise, low=0.0)
        range_noise = number("range_noise", range_noise, low=0.0)
        self._inexact = math.hypot(place, range_noise)
        self._turned = number("heading_noise", heading_noise, low=0.0)
        if cell is None:
            x0, y0, x1, y1 = checked_bounds("bounds", bounds).tolist()
            cell = robot.inscribed_radius / _CELLS
            cell = max(cell, math.sqrt((x1 - x0) * (y1 - y0) / _MOST_CELLS))
        cell = max(number("cell", cell, low=0.0, open_low=True), range_noise)
        self.map = ScanMap(bounds, cell, robot.circumscribed_radius, range_noise)
        if margin is None:
            margin = _INEXACT * self.map.cell * (known is None)
        self._margin = number("margin", margin, low=0.0)
        self.objects = Movables.empty()
        self.movability = Movability(robot, position_noise)
        self._seen_at: dict[int, float] = {}
        self._time = -math.inf

    @property
    def unseen_s(self) -> FloatArray:
        """(K,) for how long each object has not been seen [s]."""
        seen_at = [self._seen_at[label] for label in self.objects.ids.tolist()]
        return np.maximum(self._time - np.array(seen_at, dtype=np.float64), 0.0)

    @property
    def deviations(self) -> FloatArray:
        """(K,) standard deviation by which an object may have moved since it was seen [m]."""
        return self._drift * np.sqrt(self.unseen_s)

    def add_detections(self, detections: Detections) -> None:
        """Take the objects that were seen at one time; older ones than before change nothing.

        What scans have hit of an object before it was seen, or since, is not static.
        """
        seen = expect("detections", detections, Detections).objects
        time = detections.time
        before = np.array([self._seen_at.get(label, -math.inf) for label in seen.ids.tolist()])
        seen = seen.select(before < time)
        since = before[before < time][seen.part_owners]
        self._seen_at |= dict.fromkeys(seen.ids.tolist(), time)
        self._time = max(self._time, time)
        self.objects = self.objects.updated(seen)
        if self._known is None:
            near = self._near(seen)[seen.part_owners]
            self.map.clear(_polygons(seen), _MEETS * self.map.cell, near, since)

    def _near(self, objects: Movables) -> FloatArray:
        """(K,) distance from objects at which beams may have hit them [m]."""
        near: FloatArray = 2.0 * np.hypot(self._inexact, self._turned * objects.radii)
        return near

    def add_scan(self, scan: LidarScan) -> None:
        """Take a laser scan."""
        self._time = max(self._time, expect("scan", scan, LidarScan).time)
        self._forget(scan)
        hit = np.isfinite(scan.ranges)
        of_object = np.zeros(len(hit), dtype=np.bool_)
        if hit.any() and len(self.objects):
            shapes = _polygons(self.objects)
            near = self._near(self.objects)[self.objects.part_owners]
            points = scan.points
            reach = _RIM * self.map.cell + near.max()
            beams, met = shapely.STRtree(shapes).query(shapely.points(points), "dwithin", reach)
            ways = shapely.linestrings(
                np.stack([np.tile(scan.pose[:2], (len(beams), 1)), points[beams]], 1)
            )
            crossing = shapely.dwithin(ways, shapes[met], _MEETS * self.map.cell + near[met])
            of_object[np.flatnonzero(hit)[beams[crossing]]] = True
        self.map.add(scan, of_object)

    def _forget(self, scan: LidarScan) -> None:
        """Drop the objects through whose place the scan sees."""
        ids = self.objects.ids.tolist()
        old = [self._seen_at[label] < scan.time for label in ids]
        if not len(scan.bearings) or not any(old):
            return
        objects = self.objects.select(np.array(old, dtype=np.bool_))
        seen = np.nan_to_num(scan.ranges, nan=0.0, posinf=scan.range_max)
        offset = objects.poses[:, :2] - scan.pose[:2]
        away = np.hypot(*offset.T)
        turn = np.arctan2(offset[:, 1], offset[:, 0]) - scan.pose[2]
        off = np.abs(np.remainder(turn[:, None] - scan.bearings + np.pi, 2.0 * np.pi) - np.pi)
        width = np.arcsin(np.minimum(objects.radii / np.maximum(away, 1e-9), 1.0))
        maybe = ((off <= width[:, None]) & (seen > away[:, None])).any(axis=1)
        missed = []
        for k in np.flatnonzero(maybe).tolist():
            one = objects.select([k])
            begins, ends = _crossed(one, scan)
            met = np.isfinite(ends) & (seen > 0.0)
            into = _INTO * self.map.cell + float(self._near(one)[0])
            least = np.maximum(begins + into, 0.5 * (begins + ends))
            if away[k] < objects.radii[k] + _PUSHED * self._robot.circumscribed_radius:
                least = ends + into  # the robot may have pushed it since it was seen
            beyond = met & (seen > least)
            if met.any() and 2 * beyond.sum() > met.sum():
                missed.append(k)
        if missed:
            self.objects = self.objects.updated(Movables.empty(), objects.ids[missed])

    def sent(self, twist: Twist) -> None:
        """Take the command that the robot drives from now on.

        An object that stops the robot is then held not to move, and one that was seen to move not.
        """
        self.movability.send(twist)

    def world(self, pose: ArrayLike, twist: ArrayLike | None, time: float) -> World:
        """The scene as it is believed to be.

        Args:
            pose: (3,) of the robot: x, y [m], theta [rad].
            twist: (3,) of the robot in the world frame [m/s, m/s, rad/s]; at rest if None.
            time: [s].
        """
        pose = array("pose", pose, (3,))
        static = self._known
        if static is None:
            free = []
            if self._unknown == "obstacle":
                parts = [transform(pose, one) for one in self._robot.contact_parts]
                free = [*_polygons(self.objects), *map(shapely.Polygon, parts)]
            static = self.map.static_map(unknown=self._unknown, free=free)
        cells = self.map.unseen
        origin = self.map.origin
        price = None
        if self._unknown_price > 0.0:
            price = PriceMap(
                np.where(cells, self._unknown_price, 0.0), self.map.cell, np.append(origin, 0.0)
            )
        world = World(
            self._robot,
            pose,
            static,
            self.objects,
            self._goal,
            twist,  # type: ignore[arg-type]
            time,
            self._margin,
            price,
            Unseen(cells, self.map.cell, origin),
        )
        return self.movability.update(world)


def _crossed(one: Movables, scan: LidarScan) -> tuple[FloatArray, FloatArray]:
    """Distances at which beams would enter and leave an object [m]; infinite if they miss it.

    Returns:
        (N,) and (N,).
    """
    corners, starts = object_outlines(one)
    following = np.arange(1, len(corners) + 1)
    following[starts[1:] - 1] = starts[:-1]
    a = corners - scan.pose[:2]
    edge = a[following] - a
    angles = scan.pose[2] + scan.bearings
    along = np.column_stack([np.cos(angles), np.sin(angles)])[:, None]
    across = along[..., 0] * edge[:, 1] - along[..., 1] * edge[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        away = (a[:, 0] * edge[:, 1] - a[:, 1] * edge[:, 0]) / across
        part = (a[:, 0] * along[..., 1] - a[:, 1] * along[..., 0]) / across
    crossed = (away > 0.0) & (part >= 0.0) & (part <= 1.0)
    begins = np.where(crossed, away, np.inf).min(axis=1, initial=np.inf)
    ends = np.where(crossed, away, -np.inf).max(axis=1, initial=-np.inf)
    return begins, np.where(np.isfinite(ends), ends, np.inf)


def _polygons(objects: Movables) -> NDArray[Any]:
    """(P,) polygons of Shapely, the parts of the objects where they are."""
    corners, starts = object_outlines(objects)
    rings = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    found: NDArray[Any] = shapely.polygons(shapely.linearrings(corners, indices=rings))
    return found
