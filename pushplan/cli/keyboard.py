"""Driving commands from the keys that a person presses. Knows no window and no clock."""

from __future__ import annotations

from collections.abc import Collection

from pushplan.world import Drive, RobotModel, Twist

KEYS: dict[str, str] = {
    "up": "forward",
    "w": "forward",
    "down": "back",
    "s": "back",
    "left": "left",
    "a": "left",
    "right": "right",
    "d": "right",
    "space": "stop",
    "r": "restart",
    "q": "quit",
    "escape": "quit",
}
"""Name of a key, in small letters, -> what it asks for."""
HELP = "arrows or WASD drive   space stops   r starts again   q ends"
DRIVING = frozenset({"forward", "back", "left", "right", "stop"})

GRACE = 0.06
"""A key that repeats is released and pressed again in an instant: a release counts after this
long [s]."""
COMFORTABLE_TURN = 1.0
"""A robot that can stop turns no faster than this under a key [rad/s]: keys know no half."""


class Keyboard:
    """Set of the keys that are down, tracked from the events of a window."""

    def __init__(self) -> None:
        self._down: set[str] = set()
        self._released: dict[str, float] = {}
        self._tapped: set[str] = set()
        self._asked: set[str] = set()

    def press(self, key: str) -> None:
        """A key went down; unknown ones are ignored."""
        wish = KEYS.get(key.lower())
        if wish in DRIVING:
            self._down.add(wish)
            self._tapped.add(wish)
            self._released.pop(wish, None)
        elif wish is not None:
            self._asked.add(wish)

    def release(self, key: str, now: float) -> None:
        """A key went up at a time [s]."""
        wish = KEYS.get(key.lower())
        if wish in self._down:
            self._released[wish] = now

    def held(self, now: float) -> frozenset[str]:
        """Return the commands of the keys that are down or were tapped since the last call."""
        for wish, when in list(self._released.items()):
            if now - when >= GRACE:
                self._down.discard(wish)
                del self._released[wish]
        held = frozenset(self._down | self._tapped)
        self._tapped.clear()
        return held

    @property
    def touched(self) -> bool:
        """True if a driving key is down or was tapped since `held` was last called."""
        return bool(self._down or self._tapped)

    def take(self, wish: str) -> bool:
        """Return True if ``"quit"`` or ``"restart"`` was requested since this was last called."""
        asked = wish in self._asked
        self._asked.discard(wish)
        return asked

    def clear(self) -> None:
        """Forget everything: for a new start, or when the window no longer has the keys."""
        self._down.clear()
        self._released.clear()
        self._tapped.clear()
        self._asked.clear()


def twist_of(held: Collection[str], robot: RobotModel) -> Twist:
    """The command that keys ask for.

    Opposite keys cancel each other, and stop overrides them all. A robot with one constant speed
    only steers.
    """
    turn = float("left" in held) - float("right" in held)
    if robot.drive is Drive.CONSTANT_SPEED:
        return Twist(robot.max_speed, 0.0 if "stop" in held else turn * robot.max_turn_rate)
    if "stop" in held:
        return Twist(0.0, 0.0)
    ahead = ("forward" in held) - ("back" in held)
    speed = {1: robot.max_speed, 0: 0.0, -1: robot.min_speed}[ahead]
    return Twist(speed, turn * min(robot.max_turn_rate, COMFORTABLE_TURN))
