"""Driving an environment by hand in real time, and recording the episode."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from pushplan.cli.scoreboard import Scoreboard, closing_lines
from pushplan.drawing.top_view import draw_world, film_view
from pushplan.evaluation.run.recording import Recording
from pushplan.world import Drive, Episode, Policy, RobotModel, Twist, World
from pushplan.world.checks import FloatArray, IntArray

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
FRAME_TIME = 1.0 / 30.0
"""Frames follow each other no faster than this [s]."""
TICK = 0.01
"""Interval at which keys are read while waiting [s]."""
LATE = 0.25
"""A machine that falls behind by more than this gives up the delay instead of racing [s]."""


class Display(Protocol):
    """Window in which a person watches and types."""

    keyboard: Keyboard

    @property
    def closed(self) -> bool:
        """True once the person has closed the window."""

    def show(self, frame: NDArray[np.uint8]) -> None:
        """Show a frame (H, W, 3)."""

    def update(self) -> None:
        """Take in what was typed."""


class Clock(Protocol):
    """Wall-clock time as the module `time` has it; tests put another one in its place."""

    def perf_counter(self) -> float:
        """[s]."""

    def sleep(self, seconds: float, /) -> None:
        """Wait."""


class _Left(Exception):
    """The person ended the episode."""

    def __init__(self, *, restart: bool) -> None:
        super().__init__()
        self.restart = restart


class Pilot:
    """The policy of a person with a keyboard."""

    def __init__(self, keyboard: Keyboard, now: Callable[[], float]) -> None:
        self._keyboard = keyboard
        self._now = now

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Nothing to prepare."""

    def act(self, world: World, observation: Any) -> Twist:
        """Return the velocity that the pressed keys command."""
        return twist_of(self._keyboard.held(self._now()), world.robot)


class Cockpit:
    """Shows each step as it happens, in time with the clock; an observer of `Recording.run`.

    A step is simulated at once and then shown over the time that it takes, so that the picture
    is in real time and a key acts on the next step.
    """

    def __init__(self, env: Any, display: Display, speed: float, clock: Clock) -> None:
        self._env = env
        self._display = display
        self._speed = speed
        self._clock = clock
        self._due = self._time = 0.0
        self._ids: IntArray = np.zeros(0, dtype=np.int64)
        self._trail: list[FloatArray] = []
        self._last = np.zeros((1, 3))  # poses of the robot and of the objects

    def __call__(self, step: int, world: World, policy: Policy) -> None:
        """Show what happened in this step.

        Raises:
            _Left: if the person wants to end or to start again.
        """
        if step == 0:
            self._begin(world)
            return
        trace = self._env.trace
        self._board.advance(world, trace.robot_poses, trace.object_poses)
        lines = self._board.lines()
        begin = self._due
        seconds = (world.time - self._time) / self._speed
        here = np.isin(self._ids, world.movables.ids)
        # a simulator records no more poses than the metrics need, so they are interpolated
        recorded = np.concatenate([trace.robot_poses[:, None], trace.object_poses], axis=1)
        poses = np.concatenate([self._last[None], recorded])
        poses[..., 2] = np.unwrap(poses[..., 2], axis=0)  # else a body spins where its angle wraps
        motion = make_interp_spline([self._time, *trace.times], poses, k=1)
        count = max(1, int(seconds / FRAME_TIME))
        for fraction in (np.arange(count) + 1.0) / count:
            now = motion(min(self._time + fraction * seconds * self._speed, trace.times[-1]))
            scene = world
            if fraction < 1.0:
                scene = world.moved(robot_pose=now[0], movable_poses=now[1:][here])
            self._show(scene, lines, now[:1, :2])
            self._wait(begin + fraction * seconds)
        self._trail.append(trace.robot_poses[:, :2])
        self._last = recorded[-1]
        self._time = world.time
        # frames are due by the plan, not by when the last one was shown, so delays do not add up
        self._due = max(begin + seconds, self._clock.perf_counter() - LATE)

    def farewell(self, episode: Episode) -> bool:
        """Show the final scores until the person has had enough.

        Returns:
            True to start again.
        """
        self._display.keyboard.clear()
        self._show(self._env.world, [*closing_lines(episode), "r starts again   q ends"])
        try:
            while True:
                self._look()
                self._clock.sleep(TICK)
        except _Left as left:
            return left.restart

    def _begin(self, world: World) -> None:
        """Wait for the first key: nobody is ready in the first instant."""
        self._board = Scoreboard(world)
        self._time = world.time
        self._ids = world.movables.ids
        self._last = np.concatenate([world.robot_pose[None], world.movables.poses])
        self._trail = [world.robot_pose[None, :2]]
        self._display.keyboard.clear()
        self._show(world, [HELP, "press a key to start"])
        while not self._display.keyboard.touched:
            self._look()
            self._clock.sleep(TICK)
        self._due = self._clock.perf_counter()

    def _show(self, world: World, text: list[str], *newest: FloatArray) -> None:
        trail = np.concatenate([*self._trail, *newest])
        self._display.show(draw_world(world, view=film_view(world), trail=trail, text=text))

    def _wait(self, due: float) -> None:
        self._look()
        while (left := due - self._clock.perf_counter()) > 0.0:
            self._clock.sleep(min(left, TICK))
            self._look()

    def _look(self) -> None:
        self._display.update()
        if self._display.closed or self._display.keyboard.take("quit"):
            raise _Left(restart=False)
        if self._display.keyboard.take("restart"):
            raise _Left(restart=True)


def drive(
    env: Any, scenario: Any, display: Display, *, speed: float = 1.0, clock: Clock = time
) -> Episode:
    """Let a person drive until they have had enough; the last episode is returned.

    One that the person ended has the reason ``"stopped"``.

    Args:
        env: a `pushplan.envs.PushEnv` whose actions understand a `Twist`.
        scenario: what ``env`` was made for.
        display: where the person looks and types.
        speed: simulated seconds per second.
        clock: wall-clock time.
    """
    while True:
        recording = Recording(Pilot(display.keyboard, clock.perf_counter), scenario, "teleop")
        cockpit = Cockpit(env, display, speed, clock)
        try:
            recording.run(env, cockpit)
        except _Left as left:
            if left.restart:
                continue
            return recording.episode("stopped")
        episode = recording.episode()
        if not cockpit.farewell(episode):
            return episode


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
