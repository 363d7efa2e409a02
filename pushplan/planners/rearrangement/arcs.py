"""What comes of driving along short arcs, forward, backward and on the spot."""

from __future__ import annotations

import math

import numpy as np

from pushplan.compiled import kernel
from pushplan.interaction.kernels import Bodies, Settings, advance, make_scratch, robot_held
from pushplan.planners.rearrangement.scene import Scene
from pushplan.world.checks import FloatArray, IntArray

_BENDS = (0.0, 0.7, -0.7, 1.6, -1.6)
"""Curvatures of the arcs, times the robot's circumscribed radius."""


def arcs_of(scene: Scene) -> FloatArray:
    """(A, 2) way [m], negative backward, and turn [rad] of one step of each arc."""
    step = scene.law.step
    signs: tuple[float, ...] = (1.0, -1.0)
    if scene.world.robot.min_speed == 0.0:
        signs = signs[:1]
    arcs = [(sign * step, bend * step / scene.size) for sign in signs for bend in _BENDS]
    out = np.array([*arcs, (0.0, 0.1), (0.0, -0.1)])
    out[:, 1] = np.clip(out[:, 1], -scene.law.turn, scene.law.turn)
    return out


def steps_of(scene: Scene, length: float) -> int:
    """How many steps an arc of some length [circumscribed radii] has."""
    return max(2, math.ceil(length * scene.size / scene.law.step))


def swept(
    scene: Scene, start: FloatArray, poses: FloatArray, arcs: FloatArray, count: int
) -> tuple[FloatArray, FloatArray, IntArray]:
    """`_sweep_arcs` with arrays that may be written to: one kernel for all."""
    first, before = np.array(start), np.array(poses)
    out: tuple[FloatArray, FloatArray, IntArray] = _sweep_arcs(
        first, before, arcs, count, scene.bodies, scene.settings
    )
    return out


@kernel(allocates=True)
def _sweep_arcs(
    start: FloatArray,
    poses: FloatArray,
    arcs: FloatArray,
    count: int,
    bodies: Bodies,
    settings: Settings,
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Drive from one pose along each of some arcs.

    Args:
        start: (3,) of the robot.
        poses: (K, 3) of the objects.
        arcs: (A, 2) way [m], negative backward, and turn [rad] of one step of each.
        count: steps of each arc.
        bodies, settings: of the interaction model.

    Returns:
        (A, count + 1, 3) robot poses, (A, count + 1, K, 3) object poses, and how many of them are
        reached.
    """
    scratch = make_scratch(bodies)
    lengths = np.zeros(poses.shape[0])
    tracks = np.empty((arcs.shape[0], count + 1, 3))
    out = np.empty((arcs.shape[0], count + 1, poses.shape[0], 3))
    reached = np.ones(arcs.shape[0], dtype=np.int64)
    for a in range(arcs.shape[0]):
        step, turn = arcs[a]
        tracks[a, 0], out[a, 0] = start, poses
        for n in range(1, count + 1):
            here, there, after = tracks[a, n - 1], tracks[a, n], out[a, n]
            there[0] = here[0] + step * math.cos(here[2] + 0.5 * turn)
            there[1] = here[1] + step * math.sin(here[2] + 0.5 * turn)
            there[2] = here[2] + turn
            after[:] = out[a, n - 1]
            if robot_held(there, bodies, settings, scratch) or not advance(
                here, there, after, lengths, bodies, settings, scratch
            ):
                break
            reached[a] = n + 1
    return tracks, out, reached
