"""`Runner` where clocks step, of the commands or of perception, ahead or back, or say no time."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from test_runner import PERIOD, STILL, Straight, drive, later, maze

from pushplan.control import ImmediateExecutor
from pushplan.runtime import CommandStatus, Runner
from pushplan.runtime.interpreter_turns import take_short_turns, take_usual_turns
from pushplan.world import World


@pytest.fixture(scope="module", autouse=True)
def short_turns():
    """Else each runner that starts alone goes through all objects of the process."""
    take_short_turns()
    yield
    take_usual_turns()


class Loop:
    """A robot and its runner, with a clock for commands and one for perception."""

    def __init__(self, runner: Runner) -> None:
        self.runner, self.world = runner, maze()
        self.commands_ahead = self.worlds_ahead = 0.0
        self.command = runner.start(self.world)
        self.world = later(self.world, STILL)

    def seen(self) -> World:
        return self.world.moved(time=self.world.time + self.worlds_ahead)

    def step(self, *, sees: bool = True, now: float | None = None):
        """One period of the loop; the acceleration stays within its limits whatever happens."""
        if sees:
            self.runner.update(self.seen())
        before = self.command.twist.linear
        if now is None:
            now = self.world.time + self.commands_ahead
        gap = now - self.command.time
        held = gap if 0.0 < gap <= self.runner.max_age else PERIOD
        self.command = self.runner.command(now)
        assert abs(self.command.twist.linear - before) <= 0.6 * max(held, PERIOD) + 1e-9
        self.world = later(self.world, self.command.twist)
        return self.command

    def until_driving(self, limit: int = 200) -> int:
        """Number of steps until the robot drives at half its speed or faster."""
        for n in range(limit):
            command = self.step()
            if command.status is CommandStatus.DRIVING and command.twist.linear > 0.25:
                return n
        raise AssertionError(f"it does not drive: {command.status}, {command.reason}")


@pytest.fixture
def loop():
    with Runner(Straight(), period=PERIOD, executor=ImmediateExecutor()) as runner:
        loop = Loop(runner)
        loop.until_driving()
        yield loop


@pytest.mark.parametrize("ahead", [0.3, 0.6, 60.0, 1e9])
def test_one_world_from_the_future_is_in_no_ones_way(loop, ahead):
    runner = loop.runner
    runner.update(loop.world.moved(time=loop.world.time + ahead))
    for n in range(40):
        if n:
            assert runner.update(loop.seen())
        command = loop.step(sees=False)
        assert command.status is CommandStatus.DRIVING
        assert 0.0 <= command.world_age <= PERIOD + 1e-9
    assert runner.ignored == (ahead > runner.max_age)


def test_a_world_from_the_future_and_a_good_one_in_the_same_period(loop):
    for order in (1, -1):
        good, wrong = loop.seen(), loop.world.moved(time=loop.world.time + 60.0)
        for world in (good, wrong)[::order]:
            loop.runner.update(world)
        assert loop.step(sees=False).world_age == 0.0


def test_perception_whose_clock_is_a_little_ahead_is_believed(loop):
    loop.worlds_ahead = 0.2
    commands = [loop.step() for _ in range(60)]
    assert {command.status for command in commands} == {CommandStatus.DRIVING}
    assert max(command.world_age for command in commands) <= PERIOD + 1e-9


@pytest.mark.parametrize(("ahead", "words"), [(5.0, "5 s ahead of"), (-5.0, "5 s behind")])
def test_perception_whose_clock_steps_stops_the_robot_until_the_clocks_agree(loop, ahead, words):
    loop.worlds_ahead = ahead
    commands = [loop.step() for _ in range(60)]
    assert commands[-1].status is CommandStatus.STALE and words in commands[-1].reason
    assert commands[-1].twist == STILL
    loop.worlds_ahead = 0.0
    loop.until_driving()


@pytest.mark.parametrize("back", [0.06, 0.3, 3.0, 1e6])
@pytest.mark.parametrize("with_worlds", [True, False])
def test_a_clock_that_steps_back_stops_the_robot_and_it_goes_on(loop, back, with_worlds):
    loop.commands_ahead = loop.worlds_ahead = -back
    if not with_worlds:  # the first command of the new clock comes before its first world
        loop.step(sees=False)
    else:
        loop.step()
    assert loop.command.status is CommandStatus.STALE
    assert "went back" in loop.command.reason and loop.command.time < 1e3
    assert loop.until_driving() < 60
    assert loop.runner.failures == 0


def test_without_a_world_of_the_new_clock_the_robot_stays(loop):
    loop.commands_ahead = -30.0
    commands = [loop.step() for _ in range(60)]
    assert {command.status for command in commands} == {CommandStatus.STALE}
    assert commands[-1].twist == STILL and "went back" in commands[-1].reason


def test_a_clock_that_steps_ahead_stops_the_robot_until_a_world_of_then(loop):
    loop.commands_ahead = 100.0
    command = loop.step()
    assert command.status is CommandStatus.STALE and "100 s old" in command.reason
    loop.worlds_ahead = 100.0
    loop.until_driving()


@pytest.mark.parametrize("now", [math.nan, math.inf, -math.inf, np.float64("nan")])
def test_a_clock_that_says_no_time_stops_the_robot(loop, now):
    before = loop.step()
    command = loop.step(now=now)
    assert command.status is CommandStatus.STALE and "clock" in command.reason
    assert command.twist.linear < before.twist.linear
    assert math.isfinite(command.time)
    loop.until_driving()


def test_a_log_goes_on_over_a_step_back():
    times = []

    class Log:
        def world(self, world):
            times.append(world.time)

        def plan(self, plan, time):
            times.append(time)

        def command(self, command):
            times.append(command.time)

    with Runner(Straight(), period=PERIOD, log=Log()) as runner:
        world, _ = drive(runner, later(maze(), runner.start(maze()).twist), 10)
        drive(runner, world.moved(time=world.time - 5.0), 10)
    assert times == sorted(times) and len(times) > 30


STEPS = st.tuples(
    st.sampled_from(["drive", "both", "commands", "worlds", "outlier", "blind", "none"]),
    st.floats(-100.0, 100.0),
)


@settings(max_examples=25, phases=[Phase.generate])
@given(st.lists(STEPS, min_size=5, max_size=40))
def test_no_clocks_raise_in_the_loop_or_break_a_limit(steps):
    with Runner(Straight(), period=PERIOD) as runner:
        loop = Loop(runner)
        for what, by in steps:
            if what in ("both", "commands"):
                loop.commands_ahead += by
            if what in ("both", "worlds"):
                loop.worlds_ahead += by
            if what == "outlier":
                runner.update(loop.world.moved(time=loop.world.time + by))
            command = loop.step(sees=what != "blind", now=math.nan if what == "none" else None)
            assert command.world_age >= 0.0 and -0.3 <= command.twist.linear <= 0.5
        loop.commands_ahead = loop.worlds_ahead = 0.0
        for _ in range(3):
            loop.step()
        assert loop.command.status is not CommandStatus.STALE
    assert runner.failures == 0
