"""Furnished offices: rooms along corridors, narrow doors, thin legs, and boxes in the way."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely

from pushplan.world import GoalDisc, Movables, RobotModel, ScenarioError, StaticMap, World
from pushplan.world.checks import FloatArray, integer, number
from pushplan.world.outline import transform

MOST_POLYGONS = 20_000
"""More than this is refused: a typing error rather than a wish."""
_POLYGONS_PER_ROOM = 18.4  # in the mean
_ROOM = (5.0, 4.5)  # length along the corridor and depth [m]
_CORRIDOR = 2.0  # width [m]
_PITCH = 2.0 * _ROOM[1] + _CORRIDOR  # from one corridor to the next [m]
_WALL = 0.1  # thickness [m]
_DOOR = 0.9  # width of the opening [m]
_TO_NEIGHBOUR = 0.3  # fraction of the neighbouring rooms that have a door between them
_DOOR_MARGIN = 0.8  # least distance of a door's middle from the corners of a room [m]
_KEPT_CLEAR = 1.1  # around a door's middle, so that a box can be pushed through [m]
_DESKS = (1, 3)  # of a room, each with a chair
_DESK = (1.4, 0.7, 0.06)  # distances of the legs' middles, and side of a leg [m]
_CHAIR = (0.4, 0.4, 0.04)
_CHAIR_AWAY = 0.7  # of the chair's middle from the desk's [m]
_DESK_MARGIN = 1.1  # least distance of a desk's middle from the walls, chair included [m]
_DESKS_APART = 1.5  # of their middles [m]
_SHELF = (1.2, 0.4)  # length and depth [m]
_BOX_SIDES = (0.3, 0.55)  # [m]
_BOX_DENSITY = 5.0  # of a box of cardboard and its contents [kg/m²]
_GAP = 0.02  # least distance between bodies at the start [m]
_GOAL_RADIUS = 0.25  # as Nav2's goal checker has it [m]
_TRIES = 30
_PLACES = 300  # drawn for start and goal; a quarter of them or more are free


def generate_office(
    rng: np.random.Generator, *, robot: RobotModel, polygons: int = 1000, boxes: float = 0.3
) -> World:
    """A random office, turned by any angle, with a start and a goal far apart.

    Rooms of 5 x 4.5 m lie on both sides of parallel corridors, which a cross corridor joins. Each
    room has a door of 0.9 m to its corridor, some have one to the next room. Desks and chairs
    are four legs each, a shelf stands at the back wall.

    Start and goal lie in one connected piece of the floor that is left when all static polygons are
    grown by the robot's circumscribed radius. So a way exists, once boxes have been pushed out of
    the doors that they narrow; on both sides of a door is room for them.

    Args:
        rng: the only source of randomness.
        robot: stands at the start.
        polygons: about how many there are, of walls, legs and shelves.
        boxes: fraction of the doors that have a box in them, and number of boxes elsewhere over
            that of the rooms.

    Raises:
        InvalidInputError: if a value is out of range.
        ScenarioError: if the robot is too large for the office.
    """
    integer("office polygons", polygons, low=100, high=MOST_POLYGONS)
    fraction = number("office boxes", boxes, low=0.0, high=1.0)
    corridors, columns = _layout(polygons)
    outlines, doors = _walls(rng, corridors, columns)
    for k in range(2 * corridors * columns):
        outlines += _furniture(rng, _room(k, columns), doors)
    walls = shapely.STRtree(shapely.polygons(outlines))
    objects = _boxes_in_doors(rng, doors, fraction)
    objects += _boxes_elsewhere(rng, walls, objects, round(fraction * 2 * corridors * columns))
    yaw = np.array([0.0, 0.0, rng.uniform(-np.pi, np.pi)])
    static = StaticMap.build([transform(yaw, outline) for outline in outlines])
    movables = Movables.from_polygons(
        [transform(yaw, outline) for outline in objects], density=_BOX_DENSITY
    )
    start, end = start_and_goal(rng, static, movables, robot)
    return World(robot, start, static, movables, GoalDisc(end, _GOAL_RADIUS))


def start_and_goal(
    rng: np.random.Generator, static: StaticMap, movables: Movables, robot: RobotModel
) -> tuple[FloatArray, FloatArray]:
    """A pose x, y, theta and a point [m], half a map apart, for a disc around the robot.

    Both are off everything, in the largest connected piece of the floor among what is static.

    Raises:
        ScenarioError: if there is no such pair.
    """
    # a buffer's corners lie on the circle: 1 / cos lays its sides outside of it
    reach = (robot.circumscribed_radius + _GAP) / math.cos(np.pi / 16.0)
    walls = shapely.buffer(shapely.polygons(list(static.convex_parts)), reach, quad_segs=4)
    taken = [
        shapely.Polygon(part).buffer(reach, quad_segs=4)
        for k in range(len(movables))
        for part in movables.parts_world(k)
    ]
    floor = shapely.difference(shapely.box(*static.bounds), shapely.union_all(walls))
    pieces = shapely.get_parts(floor)
    largest = pieces[np.argmax(shapely.area(pieces))]
    low = static.bounds[:2]
    high = static.bounds[2:]
    places = rng.uniform(low, high, (_PLACES, 2))
    places = places[
        shapely.contains_xy(shapely.difference(largest, shapely.union_all(taken)), places)
    ]
    distances = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
    pairs = np.argwhere(distances >= 0.5 * (high - low).max())
    if not len(pairs):
        raise ScenarioError(f"office: no way for robot {robot.name!r}; try a smaller one")
    start, end = places[rng.choice(pairs)]
    return np.array([*start, rng.uniform(-np.pi, np.pi)]), end


def office_diagonal(polygons: int) -> float:
    """Diagonal of an office of about so many static polygons [m]."""
    corridors, columns = _layout(polygons)
    return math.hypot(columns * _ROOM[0] + _CORRIDOR + _WALL, corridors * _PITCH + _WALL)


def _layout(polygons: int) -> tuple[int, int]:
    """Number of corridors, and of rooms on each side of one, for an office as wide as long."""
    rooms = polygons / _POLYGONS_PER_ROOM
    corridors = max(1, round(math.sqrt(rooms * _ROOM[0] / (2.0 * _PITCH))))
    return corridors, math.ceil(rooms / (2.0 * corridors))


def _room(k: int, columns: int) -> FloatArray:
    """Corners of a room (2, 2): at the left end of its corridor's wall and opposite of it [m]."""
    row, column = divmod(k, columns)
    low = row // 2 * _PITCH + _ROOM[1]
    left = column * _ROOM[0]
    if row % 2 == 0:  # below the corridor
        return np.array([(left, low), (left + _ROOM[0], low - _ROOM[1])])
    return np.array([(left, low + _CORRIDOR), (left + _ROOM[0], low + _CORRIDOR + _ROOM[1])])


