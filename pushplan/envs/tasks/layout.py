"""Start scenes: walls, and square objects on free floor without overlaps."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from pushplan.envs.tasks.presets import Preset
from pushplan.geometry import GeodesicField, geodesic_field
from pushplan.geometry.object_ways import shared_ways
from pushplan.world import (
    AreaGoal,
    GoalDisc,
    ManipulationGoal,
    Movables,
    Receptacle,
    RobotModel,
    ScenarioError,
    StaticMap,
)
from pushplan.world.checks import BoolArray, FloatArray, IntArray
from pushplan.world.convex_shapes import areas_and_centres, disjoint, shapes_of
from pushplan.world.outline import transform, transform_outlines

GAP = 0.01
"""Least distance between bodies at the start, as a fraction of the box size."""
_BATCH = 64
_LATTICE_SHIFTS = 16
_LATTICE_CELLS = 20_000
_TOUCH_TRIES = 20
_TOUCH = 1e-6
"""Distance to the robot at which a box touches it, as a fraction of the box's size."""
_CORNERS = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])


@dataclass(frozen=True)
class FreeSpace:
    """The free floor among static obstacles; thick segments count with their round outline."""

    static: StaticMap

    @cached_property
    def _pieces(self) -> tuple[tuple[Any, float], ...]:
        """Each obstacle as a geometry and how far it reaches around it [m]."""
        static = self.static
        polygons = [(shapely.Polygon(polygon), 0.0) for polygon in static.polygons]
        lines = [
            (shapely.LineString(line.reshape(2, 2)), float(radius))
            for line, radius in zip(static.segments, static.radii, strict=True)
        ]
        return (*polygons, *lines)

    def is_free(
        self, shapes: NDArray[Any], gap: float, keep_off: Sequence[tuple[Any, float]] = ()
    ) -> BoolArray:
        """Check which Shapely geometries stay more than ``gap`` [m] off every obstacle.

        Args:
            shapes: the geometries.
            gap: [m].
            keep_off: further obstacles: Shapely geometries, each with a radius [m] around it.
        """
        free = np.ones(len(shapes), dtype=bool)
        for piece, reach in (*self._pieces, *keep_off):
            free &= shapely.distance(shapes, piece) > reach + gap
        return free

    def place_squares(
        self,
        rng: np.random.Generator,
        count: int,
        size: float,
        *,
        keep_off: Sequence[tuple[Any, float]] = (),
        gap: float = 0.0,
        random_yaw: bool = False,
        spacing: float = 0.0,
        within: ArrayLike | None = None,
        allowed: Callable[[FloatArray], BoolArray] | None = None,
        robot: Sequence[Any] = (),
        touching: bool = False,
    ) -> FloatArray:
        """Poses of squares that overlap nothing: (count, 3) x, y [m], theta [rad].

        Centres are drawn uniformly over the given box and rejected where they do not fit.
        When that fails too often, squares go to random cells of a shifted lattice, which packs
        nearly as many as fit at all.

        Args:
            rng: the only source of randomness.
            count: number of squares.
            size: side [m].
            keep_off: what else must stay free: Shapely geometries, each with a radius [m]
                around it.
            gap: least distance to anything [m].
            random_yaw: any heading instead of 0; on the lattice, multiples of a right angle.
            spacing: least distance between two centres [m].
            within: (4,) x_min, y_min, x_max, y_max of the centres [m]; the map's bounds if None.
            allowed: which centres (N, 2) [m] may be used, beyond all that.
            robot: Shapely geometries that squares stay off, too.
            touching: let squares touch the robot instead: they are placed as if it were not there,
                and those that overlap it are moved straight away from its middle until they touch.

        Raises:
            ScenarioError: if there is no room for them.
        """
        if count == 0:
            return np.zeros((0, 3))
        box = np.asarray(self.static.bounds if within is None else within, dtype=np.float64)
        low = box[:2]
        high = box[2:]
        if not touching:
            keep_off = [*keep_off, *((shape, 0.0) for shape in robot)]

        def fits(poses: FloatArray, gap: float = gap) -> BoolArray:
            found = self.is_free(shapely.polygons(squares(poses, size)), gap, keep_off)
            if allowed is not None and found.any():
                found[found] = allowed(poses[found, :2])
            return found

        for _ in range(_TOUCH_TRIES if touching else 0):
            poses = _place(rng, count, box, fits, size, gap, spacing, random_yaw)
            poses, pushed = _moved_off(poses, size, shapely.union_all(list(robot)))
            centres = poses[pushed, :2]
            inside = ((centres >= low) & (centres <= high)).all()
            others = (poses[k + 1 :] for k in range(count))
            apart = (_keeps_off(*pair, size, spacing) for pair in zip(poses, others, strict=True))
            if inside and fits(poses[pushed], 0.0).all() and all(apart):
                return poses
        keep_off = [*keep_off, *((shape, 0.0) for shape in robot if touching)]
        return _place(rng, count, box, fits, size, gap, spacing, random_yaw)


