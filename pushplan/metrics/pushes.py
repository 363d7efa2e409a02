"""Pushes of an episode: how many, how far, and which were not the object's last."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import shapely

from pushplan.world import Episode
from pushplan.world.checks import BoolArray, FloatArray
from pushplan.world.outline import ConvexParts
from pushplan.world.polyline import step_lengths

_TOUCH = 0.05  # gap up to which the robot is in contact [its circumscribed radii]
_MOVES = 0.01  # speed from which an object moves [the robot's greatest speed]
_PAUSE_S = 0.5  # a push goes on if the robot is off the object for no longer than this [s]


@dataclass(frozen=True)
class Pushing:
    """Pushes of an episode.

    A push is a stretch of time in which the robot moves one object, in contact with it. It ends
    where the robot is off the object for more than 0.5 s, or moves another object meanwhile.
    Objects that are moved by other objects alone are not pushed.

    Args:
        pushes: how many there were.
        relocations: pushes after which the object was not where the goal wants it, and all
            pushes of objects of which the goal says nothing.
        pushing_distance_m: length that the robot drove during pushes [m].
        transit_distance_m: the rest of its path [m].
    """

    pushes: int
    relocations: int
    pushing_distance_m: float
    transit_distance_m: float


@lru_cache(maxsize=1)  # four metrics ask for the same episode
def pushing(episode: Episode) -> Pushing:
    """Count and measure the pushes of an episode that has a goal for the objects.

    Raises:
        InvalidInputError: if the goal is one for the robot.
    """
    wanted = episode.world.wanted
    assert episode.completed is not None  # the episode has filled it in
    driven = step_lengths(episode.robot_poses)
    busy = np.zeros(len(driven), dtype=np.bool_)
    pushed = _pushed(episode)
    pushes = 0
    relocations = 0
    for k in np.flatnonzero(pushed.any(axis=0)).tolist():
        spans = _spans(pushed, k, episode.times)
        for first, last in spans:
            busy[first : last + 1] = True
        there = [bool(episode.world_at(last + 1).completed[k]) for _, last in spans]
        there[-1] |= bool(episode.completed[k])  # the task may be less strict than the goal
        pushes += len(spans)
        relocations += len(spans) - int(wanted[k]) * sum(there)
    return Pushing(pushes, relocations, float(driven[busy].sum()), float(driven[~busy].sum()))


def _pushed(episode: Episode) -> BoolArray:
    """(T, K) whether the robot moves each object between one recorded instant and the next."""
    robot = episode.world.robot
    objects = episode.world.movables
    poses = episode.object_poses
    moved = step_lengths(poses) + np.abs(np.diff(poses[..., 2], axis=0)) * objects.radii
    pushed: BoolArray = moved > _MOVES * robot.max_speed * np.diff(episode.times)[:, None]
    gap = _TOUCH * robot.circumscribed_radius
    for k in range(len(objects)):
        at = np.flatnonzero(pushed[:, k])
        away = np.full(len(episode.times), np.inf)
        seen = np.union1d(at, at + 1)
        pushers = _shapes(episode.robot_poses[seen], robot.contact_parts)
        away[seen] = shapely.distance(pushers, _shapes(poses[seen, k], objects.parts(k)))
        pushed[at, k] = np.minimum(away[at], away[at + 1]) <= gap
    return pushed


def _shapes(poses: FloatArray, parts: ConvexParts) -> Any:
    """(N,) unions of parts in the frame of a body, at its (N, 3) poses."""
    ahead = np.array([np.cos(poses[:, 2]), np.sin(poses[:, 2])])
    turns = np.array([ahead, [-ahead[1], ahead[0]]]).transpose(2, 0, 1)  # (N, 2, 2), for rows
    each = [shapely.polygons(part @ turns + poses[:, None, :2]) for part in parts]
    return shapely.multipolygons(np.column_stack(each))


def _spans(pushed: BoolArray, k: int, times: FloatArray) -> list[tuple[int, int]]:
    """First and last step of each push of object ``k``."""
    at = np.flatnonzero(pushed[:, k])
    elsewhere = np.delete(pushed, k, axis=1).any(axis=1) & ~pushed[:, k]
    before = np.concatenate([[0], np.cumsum(elsewhere)])  # steps for other objects so far
    off = times[at[1:]] - times[at[:-1] + 1] > _PAUSE_S
    another = before[at[1:]] > before[at[:-1]]
    return [(one[0], one[-1]) for one in np.split(at, np.flatnonzero(off | another) + 1)]


def pushes(episode: Episode) -> float:
    """Number of pushes."""
    return float(pushing(episode).pushes)


def relocations(episode: Episode) -> float:
    """Number of pushes after which the object was not where it belongs."""
    return float(pushing(episode).relocations)


def pushing_distance_m(episode: Episode) -> float:
    """Length [m] that the robot drove during pushes."""
    return pushing(episode).pushing_distance_m


def transit_distance_m(episode: Episode) -> float:
    """Length [m] that the robot drove without a push."""
    return pushing(episode).transit_distance_m
