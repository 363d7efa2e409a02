"""Rollouts: what the robot, and what it pushes, does under many control sequences."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.world.checks import FloatArray, IntArray

DRIVEN = 0
REACHED = 1
BLOCKED = 2
"""Ends of a rollout: at the horizon, in the goal, or at something static or jammed."""


class Rollouts(NamedTuple):
    """S rollouts of N + 1 poses among K objects."""

    paths: FloatArray  # (S, N + 1, 3) poses of the robot; the last one again after the end
    twists: FloatArray  # (S, H, 2) speed [m/s] and turn rate [rad/s] of each step
    ends: IntArray  # (S,) index of the last pose that is reached
    outcomes: IntArray  # (S,) `DRIVEN`, `REACHED` or `BLOCKED`
    objects: FloatArray  # (S, K, 3) poses of the objects there
    works: FloatArray  # (S,) sum of mass times path length of the objects [kg m]


def make_rollouts(samples: int, steps: int, substeps: int, objects: int) -> Rollouts:
    """Memory for rollouts."""
    return Rollouts(
        np.empty((samples, steps * substeps + 1, 3)),
        np.empty((samples, steps, 2)),
        np.zeros(samples, np.int64),
        np.zeros(samples, np.int64),
        np.empty((samples, objects, 3)),
        np.zeros(samples),
    )
