"""Plans on real maps: how many, how soon, and whether they touch anything.

    python -m benchmarks.accuracy.real_maps [--barn FOLDER [--heading]] [--nav2 FOLDER]
        [--pictures FOLDER]

--barn holds worlds of the BARN challenge, worlds.npz: `cylinders` (N, 3) x, y, radius [m],
`offsets` (W + 1,) rows of each world, `first` its number; and paths.npz, with reference paths
`path_I` (P, 2) in cells of the generator. With --heading the goal is a pose, to 2 cm and 3°, in
the middle of the goal's disc at a random heading, and robots plan, too, that cannot turn on the
spot. --nav2 holds maps of ROS's map server.

Times are CPU time until the first plan [ms]. Shapely checks plans without pushplan's own collision
tests: the footprint, moved along the plan, must not overlap a cylinder or a cell that is occupied
or unknown; on a path that the robot cannot drive as it stands ("path only"), its inscribed disc.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import shapely
from scipy import ndimage

from benchmarks.first_plan import timed_plan
from benchmarks.reporting import command_line, head, origin, percentiles, row, write
from pushplan.drawing import draw_world, save_image
from pushplan.errors import PushplanError
from pushplan.world import (
    Deadline,
    Drive,
    FirstSolution,
    GoalDisc,
    GoalPose,
    Movables,
    Plan,
    PlanStatus,
    RobotModel,
    StaticMap,
    World,
    jackal,
    load_nav2_map,
    racecar,
    turtlebot3_burger,
)
from pushplan.world.checks import BoolArray, FloatArray, IntArray
from pushplan.world.outline import transform
from pushplan.world.polyline import path_length
from pushplan.world.stored.nav2_map import read_nav2_grid

HEADS = ("new map: median / p95 / worst [ms]", "same map", "length / reference: median / worst")
PLANNERS = ("straight", "kinodynamic-rrt", "push-aware")

BARN_START = np.array([-2.25, 3.0, math.pi / 2.0])
BARN_GOAL = GoalDisc(np.array([-2.25, 13.0]), 1.0)
BARN_TOLERANCE = 0.02, math.radians(3.0)  # of a goal pose
BARN_BOUNDS = (-4.5, 0.0, 0.0, 14.5)
BARN_CELL_M = 0.15
BARN_FIRST_CELL = np.array([-4.425, 5.175])  # where all references keep the same clearance [m]
BARN_TURNS = 0.5  # least turning radius of the drives that do not turn on the spot [m]
OCCUPIED = 65  # least value of an occupied cell [%], as `load_nav2_map` has it
NAV2_TOLERANCE_M = 0.25  # of a goal, Nav2's default
NAV2_LEAST_WAY = 0.25  # from a start to its goal, as a fraction of the map's extent
FITS = 0.4  # fraction of the free cells that the Jackal must reach, or it is the TurtleBot

STEP_M = 0.005  # way of the farthest corner between two poses that are checked, at most
TOUCH = 1e-5  # fraction by which the checked footprint is smaller, as plans may touch
ComplexArray = np.ndarray[tuple[int], np.dtype[np.complex128]]


@dataclass(frozen=True)
class Case:
    """A world to plan in."""

    name: str
    world: World
    obstacles: shapely.STRtree  # the same as its static map, from the data
    seen: bool  # an earlier call had the same map
    reference_m: float = math.nan  # length of a known path


@dataclass(frozen=True)
class Call:
    """Outcome of a planning call."""

    case: Case
    status: PlanStatus
    seconds: float  # of CPU, infinite without a plan
    ratio: float  # length of the plan over that of the reference
    fault: str  # of the plan, empty if it is sound


def poses_between(plan: Plan, reach: float) -> tuple[ComplexArray, FloatArray]:
    """Places x + iy and headings on arcs between a plan's poses; ``reach``: of a corner [m]."""
    place = plan.poses[:, 0] + 1j * plan.poses[:, 1]
    heading = plan.poses[:, 2]
    gaps = np.diff(place)
    turns = np.mod(np.diff(heading) + np.pi, 2.0 * np.pi) - np.pi
    counts = np.ceil((np.abs(gaps) + reach * np.abs(turns)) / STEP_M).astype(int)
    k = np.repeat(np.arange(len(gaps)), counts)
    fraction = (np.arange(len(k)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[k]
    bent = np.abs(turns[k]) > 1e-9
    turn = np.where(bent, turns[k], 1.0)
    along = np.where(bent, np.expm1(1j * turn * fraction) / np.expm1(1j * turn), fraction)
    places = np.append(place[k] + gaps[k] * along, place[-1])
    return places, np.append(heading[k] + turns[k] * fraction, heading[-1])


def fault_of(case: Case, plan: Plan, drivable: bool) -> str:
    """What is wrong with a plan; empty if nothing is."""
    world = case.world
    known = 3 if drivable else 2
    if not np.allclose(plan.poses[0, :known], world.robot_pose[:known], atol=1e-9):
        return "starts elsewhere"
    goal = world.navigation_goal
    x, y, theta = plan.poses[-1].tolist()
    if goal.distance(x, y) > 1e-9:
        return "ends elsewhere"
    if isinstance(goal, GoalPose) and abs(goal.heading_error(theta)) > goal.heading_tolerance:
        return "ends at another heading"
    if not drivable:
        disc = (1.0 - TOUCH) * world.robot.inscribed_radius
        way = shapely.linestrings(plan.poses[:, :2])
        return "collides" if case.obstacles.query(way, "dwithin", disc).size else ""
    places, headings = poses_between(plan, world.robot.circumscribed_radius)
    for part in world.robot.wall_parts:
        middle = part.mean(axis=0)
        corners = (middle + (1.0 - TOUCH) * (part - middle)) @ [1.0, 1j]
        z = places[:, None] + np.exp(1j * headings)[:, None] * corners
        footprints = shapely.polygons(np.stack([z.real, z.imag], axis=-1))
        if case.obstacles.query(footprints, predicate="intersects").size:
            return "collides"
    return ""


def call(case: Case, planner: str, patience: float, pictures: Path | None) -> Call:
    """Plan until the first plan, and check it; name and draw the case if it fails."""
    spent, result = timed_plan(planner, case.world, FirstSolution() | Deadline(patience))
    plan = result.plan
    fault = "" if plan is None else fault_of(case, plan, result.status is PlanStatus.SOLVED)
    if plan is None or fault:
        print(f"{case.name}, {planner}: {fault or result.status.label}", file=sys.stderr)
        if pictures is not None:
            pictures.mkdir(parents=True, exist_ok=True)
            picture = draw_world(case.world, size_px=1000, plan=plan)
            save_image(pictures / f"{case.name}-{planner}.png", picture)
    length = math.nan if plan is None else plan.length
    return Call(case, result.status, spent, length / case.reference_m, fault)


def barn_cases(folder: Path, robot: RobotModel, seed: int | None = None) -> Iterator[Case]:
    """The worlds of a folder, with goals at a random heading where a seed is given.

    A reference is start, path and goal, up to the goal's tolerance.
    """
    goal: GoalDisc = BARN_GOAL
    rng = np.random.default_rng(seed)
    with np.load(folder / "worlds.npz") as data, np.load(folder / "paths.npz") as paths:
        cylinders = data["cylinders"]
        for i, (low, high) in enumerate(pairwise(data["offsets"]), start=int(data["first"])):
            x, y, radii = cylinders[low:high].T
            lines = np.column_stack([x, y, x, y])
            static = StaticMap.build(segments=lines, radii=radii, bounds=BARN_BOUNDS)
            cells = BARN_FIRST_CELL + BARN_CELL_M * paths[f"path_{i}"]
            points = np.vstack([BARN_START[:2], cells, BARN_GOAL.center])
            if seed is not None:
                place, turn = BARN_TOLERANCE
                goal = GoalPose(goal.center, place, rng.uniform(-np.pi, np.pi), turn)
            length = path_length(points) - goal.radius
            circles = shapely.buffer(shapely.points(x, y), radii, quad_segs=64)
            world = World(robot, BARN_START, static, Movables.empty(), goal)
            yield Case(f"barn-{i}", world, shapely.STRtree(circles), False, length)


def drives() -> Iterator[RobotModel]:
    """The Jackal with its own drive and four others, and a small car."""
    yield jackal()
    yield replace(jackal(drive=Drive.OMNIDIRECTIONAL), name="jackal, omnidirectional")
    car = jackal(drive=Drive.CAR, min_turning_radius=BARN_TURNS)
    yield replace(car, name="jackal as a car")
    yield replace(car, min_speed=-car.max_speed, name="jackal as a car that reverses")
    yield racecar()
    rate = jackal().max_speed / BARN_TURNS
    constant = jackal(
        drive=Drive.CONSTANT_SPEED, max_turn_rate=rate, max_turn_acceleration=math.inf
    )
    yield replace(constant, name="jackal at constant speed")


def largest_component(free: BoolArray, distance: float) -> IntArray:
    """Cells (N, 2) x, y of the largest component of what is ``distance`` [cells] from the rest."""
    away = ndimage.distance_transform_edt(np.pad(free, 1))[1:-1, 1:-1]
    labels, _ = ndimage.label(away - math.sqrt(0.5) > distance)
    largest = np.bincount(labels[labels > 0], minlength=2)[1:].argmax() + 1
    return np.argwhere(labels == largest)[:, ::-1]


def nav2_cases(path: Path, pairs: int, seed: int) -> Iterator[Case]:
    """Worlds with random starts and goals: each second one has the map of the one before."""
    grid, side, corner = read_nav2_grid(path)
    free = (grid >= 0) & (grid < OCCUPIED)
    for robot in (jackal(), turtlebot3_burger()):
        cells = largest_component(free, robot.circumscribed_radius / side)
        if len(cells) > FITS * free.sum():
            break
    if not len(cells):
        raise PushplanError(f"{path}: no robot fits")
    places = transform(corner, np.multiply(side, cells + 0.5))
    rim = ~free & ndimage.binary_dilation(free, np.ones((3, 3), np.bool_))  # enough to find entries
    squares = np.argwhere(rim)[:, None, ::-1] + [[0, 0], [1, 0], [1, 1], [0, 1]]
    outlines = transform(corner, side * squares.reshape(-1, 2)).reshape(-1, 4, 2)
    obstacles = shapely.STRtree(shapely.polygons(outlines))
    rng = np.random.default_rng(seed)
    least = NAV2_LEAST_WAY * float(np.ptp(places, axis=0).max())
    for k in range(2 * pairs):
        start, end = places[rng.integers(len(places), size=2)]
        while math.dist(start, end) < least:
            start, end = places[rng.integers(len(places), size=2)]
        if k % 2 == 0:
            static = load_nav2_map(path)
        pose = np.array([*start, rng.uniform(-np.pi, np.pi)])
        world = World(robot, pose, static, Movables.empty(), GoalDisc(end, NAV2_TOLERANCE_M))
        yield Case(f"{path.stem}-{k}", world, obstacles, k % 2 == 1)


def times(calls: Iterable[Call], seen: bool) -> str:
    """Median, 95th percentile and worst of the times on maps that were seen before, or not [ms]."""
    ms = [1e3 * c.seconds for c in calls if c.case.seen == seen]
    if not ms:
        return ""
    return " / ".join(f"{t:.0f}" for t in np.percentile(ms, [50, 95, 100], method="higher"))


def rows(name: str, cases: Callable[[], Iterable[Case]], planning: Callable[..., Call]) -> None:
    """Print a row for each planner; the cases are made anew, so that nothing is cached for them."""
    for planner in PLANNERS:
        calls = [planning(case, planner) for case in cases()]
        ratios = [c.ratio for c in calls if math.isfinite(c.ratio)]
        row(
            f"{name}, {calls[0].case.world.robot.name}",
            f"`{planner}`",
            f"{sum(c.status is PlanStatus.SOLVED for c in calls)} of {len(calls)}",
            sum(c.status is PlanStatus.PATH_ONLY for c in calls),
            sum(bool(c.fault) for c in calls),
            times(calls, False),
            times(calls, True),
            " / ".join(percentiles(ratios, (50, 100), 2)) if ratios else "",
        )


def main() -> None:
    parser = command_line(__doc__, seed=0)
    parser.add_argument("--barn", type=Path, metavar="FOLDER", help="of worlds.npz and paths.npz")
    parser.add_argument("--heading", action="store_true", help="goals of BARN are poses")
    parser.add_argument("--nav2", type=Path, metavar="FOLDER", help="of .yaml files of maps")
    parser.add_argument("--patience", type=float, default=60.0, help="deadline [s]; default 60")
    parser.add_argument("--pairs", type=int, default=10, help="twice on each map; default 10")
    parser.add_argument("--pictures", type=Path, metavar="FOLDER", help="of calls that failed")
    options = parser.parse_args()
    planning = partial(call, patience=options.patience, pictures=options.pictures)
    write(origin(), "")
    head("map", "planner", "solved", "path only", "wrong", *HEADS)
    if options.barn and options.heading:
        for robot in drives():
            rows("BARN, poses", partial(barn_cases, options.barn, robot, options.seed), planning)
    elif options.barn:
        rows("BARN", partial(barn_cases, options.barn, jackal()), planning)
    for path in sorted(options.nav2.glob("*.yaml")) if options.nav2 else ():
        began = time.thread_time()
        try:
            count = len(load_nav2_map(path).polygons)
            name = f"{path.stem}: {count:,} polygons, read in {time.thread_time() - began:.2f} s"
            rows(name, partial(nav2_cases, path, options.pairs, options.seed), planning)
        except PushplanError as error:
            row(path.stem, f"refused: {error}", *[""] * 6)


if __name__ == "__main__":
    main()