def _place(
    rng: np.random.Generator,
    count: int,
    box: FloatArray,
    fits: Callable[[FloatArray], BoolArray],
    size: float,
    gap: float,
    spacing: float,
    random_yaw: bool,
) -> FloatArray:
    """Squares at random, or on a lattice where that fails."""
    low = box[:2]
    high = box[2:]
    if (high >= low).all() and count * size * size < float(np.prod(high - low + size)):
        placed = _throw(rng, count, box, fits, size + gap, spacing, random_yaw)
        if len(placed) == count:
            return placed
        cells = _lattice(rng, count, box, fits, max(size + gap, spacing))
        if len(cells) >= count:
            poses = np.zeros((count, 3))
            poses[:, :2] = rng.permutation(cells)[:count]
            if random_yaw:
                poses[:, 2] = rng.integers(0, 4, count) * (np.pi / 2.0)
            return poses
        room = f"room for {len(cells)} was found"
    else:
        room = "the floor has {:g} x {:g} m for their centres".format(*(high - low))
    raise ScenarioError(
        f"{count} boxes of {size:g} m do not fit: {room}; ask for fewer or smaller boxes"
    )


def _moved_off(poses: FloatArray, size: float, body: Any) -> tuple[FloatArray, BoolArray]:
    """Poses (N, 3) of squares, and which of them have been moved off a body, to touch it."""
    moved = poses.copy()
    middle = np.array([body.centroid.x, body.centroid.y])
    reach = size + math.dist(body.bounds[:2], body.bounds[2:])
    pushed: BoolArray = shapely.intersects(shapely.polygons(squares(poses, size)), body)
    for k in np.flatnonzero(pushed):
        away = poses[k, :2] - middle
        length = float(np.hypot(*away))
        away = away / length if length > 0.0 else np.array([1.0, 0.0])
        near = 0.0
        far = reach
        while far - near > _TOUCH * size:
            half = 0.5 * (near + far)
            moved[k, :2] = poses[k, :2] + half * away
            hit = shapely.Polygon(squares(moved[k : k + 1], size)[0]).intersects(body)
            near, far = (half, far) if hit else (near, half)
        moved[k, :2] = poses[k, :2] + far * away
    return moved, pushed


def _keeps_off(pose: FloatArray, others: FloatArray, size: float, spacing: float) -> bool:
    """Return True if a square overlaps none of others (N, 3), and centres keep their spacing."""
    away = np.hypot(*(others[:, :2] - pose[:2]).T)
    if (away < spacing).any():
        return False
    # squares whose centres are a diagonal apart do not meet
    near = others[away < math.sqrt(2.0) * size]
    if not len(near):
        return True
    shape, *shapes = shapely.polygons(squares(np.vstack([pose, near]), size))
    return not shapely.intersects(shape, shapes).any()


