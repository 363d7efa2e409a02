"""Driving by hand: keys, timing, and the recorded episode. A window only where there is one."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import make_robot

from pushplan.cli import main
from pushplan.cli.cockpit import GRACE, Keyboard, drive, twist_of
from pushplan.envs import make
from pushplan.metrics import compute
from pushplan.scenarios import Scenario
from pushplan.world import Drive, Episode, Twist

CAR = make_robot(
    drive=Drive.DIFFERENTIAL, max_speed=0.3, min_speed=-0.2, max_turn_rate=2.0, wheel_separation=0.2
)
SHIP = make_robot()


@pytest.mark.parametrize(
    ("held", "expected"),
    [
        (set(), (0.0, 0.0)),
        ({"forward"}, (0.3, 0.0)),
        ({"back"}, (-0.2, 0.0)),
        ({"forward", "back"}, (0.0, 0.0)),
        ({"forward", "left"}, (0.3, 1.0)),  # no faster than is comfortable
        ({"right"}, (0.0, -1.0)),
        ({"left", "right"}, (0.0, 0.0)),
        ({"forward", "left", "stop"}, (0.0, 0.0)),
    ],
)
def test_keys_of_a_robot_that_can_stop(held: set[str], expected: tuple[float, float]) -> None:
    assert twist_of(held, CAR) == Twist(*expected)


@pytest.mark.parametrize(
    ("held", "turn"),
    [
        (set(), 0.0),
        ({"left"}, 0.105),
        ({"right", "forward"}, -0.105),
        ({"left", "stop"}, 0.0),
        ({"back"}, 0.0),
    ],
)
def test_keys_of_a_robot_with_one_speed_only_steer(held: set[str], turn: float) -> None:
    assert twist_of(held, SHIP) == Twist(0.15, turn)


def test_a_robot_without_reverse_stays_where_it_is() -> None:
    assert twist_of({"back"}, make_robot(drive=Drive.DIFFERENTIAL)).linear == 0.0


def test_a_held_key_that_repeats_stays_held() -> None:
    keys = Keyboard()
    keys.press("Up")
    for k in range(20):  # as an X server repeats it
        keys.release("Up", 0.03 * k)
        keys.press("Up")
        assert keys.held(0.03 * k + 0.02) == {"forward"}
    keys.release("Up", 1.0)
    assert keys.held(1.0 + 0.5 * GRACE) == {"forward"}
    assert keys.held(1.0 + 2.0 * GRACE) == frozenset()


def test_a_tap_between_two_looks_is_not_lost() -> None:
    keys = Keyboard()
    keys.press("A")  # with shift or caps lock
    keys.release("A", 0.0)
    assert keys.touched
    assert keys.held(5.0) == {"left"}
    assert keys.held(5.1) == frozenset() and not keys.touched


def test_other_keys_are_nothing_and_wishes_are_taken_once() -> None:
    keys = Keyboard()
    for key in ("x", "F1", "??", ""):
        keys.press(key)
        keys.release(key, 0.0)
    assert not keys.touched and not keys.held(1.0)
    keys.press("Escape")
    assert keys.take("quit") and not keys.take("quit") and not keys.take("restart")
    keys.press("r")
    keys.press("w")
    keys.clear()
    assert not keys.take("restart") and not keys.held(1.0)


class Script:
    """A clock that only moves when somebody sleeps, and a display with things that happen."""

    def __init__(self, *events: tuple[float, str]) -> None:
        self.time = 0.0
        self.events = list(events)
        self.keyboard = Keyboard()
        self.closed = False
        self.frames: list[tuple[float, np.ndarray]] = []

    def perf_counter(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.time += seconds

    def show(self, frame: np.ndarray) -> None:
        self.frames.append((self.time, frame))

    def update(self) -> None:
        assert self.time < 1000.0, "nobody ended it"
        while self.events and self.events[0][0] <= self.time:
            _, event = self.events.pop(0)
            if event == "close":
                self.closed = True
            elif event.startswith("-"):
                self.keyboard.release(event[1:], self.time)
            else:
                self.keyboard.press(event)


def play(
    *events: tuple[float, str], task: str = "maze", speed: float = 1.0, **options: Any
) -> tuple[Episode, Script]:
    action = options.pop("action", None) or ("turn_rate" if task == "maze" else "velocity")
    scenario = Scenario(task, variations=options)
    script = Script(*events)
    env = make(scenario, observation="state", action=action)
    return drive(env, scenario, script, speed=speed, clock=script), script


def test_an_episode_is_recorded_as_driven(tmp_path: Path) -> None:
    # it begins with the first key; the ship-like robot goes on by itself, then turns left
    episode, _ = play((0.2, "Up"), (0.3, "-Up"), (1.5, "Left"), (3.5, "Escape"), boxes=3)
    assert (episode.success, episode.reason) == (False, "stopped")
    turning = (episode.actions[:, 0] > 0.9).tolist()
    assert turning == sorted(turning) and 0 < sum(turning) < len(turning)
    assert episode.about["policy"] == "teleop"
    assert compute(episode)["E_nav"] == 0.0
    episode.save(tmp_path / "episode.npz")
    assert Episode.load(tmp_path / "episode.npz") == episode
    assert main(["score", str(tmp_path / "episode.npz")]) == 0
    heading = episode.robot_poses[:, 2]
    assert heading[-1] > heading[0] + 0.05


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.5, 8.0])
def test_simulated_time_keeps_pace_with_the_clock(speed: float) -> None:
    episode, script = play((0.0, "Up"), (2.0, "q"), speed=speed, boxes=0)
    simulated = episode.times[-1] - episode.times[0]
    assert simulated == pytest.approx(2.0 * speed, abs=0.8 + 0.1)
    gaps = np.diff([when for when, _ in script.frames[1:]])
    assert 0.03 < gaps.min() and gaps.max() < 0.2  # smooth, and no more than eyes need


def test_a_slow_machine_does_not_race_afterwards() -> None:
    class Slow(Script):
        def show(self, frame: np.ndarray) -> None:
            super().show(frame)
            self.time += 0.4

    scenario = Scenario("maze", variations={"boxes": 0})
    script = Slow((0.5, "Up"), (20.0, "q"))
    episode = drive(make(scenario, observation="state"), scenario, script, speed=4.0, clock=script)
    assert len(episode.actions) >= 3
    frames = np.diff([when for when, _ in script.frames])
    assert frames.min() > 0.39


def test_starting_again_drops_what_was_driven() -> None:
    fresh, _ = play((0.0, "Up"), (1.0, "q"), boxes=2)
    again, _ = play((0.0, "Left"), (0.9, "-Left"), (1.0, "r"), (1.5, "Up"), (2.5, "q"), boxes=2)
    assert again.world == fresh.world
    assert (again.actions == 0.0).all()
    assert abs(len(again.actions) - len(fresh.actions)) <= 1


@pytest.mark.parametrize("when", [0.5, 3.0])
def test_closing_the_window_keeps_the_episode(when: float) -> None:
    episode, _ = play((1.0, "Up"), (when, "close"), boxes=2)
    assert episode.reason == "stopped"
    assert (len(episode.actions) == 0) == (when < 1.0)
    compute(episode)


@pytest.mark.slow
def test_an_episode_that_ends_by_itself_shows_its_scores_and_waits() -> None:
    episode, script = play((0.0, "Up"), (60.0, "q"), speed=20.0, boxes=0)
    assert (episode.success, episode.reason) == (False, "wall")
    assert script.time >= 60.0
    events = [(0.0, "Up"), (60.0, "r"), (61.0, "a"), (61.2, "q")]
    assert play(*events, speed=20.0, boxes=0)[0].reason == "stopped"


@pytest.mark.parametrize(
    "task", ["area_clearing", pytest.param("box_delivery", marks=pytest.mark.slow)]
)
def test_manipulation_tasks_can_be_driven(task: str) -> None:
    episode, script = play((0.0, "w"), (1.5, "d"), (2.5, "q"), task=task)
    assert episode.completed is not None and len(episode.completed) == 10
    assert episode.robot_poses[-1, 2] < episode.robot_poses[0, 2]
    values = compute(episode)
    assert values["S_manip"] == 0.0 and values["E_manip"] == 0.0
    assert len({frame.shape for _, frame in script.frames}) == 1


def without_display(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.skipif(os.name != "posix" or os.uname().sysname != "Linux", reason="needs X11")
def test_without_a_display_there_is_one_clear_error(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("tkinter")
    without_display(monkeypatch)
    assert main(["teleop", "--task", "maze"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "display" in error


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (["teleop"], 2, "SUITE"),
        (["teleop", "--task", "mazes"], 2, "did you mean 'maze'"),
        (["teleop", "--task", "maze", "--out", "/no/such/folder/e.npz"], 2, "no folder"),
        (["teleop", "--task", "area_clearing", "--action", "turn_rate"], 2, "velocity"),
        (["teleop", "--task", "maze", "--speed", "0"], 2, "positive"),
    ],
)
def test_bad_usage(
    arguments: list[str], code: int, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == code
    assert text in capsys.readouterr().err


@pytest.fixture(scope="module")
def screen() -> Iterator[str]:
    """A virtual display of our own."""
    if shutil.which("Xvfb") is None:
        pytest.skip("Xvfb is not installed")
    pytest.importorskip("tkinter")
    read, write = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "800x800x24", "-nolisten", "tcp"],
        pass_fds=[write],
        stderr=subprocess.DEVNULL,
    )
    os.close(write)
    with os.fdopen(read) as pipe:
        number = pipe.readline().strip()
    try:
        if not number:
            pytest.skip("Xvfb does not start here")
        yield f":{number}"
    finally:
        server.terminate()
        server.wait(120)


PERSON = """
import sys
from pushplan.cli import main
from pushplan.envs import window

