"""`find_pushes`: the pushes in a recorded episode or a robot's log."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pushplan.interaction.identification import ObservedPush
from pushplan.world import Episode, InvalidInputError
from pushplan.world.checks import BoolArray, FloatArray, expect

_MOVING = 1e-3  # motion between two records that is no noise, in radii of the object
_LEAST_PUSH = 0.05  # motion of the object over a push, in its radii: less says nothing
_LONGEST_PUSH = 1.0  # way of the robot after which a push is cut, in radii of the object
_PAUSE = 2  # records of an object at rest that do not end a push
_REACH = 1.1  # distance of the robot at which it may touch, over the sum of the radii


def find_pushes(episode: Episode, objects: Sequence[int] | None = None) -> list[ObservedPush]:
    """Find the intervals in which the robot alone moves one object.

    An object counts as pushed while it moves within reach of the robot and no other object moves;
    those on wheels are left out, as they roll on. Long pushes are cut, so that an early miss does
    not spoil what follows.

    Args:
        episode: what was recorded.
        objects: ids of those to look at; all if None.

    Raises:
        InvalidInputError: if there is no object of an id, or no push.
    """
    world = expect("episode", episode, Episode).world
    ids = world.movables.ids.tolist()
    wanted = ids if objects is None else list(objects)
    for one in wanted:
        if one not in ids:
            known = ", ".join(map(str, ids)) or "none"
            raise InvalidInputError(f"the log holds no object {one}, its objects: {known}")
    found = []
    moving = _moving(episode)
    alone = moving.sum(axis=1) == 1
    for one in wanted:
        k = ids.index(one)
        if world.movables.wheeled[k]:
            continue
        for first, last in _intervals(moving[:, k] & alone):
            found += _cut(episode, k, first, last)
    if not found:
        raise InvalidInputError(
            "the log holds no push: no object without wheels was moved by the robot alone, by more "
            f"than {_LEAST_PUSH:g} of its radius"
        )
    return found


def _moving(episode: Episode) -> BoolArray:
    """(T, K) True where an object moves from a record to the next."""
    radii = episode.world.movables.radii
    poses = episode.object_poses
    turns = np.abs((np.diff(poses[..., 2], axis=0) + np.pi) % (2.0 * np.pi) - np.pi)
    motions = np.linalg.norm(np.diff(poses[..., :2], axis=0), axis=-1) + turns * radii
    result: BoolArray = motions > _MOVING * radii
    return result


def _intervals(flags: BoolArray) -> Iterator[tuple[int, int]]:
    """First and last record of each stretch of steps (T,) that are flagged."""
    steps = np.flatnonzero(flags)
    if not len(steps):
        return
    breaks = np.flatnonzero(np.diff(steps) > _PAUSE + 1)
    starts = steps[np.append(0, breaks + 1)]
    ends = steps[np.append(breaks, len(steps) - 1)]
    yield from zip(starts.tolist(), (ends + 1).tolist(), strict=True)


def _cut(episode: Episode, k: int, first: int, last: int) -> Iterator[ObservedPush]:
    """Pushes of object k between two records, each short and long enough."""
    radius = float(episode.world.movables.radii[k])
    robot = episode.robot_poses
    reach = _REACH * (radius + episode.world.robot.circumscribed_radius)
    steps = np.linalg.norm(np.diff(robot[first : last + 1, :2], axis=0), axis=1)
    driven = np.append(0.0, np.cumsum(steps))
    pieces = max(1, round(float(driven[-1]) / (_LONGEST_PUSH * radius)))
    cuts = first + np.searchsorted(driven, np.linspace(0.0, driven[-1], pieces + 1))
    for begin, end in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True):
        poses: FloatArray = episode.object_poses[begin : end + 1, k]
        moved = float(np.linalg.norm(poses[-1, :2] - poses[0, :2]))
        moved += radius * abs(float(poses[-1, 2] - poses[0, 2]))
        gap = np.linalg.norm(poses[:, :2] - robot[begin : end + 1, :2], axis=1).max()
        if len(poses) >= 2 and moved > _LEAST_PUSH * radius and gap < reach:
            yield ObservedPush(
                episode.world.robot,
                episode.world.movables.outline(k),
                robot[begin : end + 1],
                poses[0],
                poses[-1],
                episode.world.static,
            )
