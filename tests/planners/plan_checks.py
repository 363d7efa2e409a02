"""An independent checker of plans: Shapely, dense samples, tolerances that scale with the world."""

from __future__ import annotations

import numpy as np
import shapely

from pushplan.world import Drive, GoalLine, GoalPose, Plan, PlanStatus, World
from pushplan.world.outline import transform

FRACTIONS = np.array([0.0, 0.25, 0.5, 0.75])
GRAZE = 0.02  # side of the square that a corner may cut off between two poses [R]


def check_plan(world: World, plan: Plan, status: PlanStatus) -> None:
    """What a status says of its plan: a path from the robot's place, or one that it can drive."""
    size = world.robot.circumscribed_radius
    rounding = 1e-9 * size + 8.0 * np.spacing(np.abs(world.static.bounds).max())
    assert np.abs(plan.poses[0, :2] - world.robot_pose[:2]).max() <= rounding, "start"
    assert np.diff(plan.times).min(initial=0.0) >= 0.0, "times"
    if status is not PlanStatus.APPROXIMATE:
        x, y = plan.poses[-1, :2].tolist()
        assert world.goal.distance(x, y) <= 1e-6 * size + rounding, "goal"
    if plan.object_poses is not None:
        off = np.abs(plan.object_poses[0] - world.movables.poses).max(initial=0.0)
        assert off <= 1e-9 * max(1.0, size) + rounding, f"objects begin {off} away"
    if status is PlanStatus.SOLVED and isinstance(world.goal, GoalPose):
        off = _turn(plan.poses[-1, 2] - world.goal.heading)
        assert abs(off) <= world.goal.heading_tolerance + 1e-9, f"goal heading {off}"
    if status is not PlanStatus.PATH_ONLY:
        _check_motion(world, plan, rounding)
        _check_walls(world, plan, rounding)


def check_no_way(world: World, seed: int) -> None:
    """Check that no plan exists: no disc reaches the goal, or the robot fits at no pose in it."""
    robot, goal, static = world.robot, world.goal, world.static
    radius = 0.98 * robot.inscribed_radius
    walls = [shapely.Polygon(part).buffer(radius) for part in static.convex_parts]
    free = shapely.difference(shapely.box(*static.bounds), shapely.union_all(walls))
    here = shapely.Point(world.robot_pose[:2])
    rooms = [room for room in shapely.get_parts(free) if room.intersects(here)]
    if isinstance(goal, GoalLine):
        ahead, aside = 1e3 * goal.normal, 1e3 * np.array([-goal.normal[1], goal.normal[0]])
        ends = [goal.point - aside, goal.point + aside]
        area = shapely.Polygon([*ends, ends[1] + ahead, ends[0] + ahead])
    else:
        area = shapely.Point(goal.center).buffer(goal.radius)
    if not isinstance(goal, GoalPose) or not any(room.intersects(area) for room in rooms):
        assert not any(room.intersects(area) for room in rooms), "a disc gets to the goal"
        return
    solid = shapely.union_all([shapely.Polygon(part) for part in static.convex_parts])
    angle, away, turn = np.random.default_rng(seed).uniform(-1.0, 1.0, (3, 2000))
    shift = goal.radius * np.sqrt(np.abs(away))
    at = goal.center + shift[:, None] * np.stack([np.cos(4 * angle), np.sin(4 * angle)], axis=1)
    poses = np.column_stack([at, goal.heading + turn * goal.heading_tolerance])
    hulls = [shapely.polygons([transform(pose, part) for pose in poses]) for part in robot.parts]
    fits = ~np.any([shapely.intersects(solid, shapes) for shapes in hulls], axis=0)
    fits &= shapely.intersects_xy(shapely.box(*static.bounds), at)
    assert not fits.any(), f"the robot fits at {poses[fits][:1]}"


def _turn(angle: float) -> float:
    """The same turn within half a turn to either side [rad]."""
    return float(np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi)


