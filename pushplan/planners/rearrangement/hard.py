"""Pushes for objects beside walls and behind corners, that no simple push gets home."""

from __future__ import annotations

import math
from dataclasses import replace

from pushplan.planners.rearrangement.places import (
    SHIFTS,
    behind,
    direction_of,
    length_of,
)
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.runner import Runner
from pushplan.world.checks import FloatArray

LEANS = tuple(math.radians(lean) for lean in (20, -20, 40, -40, 60, -60, 80, -80))
"""Directions against that of its way in which an object beside a wall is first pushed [rad]."""


def partial_pushes(runner: Runner, k: int, path: FloatArray) -> list[Push]:
    """Guided pushes that end before something goes wrong, where that is farther on."""
    scene = runner.scene
    found: list[Push] = []
    for share in SHIFTS:
        shift = share * scene.half
        start = behind(scene, k, direction_of(path, 0.5 * scene.size), shift)
        if not scene.fits(start):
            continue
        ends = runner.run(start, k, path=path, shift=shift, frees=True)
        if not ends:
            continue
        for back in (0.3, 1.2):
            limit = ends[0].length - back * scene.size
            if limit <= 0.4 * scene.size:
                continue
            for push in runner.run(start, k, path=path, shift=shift, limit=limit, frees=True):
                if gain_of(runner, k, push) > 0.3 * scene.size:
                    rest = float(scene.remaining(push.object_poses[[k]])[0])
                    found.append(replace(push, price=push.price + rest + 2.0 * scene.size))
    return found


def curved_pushes(runner: Runner, k: int, path: FloatArray) -> list[Push]:
    """Guided pushes that begin in another direction than that of the way, and turn into it.

    For objects beside a wall, behind which the robot does not fit.
    """
    scene = runner.scene
    found: list[Push] = []
    towards = direction_of(path, 0.5 * scene.size)
    limit = 1.5 * length_of(path) + 6.0 * scene.size
    for lean in LEANS:
        for share in SHIFTS:
            start = behind(scene, k, towards + lean, share * scene.half)
            if not scene.fits(start):
                continue
            for gain in (0.5, 1.5):
                found += runner.run(
                    start, k, path=path, shift=share * scene.half, limit=limit, gain=gain
                )
        if found:
            break
    return found


def gain_of(runner: Runner, k: int, push: Push) -> float:
    """By how much nearer to its goal an object gets [m]; 0 where no way leads there."""
    scene = runner.scene
    now, then = scene.remaining_now[k], scene.remaining(push.object_poses[[k]])[0]
    return float(now - then) if math.isfinite(now) and math.isfinite(then) else 0.0
