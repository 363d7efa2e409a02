"""Compiled motion along short arcs, alone and with the objects in the way."""

from __future__ import annotations

import numpy as np

from pushplan.compiled import copy_into, kernel
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


@kernel(allocates=True)
def sweep_arcs(
    start: FloatArray,  # (3,) of the robot
    poses: FloatArray,  # (K, 3) of the objects
    arcs: FloatArray,  # (A, 2) distance [m], negative backward, and turn [rad] of one step of each
    count: int,
    bodies: Bodies,
    settings: Settings,
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Robot (A, count + 1, 3) and object poses along each arc, and how many are reached."""
    scratch = make_scratch(bodies)
    lengths = np.zeros(poses.shape[0])
    tracks = np.empty((arcs.shape[0], count + 1, 3))
    out = np.empty((arcs.shape[0], count + 1, poses.shape[0], 3))
    reached = np.empty(arcs.shape[0], dtype=np.int64)
    for a in range(arcs.shape[0]):
        reached[a] = 1
        copy_into(tracks[a, 0], start)
        copy_into(out[a, 0], poses)
        for n in range(1, count + 1):
            here, there, after = tracks[a, n - 1], tracks[a, n], out[a, n]
            arc_step(here, arcs[a, 0], arcs[a, 1], there)
            copy_into(after, out[a, n - 1])
            if not push_to(here, there, after, lengths, bodies, settings, scratch):
                break
            reached[a] = n + 1
    return tracks, out, reached