def _throw(
    rng: np.random.Generator,
    count: int,
    box: FloatArray,
    fits: Callable[[FloatArray], BoolArray],
    size: float,
    spacing: float,
    random_yaw: bool,
) -> FloatArray:
    """Random sequential placement within a budget; fewer than ``count`` if it runs out."""
    placed = np.zeros((count, 3))
    done = 0
    for _ in range(max(8, math.ceil(8 * count / _BATCH))):
        poses = np.zeros((_BATCH, 3))
        poses[:, :2] = rng.uniform(box[:2], box[2:], (_BATCH, 2))
        if random_yaw:
            poses[:, 2] = rng.uniform(-np.pi, np.pi, _BATCH)
        for pose in poses[fits(poses)]:
            if _keeps_off(pose, placed[:done], size, spacing):
                placed[done] = pose
                done += 1
                if done == count:
                    return placed
    return placed[:done]


def _lattice(
    rng: np.random.Generator,
    count: int,
    box: FloatArray,
    fits: Callable[[FloatArray], BoolArray],
    pitch: float,
) -> FloatArray:
    """(N, 2) free centres of the best of some shifted square lattices."""
    low = box[:2]
    high = box[2:]
    pitch = max(pitch * (1.0 + 1e-9), math.sqrt(float(np.prod(high - low)) / _LATTICE_CELLS))
    best = np.zeros((0, 2))
    for shift in rng.uniform(0.0, pitch, (_LATTICE_SHIFTS, 2)):
        x = np.arange(low[0] + shift[0], high[0], pitch)
        y = np.arange(low[1] + shift[1], high[1], pitch)
        poses = np.stack(
            [np.repeat(x, len(y)), np.tile(y, len(x)), np.zeros(len(x) * len(y))], axis=1
        )
        cells = poses[fits(poses)][:, :2]
        if len(cells) > len(best):
            best = cells
        if len(best) >= count:
            break
    return best


def those_inside(
    receptacle: Receptacle, movables: Movables, ids: IntArray, poses: FloatArray
) -> IntArray:
    """Ids of the objects that are in a receptacle with all corners.

    Args:
        receptacle: the area.
        movables: all objects of the start, by increasing ids.
        ids: (K,) of those that are on the floor, increasing.
        poses: (K, 3) of them.
    """
    if len(ids) < len(movables):
        movables = movables.select(np.isin(movables.ids, ids))
    inside: IntArray = ids[movables.within(receptacle.contains_each, poses)]
    return inside


def place_boxes(
    free_space: FreeSpace,
    rng: np.random.Generator,
    count: int,
    size: float,
    robot: Sequence[Any],
    *,
    preset: Preset,
    wanted: Any,
    **rules: Any,
) -> Movables:
    """Square boxes, or objects that fit in them, on free floor; some of them stand on casters.

    Args:
        free_space: the floor.
        rng: the only source of randomness.
        count: number of boxes.
        size: side [m].
        robot: Shapely geometries of the robot.
        preset: of a task with boxes.
        wanted: the variations of that task: shapes, heading, fraction on casters, whether boxes may
            touch the robot.
        rules: as `FreeSpace.place_squares` takes them.

    Raises:
        ScenarioError: if there is no room for them.
    """
    touching = wanted.touching
    if touching is None:
        touching = preset.touching
    poses = free_space.place_squares(
        rng,
        count,
        size + 2.0 * preset.contact_radius,
        robot=robot,
        touching=touching,
        gap=GAP * size,
        random_yaw=wanted.box_yaw == "random",
        **rules,
    )
    on_casters = np.zeros(count, dtype=bool)
    on_casters[rng.permutation(count)[: round((wanted.wheeled or 0.0) * count)]] = True
    masses = None
    if preset.box_mass is not None:
        masses = np.full(count, preset.box_mass)
    if wanted.objects == "many":  # each as heavy as a box
        if masses is None:
            masses = np.full(count, size * size)
        contact_radius = preset.contact_radius
        return objects_of_many_shapes(rng, poses, size, masses, on_casters, contact_radius)
    return Movables.from_outlines(
        [_CORNERS * size] * count,
        poses,
        masses=masses,
        wheeled=on_casters,
        contact_radii=preset.contact_radius,
    )


