"""Tests that an object can be pushed home, from where it is and from places near by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pushplan.core import rearrangement as core
from pushplan.planners.rearrangement.candidates import attempts
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.push_simulator import PushAttempt, end_of, simulate
from pushplan.planners.rearrangement.rollout_cache import RolloutCache
from pushplan.world.checks import FloatArray

_ADVANCE = 0.6
"""Least progress of an object that can be pushed at all, as a fraction of the robot's path."""
_ERRORS = np.array([[0.08, 0.08, 0.15], [-0.08, 0.08, -0.15], [0.0, -0.1, 0.0]])
"""Errors of the prediction that a push home afterwards has to tolerate: x, y [circumscribed
radii], and heading [rad]."""
MARGINS = (1.0, 2.0, 3.0)
"""Factors on them; a relocation costs a radius more for each that it does not tolerate."""


def can_be_pushed(scene: PushScene, k: int, horizon: float) -> bool:
    """Return True if some push delivers object ``k``, or advances it where the goal is far away.

    Args:
        scene: the scene.
        k: index of the object.
        horizon: how far the robot drives at most to see that [m].
    """
    target = int(scene.movables.ids[k])
    costs = scene.push_cost_to_go(k)
    now = costs.at(scene.poses[k])

    def gets_on(attempt: PushAttempt) -> bool:
        if now <= horizon:
            return any(target in push.delivers for push in simulate(scene, attempt))
        end = end_of(scene, replace(attempt, limit=min(attempt.limit, horizon)))
        return bool(end[0] >= 0.5 * core.REMOVED or costs.at(end) <= now - _ADVANCE * horizon)

    return any(
        not scene.budget.is_over
        and all(gets_on(replace(attempt, friction=one)) for one in (None, *row.frictions))
        for row in scene.config.primitives
        if row.controller != "arc" and not row.deep and not row.partners
        for attempt in attempts(scene, k, row)
    )


def failing_margins(
    scene: PushScene,
    k: int,
    poses: FloatArray,
    horizon: float,
    cache: RolloutCache | None = None,
) -> int:
    """Count the margins that a push of an object home does not tolerate.

    Args:
        scene: the scene.
        k: index of the object.
        poses: (K, 3) where the objects are to be pushed from.
        horizon: see `can_be_pushed`.
        cache: rollouts of a count that was interrupted.
    """
    units = np.array([scene.size, scene.size, 1.0])

    def delivers(error: FloatArray) -> bool:
        displaced = np.array(poses)
        if displaced[k, 0] < 0.5 * core.REMOVED:
            displaced[k] += error * units
        after = scene.with_objects_at(displaced, cache)
        return bool(after.done[k]) or can_be_pushed(after, k, horizon)

    if not delivers(np.zeros(3)):
        return len(MARGINS)
    for n, margin in enumerate(MARGINS):
        if not all(delivers(margin * error) for error in _ERRORS):
            return len(MARGINS) - n
    return 0
