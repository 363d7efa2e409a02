"""Short pushes that bring an object beside a wall to where it can be pushed home from."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from pushplan.compiled import kernel
from pushplan.motion.collision import Footprint, Obstacles, is_free
from pushplan.planners.rearrangement.candidates import simple_pushes
from pushplan.planners.rearrangement.hard import gain_of
from pushplan.planners.rearrangement.places import SHIFTS, axes_of, behind, direction_of
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.rollout import GONE
from pushplan.planners.rearrangement.runner import Runner
from pushplan.planners.rearrangement.scene import Scene
from pushplan.world.checks import FloatArray

_TURNS = (0, *(sign * turn for turn in range(15, 151, 15) for sign in (1, -1)))
"""Directions of freeing pushes against the shortest way [degrees]."""

_BESIDE = (1.1, -1.1, 1.35, -1.35)
"""Places, as `SHIFTS`, from which the end of the bumper strikes an object flat at a wall."""
_ENOUGH = 20
"""After so many ways to free an object no more are looked for."""
_NEARLY = tuple(math.radians(turn) for turn in (0, 30, -30, 60, -60))
"""Directions of a push that bring an object nearer to its goal, against the shortest way [rad]."""


def freeing_pushes(runner: Runner, k: int) -> tuple[list[Push], bool]:
    """Short line pushes that bring an object to where it can be got at.

    Returns:
        Those after which it can be pushed home, or lies better than now; whether one is of the
        first kind.
    """
    scene = runner.scene
    way = scene.box_path(k, 0.0)
    if way is None:
        return [], False
    towards, lacking = direction_of(way, scene.size), _lacking(scene, k, scene.poses[k])
    found: list[Push] = []
    is_freed = False
    for turn in _TURNS:
        if len(found) >= _ENOUGH:
            break
        for share in (*SHIFTS, *_BESIDE):
            heading = towards + math.radians(turn)
            start = behind(scene, k, heading, share * scene.half)
            if not (scene.fits(start) and scene.is_clear(start)):
                continue
            for limit in (0.8, 1.8, 3.5):
                for push in runner.run(start, k, limit=limit * scene.size, frees=True):
                    extra = _in_vain(runner, k, push, lacking)
                    is_freed = is_freed or extra == 0.0
                    if math.isfinite(extra):
                        found.append(replace(push, price=push.price + extra))
    return found, is_freed


def _in_vain(runner: Runner, k: int, push: Push, lacking: float) -> float:
    """Price of what a push leaves to be done until an object can be pushed home [m]; inf if all."""
    scene = runner.scene
    if _is_free(runner, k, push) and goes_home(scene, k, push.object_poses, push.end):
        return 0.0
    if gain_of(runner, k, push) > 0.3 * scene.size:
        return 3.0 * scene.size
    if math.dist(push.object_poses[k, :2], scene.poses[k, :2]) < 0.05 * scene.size:
        return math.inf
    still = _lacking(scene, k, push.object_poses[k])
    return 3.0 * still + scene.size if still < lacking - 0.05 * scene.size else math.inf


def _lacking(scene: Scene, k: int, pose: FloatArray) -> float:
    """How much farther from the walls an object would have to be for the robot to get behind [m].

    Behind means on the side from which it can be pushed towards its goal, or nearly so.
    """
    way = scene.box_path(k, 0.0, pose=pose)
    if way is None:
        return math.inf
    towards, least, step = direction_of(way, scene.size), 1.5 * scene.size, 0.1 * scene.size
    for turn in _NEARLY:
        u, _ = axes_of(towards + turn)
        for shift in SHIFTS:
            start = behind(scene, k, towards + turn, shift * scene.half, pose)
            away = _first_free(start, u, step, least, *scene.fit)
            if math.isfinite(away):
                least = away
    return least


@kernel(allocates=True)
def _first_free(
    start: FloatArray,
    u: FloatArray,
    step: float,
    limit: float,
    shape: Footprint,
    among: Obstacles,
    scratch: FloatArray,
) -> float:
    """How far along ``u`` a free pose is [m]; inf if there is none nearer than the limit."""
    pose, n = start.copy(), 0
    while n * step < limit:
        pose[0], pose[1] = start[0] + n * step * u[0], start[1] + n * step * u[1]
        if is_free(pose, shape, among, scratch):
            return n * step
        n += 1
    return np.inf


def _is_free(runner: Runner, k: int, push: Push) -> bool:
    """Whether the robot can get behind object ``k`` after a push."""
    scene = runner.scene
    pose = push.object_poses[k]
    if pose[0] >= 0.5 * GONE or push.covers:
        return True
    moved = float(np.hypot(*(pose[:2] - scene.poses[k, :2])))
    if moved < 0.15 * scene.size:
        return False
    for clearance in (1.08 * scene.half, 0.75 * float(scene.world.movables.radii[k])):
        path = scene.box_path(k, clearance, pose=pose)
        if path is None:
            continue
        heading = direction_of(path, 0.5 * scene.size)
        if any(scene.fits(behind(scene, k, heading, share * scene.half, pose)) for share in SHIFTS):
            return True
    return False


def goes_home(
    scene: Scene,
    k: int,
    poses: FloatArray,
    robot_pose: FloatArray,
    by: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> bool:
    """Whether a simple push would get object ``k`` home from where something has brought it.

    Args:
        scene: the scene.
        k: index of the object.
        poses: (K, 3) where the objects would be.
        robot_pose: (3,) where the robot would be.
        by: how far the object ends from there [circumscribed radii, rad].
    """
    there = poses[:, 0] < 0.5 * GONE
    if not there[k]:
        return True
    world, index = scene.world, int(there[:k].sum())
    moved = poses[there]
    moved[index] += np.array(by) * np.array([scene.size, scene.size, 1.0])
    movables = world.movables.select(there).moved_to(moved)
    after = Scene(replace(world, movables=movables, robot_pose=robot_pose), scene.config)
    if after.done[index]:
        return True
    runner = Runner(after)
    runner.left = np.array([index])
    return any(
        int(movables.ids[index]) in push.covers for push in simple_pushes(runner, thorough=False)
    )
