"""Candidate pushes rolled out in the interaction model, and what comes of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pushplan.core import rearrangement as core
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_scene import PushScene, pose_distance
from pushplan.planners.rearrangement.rollout_cache import Rollout
from pushplan.world.checks import BoolArray, FloatArray
from pushplan.world.polyline import path_length, path_lengths

_ALIKE = 0.2
"""By how much places of an object may differ that a relocation gets it to
[circumscribed radii]."""


@dataclass(frozen=True, eq=False)
class PushAttempt:
    """A push to roll out.

    Args:
        start: (3,) pose.
        target: index of the object that follows the path, or is pushed first.
        limit: of the length [m].
        path: (M, 2) of the target object; empty for a line push [m].
        shift: see `Push`.
        wanted: indices of the objects after which to stop; ``target`` alone by default.
        gain: of the pushing controller.
        friction: coefficient between robot and objects; that of the config by default.
        relocates: only the end counts, whatever is done then.
        least: length that a push home has at least, roughly [m].
    """

    start: FloatArray
    target: int
    limit: float
    path: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    shift: float = 0.0
    wanted: Sequence[int] = ()
    gain: float = 1.5
    friction: float | None = None
    relocates: bool = False
    least: float = 0.0


def simulate(
    scene: PushScene,
    attempt: PushAttempt,
    poses: FloatArray | None = None,
    spent: FloatArray | float = 0.0,
) -> list[Push]:
    """The pushes that one start gives: one for each stage at which more objects are done.

    Args:
        scene: the scene.
        attempt: the push.
        poses: (K, 3) where the objects are when the push begins; where they are now by default.
        spent: (K,) path lengths that getting there has cost them [m].
    """
    rollout = _roll_out(scene, attempt, poses)
    follows_path = len(attempt.path) > 0
    found = []
    for s in range(len(rollout.steps))[-1 if attempt.relocates else 0 :]:
        done = scene.are_done(rollout.poses[s])
        delivered = done & ~scene.done
        homeward = delivered.any()
        if follows_path:
            homeward = delivered[attempt.target]
        if (scene.done & ~done).any() or not (attempt.relocates or homeward):
            continue  # something came back, or nothing is won
        track = rollout.track[: int(rollout.steps[s])]
        length = (len(track) - 1) * scene.controller.step
        found.append(
            _push(
                scene,
                attempt.target,
                rollout.poses[s],
                rollout.lengths[s] + spent,
                done,
                controller="path" if follows_path else "line",
                poses=track,
                length=length,
                cost=length,
                object_path=attempt.path,
                shift=attempt.shift,
                gain=attempt.gain,
                relocates=attempt.relocates,
            )
        )
    return found


def end_of(scene: PushScene, attempt: PushAttempt) -> FloatArray:
    """(3,) where a push gets its target to."""
    end: FloatArray = _roll_out(scene, attempt, None).poses[-1, attempt.target]
    return end


def _roll_out(scene: PushScene, attempt: PushAttempt, poses: FloatArray | None) -> Rollout:
    """Roll out a push, unless it is known what comes of it."""
    movables = scene.movables
    settings = scene.settings
    wanted = np.zeros(len(scene.poses), dtype=np.bool_)
    wanted[list(attempt.wanted) or [attempt.target]] = True
    if attempt.friction is not None:
        settings = settings._replace(friction=float(attempt.friction))
    key = (
        attempt.start.tobytes(),
        int(movables.ids[attempt.target]),
        attempt.path.tobytes(),
        attempt.shift,
        attempt.limit,
        attempt.gain,
        settings.friction,
        movables.ids[wanted].tobytes(),
    )
    is_now = poses is None and not (wanted & scene.done).any()
    cache = scene.cache if is_now else None
    if cache is not None:
        known = cache.find(key, movables, scene.poses)
        if known is not None:
            return known
    scene.budget.used += 1
    track, steps, ends, lengths, box = core.PushRollout(
        scene.bodies, scene.object_goal, *settings
    ).run(
        attempt.start,
        scene.poses if poses is None else poses,
        target=attempt.target if len(attempt.path) else -1,
        path=attempt.path,
        shift=attempt.shift,
        limit=attempt.limit,
        wanted=wanted,
        controller=scene.controller.with_gain(attempt.gain),
        longest=int(scene.longest / scene.controller.step) + 2,
    )
    rollout = Rollout(track, steps, ends, lengths)
    if cache is not None:
        cache.keep(key, movables, scene.poses, rollout, box)
    return rollout


def simulate_primitive(
    scene: PushScene,
    path: FloatArray,
    target: int,
    poses: FloatArray | None = None,
    spent: FloatArray | float = 0.0,
) -> list[Push]:
    """A drive that moves an object with whatever part of the robot meets it, if it can be made.

    Args:
        scene: the scene.
        path: (N, 3) poses of the robot, near each other.
        target: index of the object.
        poses: see `simulate`.
        spent: see `simulate`.
    """
    after = np.array(scene.poses if poses is None else poses)
    out = np.empty((len(path), len(after), 3))
    if scene.contacts().sweep(path, after, out) >= 0:
        return []
    done = scene.are_done(after)
    if (scene.done & ~done).any():
        return []
    length = path_length(path)
    return [
        _push(
            scene,
            target,
            after,
            path_lengths(out) + spent,
            done,
            controller="arc",
            poses=path,
            length=length,
            cost=length + scene.turn_cost * float(np.abs(np.diff(path[:, 2])).sum()),
            relocates=True,
        )
    ]


def _push(
    scene: PushScene,
    target: int,
    after: FloatArray,
    lengths: FloatArray,
    done: BoolArray,
    *,
    cost: float,
    **how: Any,
) -> Push:
    """A push that gets the objects to poses (K, 3) along path lengths (K,).

    Its cost is that of the drive and of the work, and what the objects that are left behind have
    farther or less far to go [m].
    """
    movables = scene.movables
    effort = float(scene.weights @ lengths)
    moved = np.flatnonzero((lengths > 1e-9) & ~done)
    if len(moved):
        now = scene.remaining_now[moved]
        then = scene.object_paths.remaining(after[moved])
        known = np.isfinite(now) & np.isfinite(then)
        change = np.full(len(moved), scene.longest)
        change[known] = then[known] - now[known]
        effort += float(scene.weights[moved] @ change) + float(np.maximum(change, 0.0).sum())
    return Push(
        delivers=tuple(movables.ids[done & ~scene.done].tolist()),
        target=int(movables.ids[target]),
        work=float(movables.masses @ lengths),
        cost=cost + max(effort, 0.0),
        object_poses=after,
        **how,
    )


def resimulate(
    scene: PushScene,
    push: Push,
    start: FloatArray,
    poses: FloatArray | None = None,
    spent: FloatArray | float = 0.0,
) -> list[Push]:
    """Simulate a push from another start, or after something has been moved.

    A relocation has to get its target where it was to be relocated to, or half the way on a path.

    Args:
        scene: the scene.
        push: the push.
        start: (3,) where it begins now.
        poses: see `simulate`.
        spent: see `simulate`.
    """
    ids = scene.movables.ids
    target = int(np.flatnonzero(ids == push.target)[0])
    if push.controller == "arc":
        path = np.vstack([start, push.poses[1:]])
        path[:, 2] = np.unwrap(path[:, 2])
        ends = simulate_primitive(scene, path, target, poses, spent)
    else:
        attempt = PushAttempt(
            start,
            target,
            limit=push.length if push.relocates else scene.longest,
            path=push.object_path,
            shift=push.shift,
            wanted=np.flatnonzero(np.isin(ids, push.delivers) & ~scene.done).tolist(),
            gain=push.gain,
            relocates=push.relocates,
        )
        ends = simulate(scene, attempt, poses, spent)
    if not push.relocates:
        return ends
    if len(push.object_poses) != len(scene.poses):
        return []  # planned among other objects
    size = scene.size
    there = push.object_poses[target]
    near = _ALIKE
    if push.controller != "arc":
        now = (scene.poses if poses is None else poses)[target]
        near = max(near, 0.5 * pose_distance(now, there, size))
    return [end for end in ends if pose_distance(end.object_poses[target], there, size) < near]
