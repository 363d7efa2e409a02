"""Short pushes that bring an object beside a wall to where it can be pushed home from."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from pushplan.planners.rearrangement.candidates import simple_pushes
from pushplan.planners.rearrangement.goal_kernels import REMOVED
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_pose_kernels import first_free
from pushplan.planners.rearrangement.push_poses import (
    SHIFTS,
    heading_axes,
    initial_heading,
    pose_behind,
)
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.push_simulator import PushSimulator
from pushplan.planners.rearrangement.wall_pushes import progress_of
from pushplan.world.checks import FloatArray

_TURNS = (0, *(sign * turn for turn in range(15, 151, 15) for sign in (1, -1)))
"""Directions of pre-relocation pushes against the shortest path [degrees]."""

_BESIDE = (1.1, -1.1, 1.35, -1.35)
"""Places, as `SHIFTS`, from which the end of the bumper strikes an object flat at a wall."""
_ENOUGH = 20  # after so many ways to free an object no more are looked for
_NEARLY = tuple(math.radians(turn) for turn in (0, 30, -30, 60, -60))
"""Directions of a push that bring an object nearer to its goal, against the shortest path [rad]."""


def pre_relocation_pushes(simulator: PushSimulator, k: int) -> tuple[list[Push], bool]:
    """Short line pushes that bring an object to where it can be got at.

    Returns:
        Those after which it can be pushed home, or lies better than now; whether one is of the
        first kind.
    """
    scene = simulator.scene
    path = scene.object_path(k, 0.0)
    if path is None:
        return [], False
    towards, missing = (
        initial_heading(path, scene.size),
        _missing_clearance(scene, k, scene.poses[k]),
    )
    found: list[Push] = []
    frees = False
    for turn in _TURNS:
        if len(found) >= _ENOUGH:
            break
        for fraction in (*SHIFTS, *_BESIDE):
            heading = towards + math.radians(turn)
            start = pose_behind(scene, k, heading, fraction * scene.half)
            if not (scene.fits(start) and scene.is_clear(start)):
                continue
            for limit in (0.8, 1.8, 3.5):
                for push in simulator.simulate(
                    start, k, limit=limit * scene.size, pre_relocates=True
                ):
                    extra = _rest_cost(simulator, k, push, missing)
                    frees = frees or extra == 0.0
                    if math.isfinite(extra):
                        found.append(replace(push, cost=push.cost + extra))
    return found, frees


def _rest_cost(simulator: PushSimulator, k: int, push: Push, missing: float) -> float:
    """Cost of what a push leaves to be done until an object can be pushed home [m]; inf if all."""
    scene = simulator.scene
    if _is_reachable(simulator, k, push) and can_deliver(scene, k, push.object_poses, push.end):
        return 0.0
    if progress_of(simulator, k, push) > 0.3 * scene.size:
        return 3.0 * scene.size
    if math.dist(push.object_poses[k, :2], scene.poses[k, :2]) < 0.05 * scene.size:
        return math.inf
    still = _missing_clearance(scene, k, push.object_poses[k])
    return 3.0 * still + scene.size if still < missing - 0.05 * scene.size else math.inf


def _missing_clearance(scene: PushScene, k: int, pose: FloatArray) -> float:
    """How much farther from the walls an object would have to be for the robot to get behind [m].

    Behind means on the side from which it can be pushed towards its goal, or nearly so.
    """
    path = scene.object_path(k, 0.0, pose=pose)
    if path is None:
        return math.inf
    towards, least, step = initial_heading(path, scene.size), 1.5 * scene.size, 0.1 * scene.size
    for turn in _NEARLY:
        u, _ = heading_axes(towards + turn)
        for shift in SHIFTS:
            start = pose_behind(scene, k, towards + turn, shift * scene.half, pose)
            away = first_free(start, u, step, least, *scene.fit)
            if math.isfinite(away):
                least = away
    return least


def _is_reachable(simulator: PushSimulator, k: int, push: Push) -> bool:
    """Whether the robot can get behind object ``k`` after a push."""
    scene = simulator.scene
    pose = push.object_poses[k]
    if pose[0] >= 0.5 * REMOVED or push.delivers:
        return True
    moved = float(np.hypot(*(pose[:2] - scene.poses[k, :2])))
    if moved < 0.15 * scene.size:
        return False
    for clearance in (1.08 * scene.half, 0.75 * float(scene.world.movables.radii[k])):
        path = scene.object_path(k, clearance, pose=pose)
        if path is None:
            continue
        heading = initial_heading(path, 0.5 * scene.size)
        if any(
            scene.fits(pose_behind(scene, k, heading, fraction * scene.half, pose))
            for fraction in SHIFTS
        ):
            return True
    return False


def can_deliver(
    scene: PushScene,
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
    there = poses[:, 0] < 0.5 * REMOVED
    if not there[k]:
        return True
    world, index = scene.world, int(there[:k].sum())
    moved = poses[there]
    moved[index] += np.array(by) * np.array([scene.size, scene.size, 1.0])
    movables = world.movables.select(there).moved_to(moved)
    after = PushScene(replace(world, movables=movables, robot_pose=robot_pose), scene.config)
    if after.done[index]:
        return True
    simulator = PushSimulator(after)
    simulator.left = np.array([index])
    return any(
        int(movables.ids[index]) in push.delivers
        for push in simple_pushes(simulator, thorough=False)
    )