def _walls(
    rng: np.random.Generator, corridors: int, columns: int
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Outlines of the walls, and the doors as poses x, y [m], theta along the wall [rad]."""
    length = columns * _ROOM[0]
    right = length + _CORRIDOR
    top = corridors * _PITCH
    walls = _wall((0.0, 0.0), (0.0, top)) + _wall((right, 0.0), (right, top))
    for row in range(corridors + 1):  # the outer walls, and those between two rows of rooms
        end = right if row in (0, corridors) else length
        walls += _wall((0.0, row * _PITCH), (end, row * _PITCH))
    doors = []
    for row in range(2 * corridors):
        fronts = [_room(row * columns + column, columns) for column in range(columns)]
        places = [
            (rng.uniform(corner[0] + _DOOR_MARGIN, far[0] - _DOOR_MARGIN), corner[1], 0.0)
            for corner, far in fronts
        ]
        walls += _wall(fronts[0][0], (length, fronts[0][0, 1]), [x for x, _, _ in places])
        for corner, far in fronts:
            low, high = sorted((corner[1], far[1]))
            between = []
            if far[0] < length and rng.random() < _TO_NEIGHBOUR:
                between = [
                    (far[0], rng.uniform(low + _DOOR_MARGIN, high - _DOOR_MARGIN), np.pi / 2)
                ]
            walls += _wall((far[0], low), (far[0], high), [y - low for _, y, _ in between])
            places += between
        doors += [np.array(place) for place in places]
    return walls, doors


def _wall(
    start: Sequence[float] | FloatArray,
    end: Sequence[float] | FloatArray,
    doors: Sequence[float] = (),
) -> list[FloatArray]:
    """Outlines of a wall along a line, in pieces between doors this far from its start [m]."""
    length = math.dist(start, end)
    pose = np.array([*start, math.atan2(end[1] - start[1], end[0] - start[0])])
    openings = [x for door in doors for x in (door - 0.5 * _DOOR, door + 0.5 * _DOOR)]
    edges = np.array([-0.5 * _WALL, *openings, length + 0.5 * _WALL]).reshape(-1, 2)
    return [transform(pose, _rectangle(low, high, _WALL)) for low, high in edges]


def _rectangle(low: float, high: float, width: float) -> FloatArray:
    """Corners (4, 2) from ``low`` to ``high`` along x, of a width about the x axis [m]."""
    half = 0.5 * width
    return np.array([(low, -half), (high, -half), (high, half), (low, half)])


def _furniture(
    rng: np.random.Generator, room: FloatArray, doors: Sequence[FloatArray]
) -> list[FloatArray]:
    """Outlines of a shelf at the back wall, and of the legs of desks and chairs, off the doors."""
    low = room.min(axis=0)
    high = room.max(axis=0)
    clear = np.array(doors)[:, :2]
    half = 0.5 * _SHELF[0]
    inward = math.copysign(0.5 * (_SHELF[1] + _WALL) + 0.02, room[0, 1] - room[1, 1])
    found = []
    for _ in range(_TRIES):
        shelf = np.array([rng.uniform(low[0] + 0.7, high[0] - 0.7), room[1, 1] + inward, 0.0])
        if _apart(shelf, clear, _KEPT_CLEAR + half):
            found.append(transform(shelf, _rectangle(-half, half, _SHELF[1])))
            break
    desks = np.empty((0, 2))
    for _ in range(rng.integers(_DESKS[0], _DESKS[1] + 1)):
        for _ in range(_TRIES):
            desk = rng.uniform((*(low + _DESK_MARGIN), 0.0), (*(high - _DESK_MARGIN), 2.0 * np.pi))
            chair = np.array([0.0, -_CHAIR_AWAY, rng.uniform(-0.5, 0.5)])
            chair[:2] = transform(desk, chair[None, :2])[0]
            chair[2] += desk[2]
            reach = _KEPT_CLEAR + 0.5 * math.hypot(*_DESK[:2])
            if _apart(desk, clear, reach) and _apart(desk, desks, _DESKS_APART):
                desks = np.vstack([desks, desk[:2]])
                found += _legs(desk, *_DESK) + _legs(chair, *_CHAIR)
                break
    return found


def _apart(pose: FloatArray, others: FloatArray, distance: float) -> bool:
    return bool((np.hypot(*(others - pose[:2]).T) >= distance).all())


def _legs(pose: FloatArray, length: float, width: float, side: float) -> list[FloatArray]:
    """Outlines of four square legs at the corners of a rectangle about a pose [m]."""
    leg = _rectangle(-0.5 * side, 0.5 * side, side)
    middles = np.array([(x, y) for x in (-0.5, 0.5) for y in (-0.5, 0.5)]) * (length, width)
    return [transform(pose, middle + leg) for middle in middles]


def _box(rng: np.random.Generator, pose: FloatArray) -> FloatArray:
    half = 0.5 * rng.uniform(*_BOX_SIDES)
    return transform(pose, _rectangle(-half, half, 2.0 * half))


def _boxes_in_doors(
    rng: np.random.Generator, doors: Sequence[FloatArray], fraction: float
) -> list[FloatArray]:
    """Outlines of boxes in some of the doors, clear of the walls beside them."""
    chosen = rng.permutation(len(doors))[: round(fraction * len(doors))]
    shifts = rng.uniform((-0.05, -0.2, -0.2), (0.05, 0.2, 0.2), (len(chosen), 3))
    boxes = []
    for k, shift in zip(sorted(chosen), shifts, strict=True):
        pose = np.array([*transform(doors[k], shift[None, :2])[0], doors[k][2] + shift[2]])
        boxes.append(_box(rng, pose))
    return boxes


def _boxes_elsewhere(
    rng: np.random.Generator, walls: shapely.STRtree, others: list[FloatArray], count: int
) -> list[FloatArray]:
    """Outlines of boxes anywhere on the floor, off everything; fewer where there is no space."""
    bounds = shapely.total_bounds(walls.geometries)
    placed = [shapely.Polygon(outline) for outline in others]
    boxes: list[FloatArray] = []
    for _ in range(_TRIES * count):
        if len(boxes) == count:
            break
        outline = _box(rng, rng.uniform((*bounds[:2], 0.0), (*bounds[2:], np.pi)))
        shape = shapely.Polygon(outline)
        is_off = all(shape.distance(other) > _GAP for other in placed)
        if is_off and not walls.query(shape, "dwithin", _GAP).size:
            boxes.append(outline)
            placed.append(shape)
    return boxes
