"""Random worlds for planners: ordinary, degenerate, moved, turned and scaled ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from pushplan.planners.registry import OPEN_WATER
from pushplan.world import (
    GoalDisc,
    GoalLine,
    GoalPose,
    Movables,
    RobotModel,
    StaticMap,
    World,
    turtlebot3_burger,
)
from pushplan.world.outline import transform

SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
CUT = ((0.7, 0.3), (0.4, 0.6))  # a corner that is cut off
HULLS = {
    "octagon": np.array(
        [(x * a, y * b) for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1)) for a, b in CUT[:: x * y]]
    ),
    "plank": SQUARE * [1.4, 0.2],
    "cart": 0.5 * SQUARE + [0.25, 0.0],  # turns about the middle of its rear edge
    "tractor": 0.5 * SQUARE + [0.6, 0.0],  # turns about a point outside of it
}
ANGLE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, -0.1], [-0.1, -0.1], [-0.1, 0.5], [-0.5, 0.5]])
CROSS = [SQUARE * [1.0, 0.3], SQUARE * [0.3, 1.0]]
DRIVES: tuple[dict[str, object], ...] = (
    {"drive": "differential"},
    {"drive": "differential", "min_speed": -0.1},
    {"drive": "car"},
    {"drive": "car", "min_speed": -0.1},
    {"drive": "omnidirectional"},
    {"drive": "constant_speed"},
)
"""The last one is all that planners of ships and `skeleton` are made for."""
SIDE = 10.0  # of every random world before it is scaled [m]
HALL = 40.0  # side of a hall of posts [m]
Rng = np.random.Generator


def _posts(rng: Rng, world: World) -> World:
    """Posts, slivers and up to three walls; starts and goals may lie in them."""
    posts = [
        SQUARE * rng.uniform(0.01, 0.8, 2) + spot
        for spot in rng.uniform(0, SIDE, (rng.integers(0, 16), 2))
    ]
    ends = rng.uniform(0, SIDE, (rng.integers(0, 4), 4))
    if rng.random() < 0.1:
        ends = np.array([[0, 5, 10, 5.0]])  # from side to side
    return replace(world, static=_static(posts, ends))


def _rooms(rng: Rng, world: World) -> World:
    """Walls with doors of any width, some of them closed."""
    walls = []
    for at in rng.uniform(2, 8, rng.integers(1, 4)):
        door, wide = rng.uniform(0, 10), rng.choice([0.0, rng.uniform(0.3, 3.0)])
        for a, b in ((0.0, door - wide / 2), (door + wide / 2, SIDE)):
            walls.append([a, at, b, at] if rng.random() < 0.5 else [at, a, at, b])
    box = [[0, 0, 10, 0], [10, 0, 10, 10], [10, 10, 0, 10], [0, 10, 0, 0]]
    return replace(world, static=_static([], np.array([*walls, *box], dtype=float)))


def _degenerate(rng: Rng, world: World) -> World:
    """Segments of no length, the same wall twice, walls on one line, collinear corners."""
    one = rng.uniform(0, SIDE, 4)
    middle = 0.5 * (one[:2] + one[2:])
    ends = [one, one, [*one[:2], *middle], [*middle, *one[2:]], [*one[2:], *one[:2]]]
    ends += [[*spot, *spot] for spot in rng.uniform(0, SIDE, (3, 2))]
    ends += [[0, 0, 0, SIDE], [5, 5, 5, 5 + 1e-9]]
    square = np.repeat(SQUARE, 2, axis=0)
    square[1::2] = 0.5 * (SQUARE + np.roll(SQUARE, -1, axis=0))  # collinear corners
    posts = [square + spot for spot in rng.uniform(0, SIDE, (2, 2))]
    radii = rng.choice([0.0, 1e-9, 0.05], len(ends))
    return replace(world, static=_static([*posts, posts[0]], np.array(ends), radii))


def _contact(rng: Rng, world: World) -> World:
    """A robot that touches a wall behind it, beside it, or overlaps it by a rounding error."""
    gap = rng.choice([0.0, 1e-12, -1e-12, 1e-9, 1e-6, 1e-3])
    pose = np.array([*rng.uniform(3, 7, 2), rng.choice([0.0, 0.5 * np.pi, rng.uniform(-3, 3)])])
    outline = transform(pose, world.robot.vertices)
    angle = rng.choice([0.0, 0.5 * np.pi, np.pi, pose[2], pose[2] + 0.5 * np.pi])
    normal = np.array([np.cos(angle), np.sin(angle)])
    along = np.array([-normal[1], normal[0]])
    at = ((outline @ normal).max() + gap) * normal
    at = at + (pose[:2] @ along) * along
    wall = np.array([at - 2 * along, at + 0.3 * normal - 2 * along, at + 0.3 * normal + 2 * along])
    return replace(world, robot_pose=pose, static=_static([np.vstack([wall, at + 2 * along])]))


def _goal_in_wall(rng: Rng, world: World) -> World:
    """A goal within a column, partly covered by it, or outside the bounds."""
    center = rng.uniform(1, 9, 2)
    column = SQUARE * rng.uniform(0.2, 2.0) + center + rng.uniform(-0.5, 0.5, 2)
    goal = GoalDisc(center + rng.choice([0.0, 20.0], p=[0.9, 0.1]), rng.choice([1e-6, 0.3, 0.7]))
    return replace(world, static=_static([column]), goal=goal)


def _goal_at_robot(rng: Rng, world: World) -> World:
    """A robot that is in its goal, on its rim, or about to enter."""
    away = rng.choice([0.0, 1.0, 1.0 + 1e-9, 1.0 - 1e-9, 1.001]) * 0.5
    x, y = world.robot_pose[:2]
    return replace(world, goal=GoalDisc([x + away, y], 0.5))


def _empty(rng: Rng, world: World) -> World:
    """Nothing at all but bounds."""
    return replace(world, static=_static([]), movables=Movables.empty())


def _crowd(rng: Rng, world: World) -> World:
    """Two hundred boxes in a heap."""
    return _posts(rng, replace(world, movables=_boxes(rng, 200)))


KINDS: tuple[Callable[[Rng, World], World], ...] = (
    *(_posts, _posts, _posts, _rooms, _rooms, _degenerate, _contact),
    *(_goal_in_wall, _goal_at_robot, _empty),
)


def random_world(seed: int, planner: str = "") -> World:
    """Ten metres of something; of open water with a goal line where the planner needs that."""
    rng = np.random.default_rng(seed)
    hull = rng.choice(list(HULLS))
    robot = RobotModel.from_outline(
        HULLS[hull] * rng.uniform(0.3, 1.0),
        mass=10 ** rng.uniform(-2, 2),
        drive=str(rng.choice(["constant_speed", "differential"])),
        max_speed=0.15,
        max_turn_rate=10 ** rng.uniform(-1.5, 0.5),
    )
    if planner == "namo":  # elsewhere it drives as its navigator
        robot = replace(robot, drive="differential", min_speed=-robot.max_speed)
    boxes = _boxes(rng, int(rng.integers(0, 10)))
    goal: GoalDisc | GoalLine = GoalLine([5.0, 8.5], [0.0, 1.0])
    if rng.random() < 0.7:
        goal = GoalDisc(rng.uniform(0, SIDE, 2), float(rng.uniform(0.05, 1.5)))
    pose = np.array([*rng.uniform(0, SIDE, 2), rng.uniform(-3, 3)])
    world = World(robot, pose, _static([]), boxes, goal)
    kind = _crowd if rng.random() < 0.01 else KINDS[seed % len(KINDS)]
    world = kind(rng, world)
    if planner not in OPEN_WATER:
        return world
    if isinstance(world.goal, GoalDisc):
        angle = rng.choice([0.0, 0.5 * np.pi, np.pi, rng.uniform(-3, 3)])
        world = replace(world, goal=GoalLine(world.goal.center, [np.cos(angle), np.sin(angle)]))
    return replace(world, static=_static([]))


def driven_world(seed: int, planner: str = "") -> World:
    """A random world for every drive and goal, with robots and objects that are not convex."""
    rng = np.random.default_rng([seed, 7])
    world = random_world(seed, planner)
    if planner == "namo" or planner in OPEN_WATER or planner.startswith("ship"):
        return replace(world, movables=_shapes(rng, int(rng.integers(0, 8))))
    limits = dict(DRIVES[seed % len(DRIVES)])
    if limits["drive"] == "car":
        limits["min_turning_radius"] = float(rng.uniform(0.3, 1.5))
    if rng.random() < 0.3:
        limits |= {"max_acceleration": 0.3, "max_turn_acceleration": float(rng.uniform(0.5, 3.0))}
    old = world.robot
    outline = ANGLE * rng.uniform(0.3, 1.0) if rng.random() < 0.2 else old.parts[0]
    robot = RobotModel.from_outline(
        outline, mass=old.mass, max_speed=0.15, max_turn_rate=old.max_turn_rate, **limits
    )
    goal = world.goal
    if isinstance(goal, GoalDisc) and rng.random() < 0.6:
        tolerance = float(rng.choice([0.02, 0.2, np.pi]))
        goal = GoalPose(goal.center, min(goal.radius, 0.3), float(rng.uniform(-3, 3)), tolerance)
    objects = _shapes(rng, int(rng.integers(0, 8)))
    return replace(world, robot=robot, goal=goal, movables=objects)


def posts(count: int, seed: int, planner: str = "") -> World:
    """A robot in one corner of a hall of posts, its goal in the other one."""
    rng = np.random.default_rng(seed)
    spots = rng.uniform(1.0, HALL - 1.0, (count, 2))
    for free in ([2.0, 2.0], [HALL - 2.0, HALL - 2.0]):
        spots = spots[np.hypot(*(spots - free).T) > 1.5]
    static = StaticMap.build([0.2 * SQUARE + spot for spot in spots], bounds=[0, 0, HALL, HALL])
    goal = GoalDisc([HALL - 2.0, HALL - 2.0], 0.5)
    world = World(turtlebot3_burger(), [2.0, 2.0, 0.5], static, Movables.empty(), goal)
    if planner != "namo":
        return world
    robot = RobotModel.from_outline(
        SQUARE, mass=2.0, drive="differential", max_speed=0.3, min_speed=-0.3, max_turn_rate=1.0
    )  # large enough for a grid of `namo`
    box = Movables.from_outlines([0.5 * SQUARE], [[3.0, 3.5, 0.0]])
    return replace(world, robot=robot, movables=box)


def similar(
    world: World, *, shift: tuple[float, float] = (0.0, 0.0), turns: int = 0, scale: float = 1.0
) -> World:
    """The same world scaled, then turned by so many quarters, then shifted [m].

    Speeds grow with lengths; rates of turn and masses stay, so that costs grow with lengths.
    """
    c, s = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][turns % 4]
    turn, off = np.array([[c, -s], [s, c]]), np.asarray(shift)

    def place(points: np.ndarray) -> np.ndarray:
        return scale * np.asarray(points) @ turn.T + off

    def place_poses(poses: np.ndarray) -> np.ndarray:
        return np.column_stack([place(poses[:, :2]), poses[:, 2] + 0.5 * np.pi * turns])

    static, robot, objects, goal = world.static, world.robot, world.movables, world.goal
    corners = place(static.bounds.reshape(2, 2))
    outlines = [
        scale * objects.vertices[first:last]
        for first, last in zip(objects.offsets[:-1], objects.offsets[1:], strict=True)
    ]
    if isinstance(goal, GoalDisc):
        goal = GoalDisc(place(goal.center), scale * goal.radius)
    else:
        assert isinstance(goal, GoalLine)
        goal = GoalLine(place(goal.point), turn @ goal.normal)
    return World(
        replace(
            robot,
            parts=tuple(scale * part for part in robot.parts),
            max_speed=scale * robot.max_speed,
            min_speed=scale * robot.min_speed,
        ),
        place_poses(world.robot_pose[None])[0],
        StaticMap.build(
            polygons=[place(part) for part in static.polygons],
            segments=place(static.segments.reshape(-1, 2)).reshape(-1, 4),
            radii=scale * static.radii,
            bounds=[*corners.min(axis=0), *corners.max(axis=0)],
        ),
        Movables.from_outlines(outlines, place_poses(objects.poses), masses=objects.masses),
        goal,
    )


def _boxes(rng: Rng, count: int) -> Movables:
    outlines = [SQUARE * 10 ** rng.uniform(-3, 0, 2) for _ in range(count)]
    poses = np.column_stack([rng.uniform(0, SIDE, (count, 2)), rng.uniform(-3, 3, count)])
    return Movables.from_outlines(outlines, poses.reshape(-1, 3))


def _shapes(rng: Rng, count: int) -> Movables:
    """Angles, crosses of two parts, and boxes; they may overlap anything."""
    poses = np.column_stack([rng.uniform(0, SIDE, (count, 2)), rng.uniform(-3, 3, count)])
    kinds = rng.integers(0, 3, count)
    sizes = rng.uniform(0.1, 1.0, count)
    shapes = [
        [[ANGLE * size], [size * part for part in CROSS], [SQUARE * size]][kind]
        for kind, size in zip(kinds, sizes, strict=True)
    ]
    objects = Movables.from_polygons(
        [[part + np.array([3 * k, 0]) for part in s] for k, s in enumerate(shapes)]
    )
    return objects.moved_to(poses.reshape(-1, 3))


def _static(posts: object, ends: object = (), radii: object = 0.05) -> StaticMap:
    lines = np.asarray(ends, dtype=float).reshape(-1, 4)
    return StaticMap.build(posts, lines, radii, bounds=[0, 0, SIDE, SIDE])  # type: ignore[arg-type]
