"""The newest world, brought forward to now (`StateEstimator`) and completed (`ObjectMemory`)."""

from __future__ import annotations

import itertools
import math
from bisect import bisect_right
from collections import deque
from dataclasses import replace

import numpy as np

from pushplan.control.stopping import add_twist
from pushplan.interaction.path_sweepers import default_interaction
from pushplan.world import Goal, GoalPose, NavigationGoal, RobotModel, Twist, World
from pushplan.world.checks import BoolArray, FloatArray

_REACH = 1.1  # what is farther from the robot's path than this many radii is not moved
_DRIFT = 3e-4
"""Variance that a pose gains, of the robot or of what it may touch, while the robot drives its
circumscribed radius [squared circumscribed radii]: 2 % of a way of one radius."""
_RESPONSE = 0.02
"""For how long the motors may hold on to the last velocity, beyond the known delay [s]."""
_SETTLED = 1.5  # factor of the variance that is left in the end by which an estimate is ready
_SURE = 4.0  # standard deviations by which two filters differ only if the prediction is wrong


class StateEstimator:
    """Predicts where robot and objects are, and corrects that by what is seen.

    The robot drives what it was commanded, after the delay; objects in its way move as the
    interaction model predicts. Of the difference between prediction and observation the part
    ``gain`` is taken over at most. Where the noise is known, a Kalman filter takes over less: an
    object that nothing touches stays where it is, and a robot drives about as it was told. A
    filter of the fixed gain runs beside it; where the two differ by more than noise explains, the
    prediction is wrong, and the pose is corrected by the fixed gain until they agree.

    Args:
        delay: time between a command and its effect [s].
        gain: 1 trusts each observation as it is.
        noise: (3,) standard deviations of the poses that are seen [m], [m], [rad]; 0 if unknown.
        horizon: for how long a snapshot is brought forward at most [s]; later the robot and the
            objects are where they were expected then.
    """

    def __init__(self, delay: float, gain: float, noise: FloatArray, horizon: float) -> None:
        self._delay = delay
        self._gain = gain
        self._noise = noise**2
        self._horizon = delay + horizon
        self._sent: deque[tuple[float, Twist]] = deque()
        self._world: World | None = None
        self._ahead: World | None = None
        """The newest snapshot, as far as it has been brought forward."""

    def remaining_noise(self, robot: RobotModel, period: float) -> FloatArray:
        """(3,) standard deviations that the estimates keep while the robot drives at top speed.

        Args:
            robot: that drives.
            period: between two snapshots [s].
        """
        noise = self._noise
        left = self._gain / (2.0 - self._gain) * noise
        if self._gain < 1.0:
            size = robot.circumscribed_radius
            gained = _DRIFT * size * robot.max_speed * period / np.array([1.0, 1.0, size**2])
            left = np.minimum(left, 0.5 * (np.sqrt(gained**2 + 4.0 * gained * noise) - gained))
        return np.sqrt(left)

    def is_settled(self, noise: FloatArray, goal: Goal) -> bool:
        """True if no more than a noise (3,) is left in what decides whether a goal is reached."""
        ready = (self._variances <= _SETTLED * noise**2) | (self._noise == 0.0)
        if isinstance(goal, GoalPose):
            ready = ready[:1]
        elif isinstance(goal, NavigationGoal):
            ready = ready[:1, :2]
        return bool(ready.all())

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
        if self._world is None:
            self._variances = np.tile(self._noise, (1 + len(world.movables), 1))
            self._offsets = np.zeros_like(self._variances)
        elif self._gain < 1.0:
            predicted = self._advanced(self._world, world.time)
            self._variances = self._variances + self._drift(self._world, predicted)
            world = self._blend(predicted, world)
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
        speed, bearing = twist.course
        course = float(path[-1, 2]) + bearing
        vx = speed * math.cos(course)
        vy = speed * math.sin(course)
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
            add_twist(poses, twist, end - begin, size)
        return np.array(poses)

    def _driven(self, time: float) -> Twist:
        """Return the command in effect at a time [s]; a standstill before the first command."""
        before = bisect_right(self._sent, time, key=lambda sent: sent[0])
        return self._sent[before - 1][1] if before else Twist(0.0, 0.0)

    def _drift(self, world: World, predicted: World) -> FloatArray:
        """(1 + K, 3) variances that the poses of robot and objects gain by a prediction."""
        path = np.stack([world.robot_pose, predicted.robot_pose])
        size = world.robot.circumscribed_radius
        dx, dy, turn = (path[1] - path[0]).tolist()
        drift = _DRIFT * size * (math.hypot(dx, dy) + size * abs(turn))
        speeds = rates = 0.0  # squares of the changes of what is driven
        for (_, before), (at, after) in itertools.pairwise(self._sent):
            if world.time <= at < predicted.time:
                speeds += (after.linear - before.linear) ** 2
                speeds += (after.lateral - before.lateral) ** 2
                rates += (after.angular - before.angular) ** 2
        place = drift + _RESPONSE**2 * speeds
        rim = drift + (_RESPONSE * size) ** 2 * rates
        moved = (predicted.movables.poses != world.movables.poses).any(axis=1)
        touched = np.concatenate([[True], moved | _near(world, path)])
        radii = np.concatenate([[size], world.movables.radii])
        drifts = np.zeros((len(radii), 3))
        drifts[touched, :2] = place
        drifts[touched, 2] = rim / radii[touched] ** 2
        return drifts

    def _blend(self, predicted: World, seen: World) -> World:
        """Between what was predicted and what is seen."""
        new = seen.movables
        ids = predicted.movables.ids
        here, there = (
            np.concatenate([[0], 1 + rows])
            for rows in np.intersect1d(new.ids, ids, return_indices=True)[1:]
        )
        poses = np.vstack([seen.robot_pose, new.poses])
        expected = np.vstack([predicted.robot_pose, predicted.movables.poses])[there]
        away = poses[here] - expected
        away[:, 2] = np.remainder(away[:, 2] + math.pi, 2.0 * math.pi) - math.pi
        offsets = self._offsets[there]
        before = self._variances[there]
        gains, after = self._gains(offsets, before)
        # what nobody has seen is where it was predicted, to the last bit
        unseen = ~away.any(axis=1, keepdims=True)
        self._variances = np.tile(self._noise, (len(poses), 1))
        self._variances[here] = np.where(unseen, before, after)
        self._offsets = np.zeros_like(self._variances)
        self._offsets[here] = offsets + self._gain * (away - offsets) - gains * away
        poses[here] = expected + gains * away
        return replace(seen, robot_pose=poses[0], movables=new.moved_to(poses[1:], new.twists))

    def _gains(self, offsets: FloatArray, variances: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Parts (N, 3) of the differences to take over, and the variances that this leaves.

        Args:
            offsets: (N, 3) of the filter with the fixed gain from the estimate [m, m, rad].
            variances: (N, 3) of the prediction.
        """
        noise = self._noise
        gain = self._gain
        wrong = offsets**2 > _SURE**2 * gain / (2.0 - gain) * noise
        # with this variance the gain is the fixed one
        variances = np.maximum(variances, wrong * gain / (1.0 - gain) * noise)
        gains = np.full_like(variances, gain)
        np.divide(variances, variances + noise, out=gains, where=noise > 0.0)
        gains = np.minimum(gains, gain)
        return gains, (1.0 - gains) ** 2 * variances + gains**2 * noise


def _near(world: World, path: FloatArray) -> BoolArray:
    """(K,) which objects the robot may touch on a path."""
    movables = world.movables
    reach = _REACH * world.robot.circumscribed_radius + movables.radii[:, None]
    places = movables.poses[:, :2]
    low = path[:, :2].min(axis=0) - reach
    high = path[:, :2].max(axis=0) + reach
    near: BoolArray = ((places > low) & (places < high)).all(axis=1)
    return near


def _pushed(world: World, path: FloatArray) -> FloatArray | None:
    """(K, 3) where the objects are after the robot has driven a path; None if none was near it."""
    movables = world.movables
    if not _near(world, path).any():
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
