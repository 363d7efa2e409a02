"""Where robot and box are now, and will be when a command takes effect."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from pushplan.control.mpc.kernels import arc
from pushplan.planners.pushing.contact_kernels import Contact, advance
from pushplan.world import Twist
from pushplan.world.checks import FloatArray

_JUMP = 0.35  # A pose farther than this from the predicted one replaces it [L]


class _CommandLog:
    """The commands that were sent, and what was driven of them after a delay.

    Args:
        delay: time between a command and its effect [s].
    """

    def __init__(self, delay: float) -> None:
        self.delay = delay
        self._sent: deque[tuple[float, float, float]] = deque()

    def send(self, time: float, twist: Twist) -> None:
        """Remember what was sent at a time [s]."""
        self._sent.append((time, twist.linear, twist.angular))
        while len(self._sent) > 1 and self._sent[1][0] < time - 2.0 * self.delay - 1.0:
            self._sent.popleft()

    def driven(self, begin: float, end: float) -> Iterator[tuple[float, float, float]]:
        """Speeds [m/s], turn rates [rad/s] and durations [s] of what takes effect in between."""
        for (since, v, w), (until, _, _) in pairwise([*self._sent, (math.inf, 0.0, 0.0)]):
            a, b = max(since + self.delay, begin), min(until + self.delay, end)
            if b - a > 1e-12:
                yield v, w, b - a


class PushObserver:
    """Predicts with the contact model and corrects by a fixed fraction of what is observed.

    A constant-gain observer: enough for noise that is the same at every step, and the same
    commands and poses always give the same estimate.

    Args:
        gain: fraction of the difference that is corrected; 1 takes poses as they are.
        delay: time between a command and its effect [s].
    """

    def __init__(self, gain: float, delay: float) -> None:
        self._gain, self._commands, self._time = gain, _CommandLog(delay), -math.inf
        self.send = self._commands.send
        self.row: FloatArray | None = None
        """(6,) state at the last observation, see `PushState.row`; None before the first."""

    def forget(self) -> None:
        """Take the next observation as it is; commands on their way are remembered."""
        self.row = None

    def observe(self, contact: Contact, seen: FloatArray, time: float, size: float) -> FloatArray:
        """Correct the state by an observation.

        Args:
            contact: bumper, face and friction.
            seen: (6,) observed state; its gap may be negative.
            time: of the observation [s].
            size: L [m].

        Returns:
            (6,) the state now.
        """
        found = seen.copy()
        if self.row is not None and self._gain < 1.0 and time > self._time:
            guess = self._moved(contact, self.row, self._time, time)
            change = seen - guess
            change[2] = math.remainder(change[2], math.tau)
            change[4] = math.remainder(change[4], math.tau)
            far = max(math.hypot(change[0], change[1]), abs(change[3]), abs(change[5])) / size
            if far < _JUMP and max(abs(change[2]), abs(change[4])) < _JUMP:
                found = guess + self._gain * change
        found[5] = max(found[5], 0.0)
        self.row, self._time = found, time
        return found

    def at_effect(self, contact: Contact) -> FloatArray:
        """(6,) the state when a command of now takes effect."""
        assert self.row is not None
        return self._moved(contact, self.row, self._time, self._time + self._commands.delay)

    def _moved(self, contact: Contact, row: FloatArray, begin: float, end: float) -> FloatArray:
        """A state moved on from one time to another."""
        state, detail = row.copy(), np.empty(6)
        for v, w, duration in self._commands.driven(begin, end):
            advance(contact, state, v, w, duration, detail)
        return state


class PoseObserver:
    """The robot's pose alone, in the manner of `PushObserver`.

    Args:
        gain: fraction of the difference that is corrected.
        delay: time between a command and its effect [s].
    """

    def __init__(self, gain: float, delay: float) -> None:
        self._gain, self._commands, self._time = gain, _CommandLog(delay), -math.inf
        self.send = self._commands.send
        self._pose: FloatArray | None = None

    def observe(self, seen: FloatArray, time: float, size: float) -> FloatArray:
        """(3,) the pose when a command of now takes effect, after an observation (3,).

        Args:
            seen: x, y [m], theta [rad].
            time: of the observation [s].
            size: a pose farther than a third of this from the predicted one replaces it [m].
        """
        found = np.array(seen)
        if self._pose is not None and self._gain < 1.0 and time > self._time:
            guess = self._moved(self._pose, self._time, time)
            change = seen - guess
            change[2] = math.remainder(change[2], math.tau)
            if math.hypot(change[0], change[1]) < _JUMP * size and abs(change[2]) < _JUMP:
                found = guess + self._gain * change
        self._pose, self._time = found, time
        return self._moved(found, time, time + self._commands.delay)

    def _moved(self, pose: FloatArray, begin: float, end: float) -> FloatArray:
        pose, motion = np.array(pose), np.empty(9)
        for v, w, duration in self._commands.driven(begin, end):
            arc(float(pose[0]), float(pose[1]), float(pose[2]), v, w, duration, motion)
            pose = motion[:3].copy()
        return pose
