"""Compiled motion along short arcs, alone and with the objects in the way."""

from __future__ import annotations

import math

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.geometry.angles import wrap_angle
from pushplan.geometry.transforms import arc_step
from pushplan.interaction.kernels import (
    Bodies,
    Scratch,
    Settings,
    advance,
    make_scratch,
    robot_held,
)
from pushplan.world.checks import FloatArray, IntArray


@kernel
def push_to(
    here: FloatArray,
    there: FloatArray,
    poses: FloatArray,
    lengths: FloatArray,
    bodies: Bodies,
    settings: Settings,
    scratch: Scratch,
) -> bool:
    """Drive a step and move the objects in the way; false if the robot jams or hits a wall."""
    if robot_held(there, bodies, settings, scratch):
        return False
    return bool(advance(here, there, poses, lengths, bodies, settings, scratch))


@kernel
def _has_moved(before: FloatArray, after: FloatArray, size: float, least: float) -> bool:
    """Return True if two poses of an object differ by at least ``least``, see `pose_distance`."""
    moved = math.sqrt((after[0] - before[0]) ** 2 + (after[1] - before[1]) ** 2) / size
    return bool(moved + 0.2 * abs(wrap_angle(after[2] - before[2])) >= least)


@kernel(allocates=True)
def sweep_arcs(
    start: FloatArray,  # (3,) of the robot
    poses: FloatArray,  # (K, 3) of the objects
    arcs: FloatArray,  # (A, 2) distance [m], negative backward, and turn [rad] of one step of each
    count: int,
    target: int,
    size: float,
    least: float,
    bodies: Bodies,
    settings: Settings,
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Robot (A, count + 1, 3) and object poses along arcs; (N, 2) where ``target`` has moved on."""
    scratch = make_scratch(bodies)
    lengths = np.zeros(poses.shape[0])
    tracks = np.empty((arcs.shape[0], count + 1, 3))
    out = np.empty((arcs.shape[0], count + 1, poses.shape[0], 3))
    marks = np.empty((arcs.shape[0] * count, 2), dtype=np.int64)
    found = 0
    for a in range(arcs.shape[0]):
        copy_into(tracks[a, 0], start)
        copy_into(out[a, 0], poses)
        last = 0
        for n in range(1, count + 1):
            here = tracks[a, n - 1]
            there = tracks[a, n]
            after = out[a, n]
            arc_step(here, arcs[a, 0], arcs[a, 1], there)
            copy_into(after, out[a, n - 1])
            if not push_to(here, there, after, lengths, bodies, settings, scratch):
                break
            if _has_moved(out[a, last, target], after[target], size, least):
                marks[found, 0] = a
                marks[found, 1] = n
                last = n
                found += 1
    return tracks, out, marks[:found]
