"""The newest world, brought forward to now (`StateEstimator`) and completed (`ObjectMemory`)."""

from __future__ import annotations

import itertools
import math
from bisect import bisect_right
from collections import deque
from dataclasses import replace

import numpy as np

from pushplan.control.stopping import add_arc
from pushplan.interaction.path_sweepers import default_interaction
from pushplan.world import Twist, World
from pushplan.world.checks import FloatArray

_REACH = 1.1  # what is farther from the robot's path than this many radii is not moved


class StateEstimator:
    """Predicts where robot and objects are, and corrects that by what is seen.

    The robot drives what it was commanded, after the delay; objects in its way move as the
    interaction model predicts. Of the difference between prediction and observation the part
    ``gain`` is taken over (a filter of fixed gain, which smooths noise and lags behind nothing
    that was commanded).

    Args:
        delay: time between a command and its effect [s].
        gain: 1 trusts each observation as it is.
        horizon: for how long a snapshot is brought forward at most [s]; later the robot and the
            objects are where they were expected then.
    """

    def __init__(self, delay: float, gain: float, horizon: float) -> None:
        self._delay = delay
        self._gain = gain
        self._horizon = delay + horizon
        self._sent: deque[tuple[float, Twist]] = deque()
        self._world: World | None = None
        self._ahead: World | None = None
        """The newest snapshot, as far as it has been brought forward."""

    def reset(self) -> None:
        """Forget everything."""
        self._sent.clear()
        self._world = self._ahead = None

    def sent(self, time: float, twist: Twist) -> None:
        """A command was sent at a time [s]."""
        self._sent.append((time + self._delay, twist))
        self._drop_before(time - self._horizon)

    def observe(self, world: World) -> World:
        """Take a snapshot, later than the one before; returns what is believed of it."""
        if self._gain < 1.0 and self._world is not None:
            world = self._blend(self._advanced(self._world, world.time), world)
        self._world = self._ahead = world
        self._drop_before(world.time)
        return world

    def _drop_before(self, time: float) -> None:
        """Forget the commands that were over by then [s]."""
        while len(self._sent) > 1 and self._sent[1][0] <= time:
            self._sent.popleft()

    def at(self, time: float) -> World:
        """The world at a time [s]; the newest snapshot with that time where it is not earlier.

        Costs what has passed since the last call or snapshot; times must not go back in between.
        """
        assert self._world is not None and self._ahead is not None
        end = min(time, self._world.time + self._horizon)
        if end > self._ahead.time:
            self._ahead = self._advanced(self._ahead, end)
        if self._ahead.time == time:
            return self._ahead
        return self._ahead.moved(time=time)

    def _advanced(self, world: World, time: float) -> World:
        if time <= world.time:
            return world
        path = self._path(world, time)
        if len(path) == 1:
            return world.moved(time=time)
        twist = self._driven(time)
        heading = float(path[-1, 2])
        vx = twist.linear * math.cos(heading)
        vy = twist.linear * math.sin(heading)
        return world.moved(
            robot_pose=path[-1],
            robot_twist=[vx, vy, twist.angular],
            movable_poses=_pushed(world, path),
            time=time,
        )

    def _path(self, world: World, time: float) -> FloatArray:
        """(N, 3) poses of the robot from a world to a time, by what was commanded."""
        size = world.robot.circumscribed_radius
        times = [at for at, _ in self._sent if world.time < at < time]
        edges = [world.time, *times, time]
        poses = [np.array(world.robot_pose)]
        for begin, end in itertools.pairwise(edges):
            twist = self._driven(0.5 * (begin + end))
            length = twist.linear * (end - begin)
            turn = twist.angular * (end - begin)
            add_arc(poses, length, turn, size)
        return np.array(poses)

    def _driven(self, time: float) -> Twist:
        """Return the command in effect at a time [s]; a standstill before the first command."""
        before = bisect_right(self._sent, time, key=lambda sent: sent[0])
        return self._sent[before - 1][1] if before else Twist(0.0, 0.0)

    def _blend(self, predicted: World, seen: World) -> World:
        """Between what was predicted and what is seen."""
        old = predicted.movables
        new = seen.movables
        poses = np.array(new.poses)
        _, here, there = np.intersect1d(new.ids, old.ids, return_indices=True)
        poses[here] = self._between(old.poses[there], new.poses[here])
        pose = self._between(predicted.robot_pose, seen.robot_pose)
        return replace(seen, robot_pose=pose, movables=new.moved_to(poses, new.twists))

    def _between(self, predicted: FloatArray, seen: FloatArray) -> FloatArray:
        away = seen - predicted
        away[..., 2] = np.remainder(away[..., 2] + math.pi, 2.0 * math.pi) - math.pi
        return predicted + self._gain * away


def _pushed(world: World, path: FloatArray) -> FloatArray | None:
    """(K, 3) where the objects are after the robot has driven a path; None if none was near it."""
    movables = world.movables
    if not len(movables):
        return None
    low = path[:, :2].min(axis=0)
    high = path[:, :2].max(axis=0)
    reach = _REACH * world.robot.circumscribed_radius + movables.radii[:, None]
    places = movables.poses[:, :2]
    near = ((places > low - reach) & (places < high + reach)).all(axis=1)
    if not near.any():
        return None
    solid = world.with_fixed_as_static()
    poses = np.array(movables.poses)
    poses[~movables.fixed] = default_interaction(solid).sweep(solid, path).object_poses[-1]
    return poses


class ObjectMemory:
    """Adds to a snapshot the objects that it lacks and that were seen not long ago.

    They are where they were predicted to be. One that has come to where the goal wants it is not
    missed.

    Args:
        keep: for how long an object is kept that is not seen [s].
    """

    def __init__(self, keep: float) -> None:
        self._keep = keep
        self._seen_at: dict[int, float] = {}

    def complete(self, seen: World, predicted: World) -> World:
        """A snapshot with what it lacks.

        Args:
            seen: the snapshot.
            predicted: what the last one, completed, has become by then.
        """
        seen_at = dict.fromkeys(seen.movables.ids.tolist(), seen.time)
        if self._keep > 0.0:
            done = np.zeros(len(predicted.movables), dtype=np.bool_)
            if predicted.goal_kind == "objects":
                done = predicted.completed
            kept = []
            for k, label in enumerate(predicted.movables.ids.tolist()):
                at = self._seen_at.get(label, predicted.time)
                if label not in seen_at and not done[k] and seen.time - at <= self._keep:
                    seen_at[label] = at
                    kept.append(k)
            if kept:
                missed = predicted.movables.select(kept)
                seen = replace(seen, movables=seen.movables.updated(missed))
        self._seen_at = seen_at
        return seen