def _check_motion(world: World, plan: Plan, rounding: float) -> None:
    """Starts at the robot's heading, drives as it can, and keeps every limit of the robot."""
    robot, moved, steps = world.robot, np.diff(plan.poses, axis=0), np.diff(plan.times)
    size = robot.circumscribed_radius
    off = _turn(plan.poses[0, 2] - world.robot_pose[2])
    assert abs(off) <= 1e-9, f"heading {off}"
    turns = np.abs(moved[:, 2])
    most = 1e-6 + rounding / size
    assert np.all(turns <= robot.max_turn_rate * steps * (1.0 + 1e-6) + most), "turn rate"
    lengths = np.hypot(moved[:, 0], moved[:, 1])
    back = plan.speeds[:-1] < 0.0
    speed = np.where(back, -robot.min_speed, robot.max_speed)
    assert np.all(lengths <= speed * steps * (1.0 + 1e-6) + 2.0 * rounding), "speed"
    assert np.all(np.abs(plan.turn_rates) <= robot.max_turn_rate * (1.0 + 1e-6)), "turn rates"
    assert np.all(plan.speeds <= robot.max_speed * (1.0 + 1e-6)), "speeds"
    slowest = robot.min_speed - 1e-6 * robot.max_speed
    assert np.all(plan.speeds >= slowest), "least speed"
    if robot.drive is Drive.CONSTANT_SPEED:
        assert np.all(plan.speeds >= robot.max_speed * (1.0 - 1e-6)), "constant speed"
    radius = robot.min_turning_radius
    assert np.all(turns * radius <= lengths * 1.001 + radius * most), "turning radius"
    fast = np.abs(plan.speeds) * (1.0 + 1e-6)
    assert np.all(np.abs(plan.turn_rates) * radius <= fast), "turning radius of rates"
    between = 0.5 * (steps[1:] + steps[:-1])
    for values, acceleration in (
        (plan.speeds, robot.max_acceleration),
        (plan.turn_rates, robot.max_turn_acceleration),
    ):
        changes = np.abs(np.diff(values[:-1]))
        slack = 1e-6 * np.abs(values).max() + 1e-12
        if np.isfinite(acceleration) and (robot.can_stop or values is plan.turn_rates):
            assert np.all(changes <= acceleration * between * (1.0 + 1e-6) + slack), "acceleration"
    if robot.slides:
        return
    far = lengths > 1e-3 * size + 1e3 * rounding
    ahead = np.arctan2(moved[far, 1], moved[far, 0]) - plan.poses[:-1][far, 2]
    aside = np.sin(ahead - 0.5 * moved[far, 2])
    assert np.abs(aside).max(initial=0.0) <= 0.01, f"drives aside by {aside} rad"
    against = (np.cos(ahead - 0.5 * moved[far, 2]) < 0.0) != back[far]
    assert not against.any(), "drives against the sign of its speed"


def _check_walls(world: World, plan: Plan, rounding: float) -> None:
    """The footprint touches nothing static, nor its origin the bounds, at poses and between."""
    poses, size = plan.poses, world.robot.circumscribed_radius
    low, high = world.static.bounds[:2], world.static.bounds[2:]
    assert np.all(poses[:, :2] >= low - 1e-5 * size - rounding), "bounds"
    assert np.all(poses[:, :2] <= high + 1e-5 * size + rounding), "bounds"
    if not world.static.convex_parts:
        return
    moved = np.diff(poses, axis=0, append=poses[-1:])
    dense = (poses[:, None] + FRACTIONS[:, None] * moved[:, None]).reshape(-1, 3)
    # about the middle of the plan, so that Shapely's own rounding does not count
    middle = poses[0, :2]
    walls = shapely.union_all([shapely.Polygon(p - middle) for p in world.static.convex_parts])
    shapely.prepare(walls)
    dense[:, :2] -= middle
    for part in world.robot.parts:
        hulls = shapely.polygons([transform(pose, part) for pose in dense])
        touching = np.flatnonzero(shapely.intersects(walls, hulls))
        areas = shapely.area(shapely.intersection(hulls[touching], walls))
        at_pose = touching % len(FRACTIONS) == 0
        allowed = np.where(at_pose, size * (1e-6 * size + rounding), (GRAZE * size) ** 2)
        deepest = float((areas - allowed).max(initial=0.0))
        assert deepest <= 0.0, f"overlaps a wall by {np.sqrt(areas.max()) / size:.2g} R"