@dataclass(frozen=True)
class GoalWays:
    """Shortest ways of the objects' centres to where a goal wants them, on a grid.

    Args:
        static: obstacles.
        goal: of the objects.
        resolution: side of a cell [m].
    """

    static: StaticMap
    goal: ManipulationGoal
    resolution: float

    @cached_property
    def _fields(self) -> dict[object, GeodesicField]:
        return {}

    def field(self, goal: AreaGoal | GoalDisc) -> GeodesicField:
        """The distances to an area, or to the place of an object."""
        if goal not in self._fields:
            self._fields[goal] = geodesic_field(self.static, goal, resolution=self.resolution)
        return self._fields[goal]

    def lengths(self, ids: IntArray, poses: FloatArray) -> FloatArray:
        """(K,) ways of objects at poses (K, 3) [m], inf where there is none."""
        return shared_ways(
            self.goal, ids, poses[:, :2], lambda goal, points: self.field(goal).sample_each(points)
        )


def footprint_at(robot: RobotModel, pose: FloatArray) -> list[Any]:
    """Shapely polygons of the robot's parts at a pose (3,)."""
    return [shapely.Polygon(transform(pose, part)) for part in robot.contact_parts]


def squares(poses: FloatArray, size: float) -> FloatArray:
    """(N, 4, 2) corners [m] of squares of side ``size`` at poses (N, 3)."""
    count = len(poses)
    corners = np.tile(_CORNERS * size, (count, 1))
    return transform_outlines(poses, corners, np.arange(0, 4 * count + 1, 4)).reshape(count, 4, 2)


def _rectangle(x0: float, y0: float, x1: float, y1: float) -> list[list[float]]:
    return [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]


SHAPES = {
    "box": [_rectangle(-0.5, -0.5, 0.5, 0.5)],
    "L": [_rectangle(-0.5, -0.5, 0.5, -0.1), _rectangle(-0.5, -0.1, -0.1, 0.5)],
    "T": [_rectangle(-0.5, 0.1, 0.5, 0.5), _rectangle(-0.2, -0.5, 0.2, 0.1)],
    "U": [
        _rectangle(-0.5, -0.5, 0.5, -0.15),
        _rectangle(-0.5, -0.15, -0.2, 0.5),
        _rectangle(0.2, -0.15, 0.5, 0.5),
    ],
    "chair": [  # two legs and a bar between the other two
        _rectangle(-0.45, 0.3, 0.45, 0.45),
        _rectangle(-0.45, -0.45, -0.3, -0.3),
        _rectangle(0.3, -0.45, 0.45, -0.3),
    ],
    "table": [_rectangle(x, y, x + 0.15, y + 0.15) for x in (-0.5, 0.35) for y in (-0.5, 0.35)],
}
"""Name -> convex parts that touch other things."""
_CUT = dict(zip(SHAPES, shapes_of("shape", list(SHAPES.values())), strict=True))


def objects_of_many_shapes(
    rng: np.random.Generator,
    poses: FloatArray,
    size: float,
    masses: FloatArray,
    wheeled: BoolArray,
    contact_radius: float,
) -> Movables:
    """Objects of random shapes, each in a square of side `size` [m] at a pose (K, 3)."""
    names = list(SHAPES)
    outlines = []
    places = poses.copy()
    for k, choice in enumerate(rng.integers(len(names), size=len(poses)).tolist()):
        parts = _CUT[names[choice]]
        centre = areas_and_centres([disjoint(parts)])[1]
        places[k, :2] = transform(poses[k], size * centre)[0]
        outlines.append([size * (part - centre) for part in parts])
    return Movables.from_outlines(
        outlines, places, masses=masses, wheeled=wheeled, contact_radii=contact_radius
    )
