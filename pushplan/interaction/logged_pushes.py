"""`find_pushes`: the pushes in a recorded episode or a robot's log."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pushplan.interaction.identification import ObservedPush
from pushplan.world import Episode, InvalidInputError
from pushplan.world.checks import IntArray, expect

_MOVING = 1e-3  # motion between two records that is no noise, in radii of the object
_NOISE = 3.0  # motion that is none, over that of the object while the robot is out of reach
_LEAST_PUSH = 0.05  # motion of the object in a push, in its radii: less says nothing
_LONGEST_PUSH = 1.0  # drive of the robot after which a push is cut, in radii of the object
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
    objects_there = expect("episode", episode, Episode).world.movables
    ids = objects_there.ids.tolist()
    for one in objects or ():
        if one not in ids:
            known = ", ".join(map(str, ids)) or "none"
            raise InvalidInputError(f"the log holds no object {one}, its objects: {known}")
    radii = objects_there.radii
    turns = np.diff(np.unwrap(episode.object_poses[..., 2], axis=0), axis=0)
    steps = np.linalg.norm(np.diff(episode.object_poses[..., :2], axis=0), axis=-1)
    steps += radii * np.abs(turns)
    gaps = np.linalg.norm((episode.object_poses - episode.robot_poses[:, None])[1:, :, :2], axis=-1)
    far = gaps > _REACH * (radii + episode.world.robot.circumscribed_radius)
    noise = np.zeros(len(ids))
    for k in np.flatnonzero(far.any(axis=0)).tolist():
        noise[k] = np.quantile(steps[far[:, k], k], 0.8)
    moving = ~far & (steps > np.maximum(_MOVING * radii, _NOISE * noise))
    alone = moving.sum(axis=1) == 1
    found: list[ObservedPush] = []
    for k, one in enumerate(ids):
        if (objects is None or one in objects) and not objects_there.wheeled[k]:
            pushed = np.flatnonzero(moving[:, k] & alone)
            for run in np.split(pushed, np.flatnonzero(np.diff(pushed) > _PAUSE + 1) + 1):
                found += _cut(episode, k, run)
    if not found:
        raise InvalidInputError(
            "the log holds no push: no object without wheels was moved by the robot alone, by more "
            f"than {_LEAST_PUSH:g} of its radius"
        )
    return found


def _cut(episode: Episode, k: int, steps: IntArray) -> Iterator[ObservedPush]:
    """Pushes of object k within some steps from a record to the next, each short enough."""
    if not len(steps):
        return
    world = episode.world
    radius = float(world.movables.radii[k])
    robot = episode.robot_poses[steps[0] : steps[-1] + 2]
    objects = episode.object_poses[steps[0] : steps[-1] + 2, k]
    driven = np.append(0.0, np.linalg.norm(np.diff(robot[:, :2], axis=0), axis=1).cumsum())
    pieces = max(1, round(float(driven[-1]) / (_LONGEST_PUSH * radius)))
    cuts = np.searchsorted(driven, np.linspace(0.0, driven[-1], pieces + 1))
    for first, last in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True):
        move = objects[last] - objects[first]
        moved = float(np.hypot(move[0], move[1])) + radius * abs(float(move[2]))
        if moved > _LEAST_PUSH * radius:
            yield ObservedPush(
                world.robot,
                world.movables.outline(k),
                robot[first : last + 1],
                objects[first],
                objects[last],
                world.static,
                world.movables.select([k]),
            )
