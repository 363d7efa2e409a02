"""`Motors`: what is sent to a robot last is zero velocity, however the program ends."""

from __future__ import annotations

import atexit
import contextlib
import math
import signal
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType
from typing import Any

from pushplan.control.limits import ramp_twist
from pushplan.world import RobotModel, Twist
from pushplan.world.checks import expect, number

_LONGEST = 5.0  # for how long a robot is braked before it is told to stand at once [s]
_SIGNALS = ("SIGTERM", "SIGHUP")  # which end a process without a word


class Motors:
    """Passes velocities on, and brakes the robot where none comes any more.

    A thread of its own brakes while the loop is silent, for instance because it hangs. Leaving the
    ``with`` block by any exception, a `SIGTERM` or `SIGHUP` within it, and the end of the
    interpreter brake the robot too, and end the sending. A process that is killed (`SIGKILL`, a
    crash of native code) sends nothing more: the driver of the motors needs a timeout of its own.

    Braking keeps to the accelerations of the robot, for five seconds at most. A robot that cannot
    stand is told zero at once, and so is a robot whose braking is interrupted.

    Args:
        send: takes each velocity; called by the loop, or by the thread, but never by both at once.
        robot: its accelerations.
        period: between two velocities while braking [s].
        timeout: for how long the loop may be silent while the robot moves [s].

    Attributes:
        twist: sent last.

    Raises:
        InvalidInputError: if a time is not positive.

    Example:
        >>> with Runner("push-aware", period=0.05) as runner:  # doctest: +SKIP
        ...     with Motors(send, world.robot, period=0.05) as motors:
        ...         motors.drive(runner.command(now()).twist)
    """

    def __init__(
        self,
        send: Callable[[Twist], Any],
        robot: RobotModel,
        *,
        period: float,
        timeout: float = 0.5,
    ) -> None:
        self._send = send
        self._robot = expect("robot", robot, RobotModel)
        self._period = number("period", period, low=0.0, open_low=True)
        self._timeout = number("timeout", timeout, low=0.0, open_low=True)
        self.twist = Twist(0.0, 0.0)
        self._told_at = time.monotonic()
        self._lock = threading.Lock()
        self._braked = False
        self._closed = threading.Event()
        self._signals: dict[int, Any] = {}
        atexit.register(self.close)
        threading.Thread(target=self._watch, name="pushplan motors", daemon=True).start()

    def __enter__(self) -> Motors:
        if threading.current_thread() is threading.main_thread():
            for number_ in (getattr(signal, name) for name in _SIGNALS if hasattr(signal, name)):
                if signal.getsignal(number_) is signal.SIG_DFL:
                    self._signals[number_] = signal.signal(number_, _exit)
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self.close()
        finally:
            for number_, handler in self._signals.items():
                signal.signal(number_, handler)

    def drive(self, twist: Twist) -> None:
        """Send a velocity. After a silence the robot gets to it within its accelerations.

        Nothing is sent after `close`.
        """
        with self._lock:
            if self._closed.is_set():
                return
            self._told_at = time.monotonic()
            if self._braked:
                near = self._toward(twist)
                self._braked = near != twist
                twist = near
            self._put(twist)

    def brake(self) -> None:
        """Brake until the next velocity, as if the loop were silent."""
        with self._lock:
            self._told_at = -math.inf

    def close(self) -> None:
        """Brake the robot to a stand, and send nothing more."""
        atexit.unregister(self.close)
        with self._lock:
            if self._closed.is_set():
                return
            self._closed.set()
            end = time.monotonic() + _LONGEST
            try:
                while self.twist != Twist(0.0, 0.0) and time.monotonic() < end:
                    self._put(self._toward(Twist(0.0, 0.0)))
                    if self.twist != Twist(0.0, 0.0):
                        time.sleep(self._period)
            finally:  # even if another signal interrupts it
                self._put(Twist(0.0, 0.0))

    def _toward(self, wanted: Twist) -> Twist:
        if not self._robot.can_stop:
            return wanted
        return ramp_twist(
            self._robot, self.twist, wanted.linear, wanted.angular, self._period, wanted.lateral
        )

    def _put(self, twist: Twist) -> None:
        self.twist = twist
        self._send(twist)

    def _watch(self) -> None:
        """Brake in place of a loop that is silent."""
        while not self._closed.wait(self._period):
            with self._lock:
                silent = time.monotonic() - self._told_at > self._timeout
                if not silent or self._closed.is_set() or self.twist == Twist(0.0, 0.0):
                    continue
                self._braked = True
                with contextlib.suppress(Exception):  # the loop hears of it when it sends again
                    self._put(self._toward(Twist(0.0, 0.0)))


def _exit(number_: int, frame: FrameType | None) -> None:
    """Leave all ``with`` blocks."""
    sys.exit(128 + number_)
