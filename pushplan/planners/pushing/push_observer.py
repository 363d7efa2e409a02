"""`PushObserver`: where robot and box are now, and will be when a command takes effect."""

from __future__ import annotations

import math
from collections import deque
from itertools import pairwise

import numpy as np

from pushplan.planners.pushing.contact_kernels import Contact, advance
from pushplan.world import Twist
from pushplan.world.checks import FloatArray

_JUMP = 0.35  # A pose farther than this from the predicted one replaces it [L]


class PushObserver:
    """Predicts with the contact model and corrects by a fixed fraction of what is observed.

    A constant-gain observer: enough for noise that is the same at every step, and the same
    commands and poses always give the same estimate.

    Args:
        gain: fraction of the difference that is corrected; 1 takes poses as they are.
        delay: time between a command and its effect [s].
    """

    def __init__(self, gain: float, delay: float) -> None:
        self._gain, self._delay, self._time = gain, delay, -math.inf
        self._sent: deque[tuple[float, float, float]] = deque()
        self.row: FloatArray | None = None
        """(6,) state at the last observation, see `PushState.row`; None before the first."""

    def send(self, time: float, twist: Twist) -> None:
        """Remember what was sent at a time [s]."""
        self._sent.append((time, twist.linear, twist.angular))
        # what another command had followed in effect when the state was observed moves it no more
        over = max(self._time - self._delay, time - 2.0 * self._delay - 1.0)
        while len(self._sent) > 1 and self._sent[1][0] < over:
            self._sent.popleft()

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
        return self._moved(contact, self.row, self._time, self._time + self._delay)

    def _moved(self, contact: Contact, row: FloatArray, begin: float, end: float) -> FloatArray:
        """A state moved on from one time to another by what takes effect in between."""
        state, detail = row.copy(), np.empty(6)
        for (since, v, w), (until, _, _) in pairwise([*self._sent, (math.inf, 0.0, 0.0)]):
            duration = min(until + self._delay, end) - max(since + self._delay, begin)
            if duration > 1e-12:
                advance(contact, state, v, w, duration, detail)
        return state