class Typed(window.Window):
    frames = 0

    def show(self, frame):
        super().show(frame)
        Typed.frames += 1
        if Typed.frames == 1:
            root = self._root
            root.after(100, lambda: root.event_generate("<KeyPress-Left>"))
            root.after(1500, lambda: root.event_generate("<KeyRelease-Left>"))
            root.after(3000, self.close)

window.Window = Typed
code = main(sys.argv[1:])
print("frames", Typed.frames)
sys.exit(code)
"""
"""Schedules what a person does once something is to be seen."""


def at_the_screen(screen: str, *arguments: str) -> str:
    """Run a command with a window, in a process of its own: X ends it if the display goes."""
    done = subprocess.run(
        [sys.executable, "-c", PERSON, *arguments],
        env={**os.environ, "DISPLAY": screen},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_the_command_in_a_real_window(screen: str, tmp_path: Path) -> None:
    out = tmp_path / "episode.npz"
    text = at_the_screen(screen, "teleop", "--task", "maze", "--speed", "8", "--out", str(out))
    assert "I_nav" in text
    episode = Episode.load(out)
    assert episode.reason == "stopped"
    assert episode.actions.max() == 1.0 and episode.actions.min() == 0.0


@pytest.mark.slow
def test_live_in_a_real_window(screen: str) -> None:
    arguments = ["run", "--task", "maze", "--boxes", "2", "--policy", "straight", "--live"]
    text = at_the_screen(screen, *arguments)
    assert "E_nav" in text  # the run goes on after the window was closed
    assert int(text.split("frames")[1]) > 10
