"""Pushes for objects beside walls and behind corners, that no simple push gets home."""

from __future__ import annotations

import math
from dataclasses import replace

from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_poses import (
    SHIFTS,
    initial_heading,
    pose_behind,
)
from pushplan.planners.rearrangement.push_simulator import PushSimulator
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import path_length

LEANS = tuple(math.radians(lean) for lean in (20, -20, 40, -40, 60, -60, 80, -80))
"""Directions against that of its path in which an object beside a wall is first pushed [rad]."""


def partial_pushes(simulator: PushSimulator, k: int, path: FloatArray) -> list[Push]:
    """Path-following pushes that end before something goes wrong, where that is farther on."""
    scene = simulator.scene
    found: list[Push] = []
    for fraction in SHIFTS:
        shift = fraction * scene.half
        start = pose_behind(scene, k, initial_heading(path, 0.5 * scene.size), shift)
        if not scene.fits(start):
            continue
        ends = simulator.simulate(start, k, path=path, shift=shift, pre_relocates=True)
        if not ends:
            continue
        for back in (0.3, 1.2):
            limit = ends[0].length - back * scene.size
            if limit <= 0.4 * scene.size:
                continue
            for push in simulator.simulate(
                start, k, path=path, shift=shift, limit=limit, pre_relocates=True
            ):
                if progress_of(simulator, k, push) > 0.3 * scene.size:
                    rest = float(scene.remaining(push.object_poses[[k]])[0])
                    found.append(replace(push, cost=push.cost + rest + 2.0 * scene.size))
    return found


def curved_pushes(simulator: PushSimulator, k: int, path: FloatArray) -> list[Push]:
    """Path-following pushes that begin in another direction than the path's, and turn into it.

    For objects beside a wall, behind which the robot does not fit.
    """
    scene = simulator.scene
    found: list[Push] = []
    towards = initial_heading(path, 0.5 * scene.size)
    limit = 1.5 * path_length(path) + 6.0 * scene.size
    for lean in LEANS:
        for fraction in SHIFTS:
            start = pose_behind(scene, k, towards + lean, fraction * scene.half)
            if not scene.fits(start):
                continue
            for gain in (0.5, 1.5):
                found += simulator.simulate(
                    start, k, path=path, shift=fraction * scene.half, limit=limit, gain=gain
                )
        if found:
            break
    return found


def progress_of(simulator: PushSimulator, k: int, push: Push) -> float:
    """By how much nearer to its goal an object gets [m]; 0 where no path leads there."""
    scene = simulator.scene
    now, then = scene.remaining_now[k], scene.remaining(push.object_poses[[k]])[0]
    return float(now - then) if math.isfinite(now) and math.isfinite(then) else 0.0
