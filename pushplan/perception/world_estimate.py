"""`WorldEstimate`: the world of a robot that knows only what it has seen."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from pushplan.perception.detector import Detections
from pushplan.perception.lidar import LidarScan, object_outlines
from pushplan.perception.movability import Movability
from pushplan.perception.scan_map import ScanMap
from pushplan.world import Goal, Movables, PriceMap, RobotModel, StaticMap, Twist, World
from pushplan.world.checks import FloatArray, choice, expect, number
from pushplan.world.occupancy_grid import UNKNOWN
from pushplan.world.unseen import Unseen

_CELLS = 8.0  # to the inscribed radius of the robot
_RIM = 1.5  # cells around an object in which a beam is taken to have hit the object
_INEXACT = 0.75  # cells by which a wall may stand nearer than the map has it
_BEHIND = 2.0  # cells behind a place in an object that a beam has to reach: then it is gone


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
        cell: side of the cells of the map [m]; an eighth of the robot's inscribed radius if None.
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
        unknown: str = "free",
        unknown_price: float = 0.0,
        drift: float = 0.02,
        margin: float | None = None,
    ) -> None:
        self._robot = expect("robot", robot, RobotModel)
        self._goal = goal
        self._known = known
        self._unknown = choice("treatment of unknown cells", unknown, UNKNOWN)
        self._unknown_price = number("unknown_price", unknown_price, low=0.0)
        self._drift = number("drift", drift, low=0.0)
        if cell is None:
            cell = robot.inscribed_radius / _CELLS
        self.map = ScanMap(bounds, cell, robot.circumscribed_radius)
        if margin is None:
            margin = _INEXACT * self.map.cell * (known is None)
        self._margin = number("margin", margin, low=0.0)
        self.objects = Movables.empty()
        self.movability = Movability(robot)
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
        """Take the objects that were seen at one time; older ones than before change nothing."""
        seen = expect("detections", detections, Detections).objects
        new = [detections.time > self._seen_at.get(k, -math.inf) for k in seen.ids.tolist()]
        self._put(seen.select(np.array(new, dtype=np.bool_)), detections.time)

    def _put(self, seen: Movables, time: float) -> None:
        self._seen_at |= dict.fromkeys(seen.ids.tolist(), time)
        self._time = max(self._time, time)
        self.objects = self.objects.updated(seen)
        if self._known is None:
            self.map.clear(shapely.buffer(_polygons(seen), 0.5 * self.map.cell))

    def add_scan(self, scan: LidarScan) -> None:
        """Take a laser scan."""
        self._time = max(self._time, expect("scan", scan, LidarScan).time)
        self._forget(scan)
        hit = np.isfinite(scan.ranges)
        of_object = np.zeros(len(hit), dtype=np.bool_)
        if hit.any() and len(self.objects):
            tree = shapely.STRtree(_polygons(self.objects))
            points = shapely.points(scan.points)
            beams, _ = tree.query(points, "dwithin", _RIM * self.map.cell)
            of_object[np.flatnonzero(hit)[beams]] = True
        self.map.add(scan, of_object)

    def _forget(self, scan: LidarScan) -> None:
        """Drop the objects through whose place the scan sees."""
        ids = self.objects.ids
        old = np.array([self._seen_at[label] < scan.time for label in ids.tolist()], dtype=np.bool_)
        if not len(scan.bearings) or not old.any():
            return
        places = _inner_places(self.objects.select(old)) - scan.pose[:2]
        away = np.hypot(*places.T)
        turn = np.arctan2(places[:, 1], places[:, 0]) - scan.pose[2]
        off = np.abs(np.remainder(turn[:, None] - scan.bearings + np.pi, 2.0 * np.pi) - np.pi)
        beam = off.argmin(axis=1)
        met = off.min(axis=1) < 4.0 * np.pi / max(len(scan.bearings), 2)
        ranges = np.nan_to_num(scan.ranges[beam], nan=0.0, posinf=scan.reach)
        gone = ids[old][met & (ranges > away + _BEHIND * self.map.cell)]
        if len(gone):
            self.objects = self.objects.updated(Movables.empty(), gone)

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
        static = self._known
        if static is None:
            static = self.map.static_map(unknown=self._unknown)
        cells = self.map.unseen
        origin = self.map.origin
        price = None
        if self._unknown_price > 0.0:
            price = PriceMap(
                np.where(cells, self._unknown_price, 0.0), self.map.cell, np.append(origin, 0.0)
            )
        world = World(
            self._robot,
            pose,  # type: ignore[arg-type]
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


def _inner_places(objects: Movables) -> FloatArray:
    """(K, 2) places [m] that are inside the objects: in the middle of their first parts."""
    firsts = np.searchsorted(objects.part_owners, np.arange(len(objects)))
    corners, starts = object_outlines(objects)
    sums = np.add.reduceat(corners, starts[:-1], axis=0)
    middles: FloatArray = (sums / np.diff(starts)[:, None])[firsts]
    return middles


def _polygons(objects: Movables) -> NDArray[Any]:
    """(P,) polygons of Shapely, the parts of the objects where they are."""
    corners, starts = object_outlines(objects)
    rings = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    found: NDArray[Any] = shapely.polygons(shapely.linearrings(corners, indices=rings))
    return found
