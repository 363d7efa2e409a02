"""A loop with `DelayedExecutor` repeats to the byte; its plans arrive when they are meant to."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from test_runner import PERIOD, Straight, later, maze

from pushplan.runtime import CommandStatus, DelayedExecutor, Runner
from pushplan.world import InvalidInputError, MaxIterations

PAGE = Path(__file__).parents[2] / "docs" / "robot.md"


@pytest.mark.parametrize("steps", [0, 1, 5])
def test_a_plan_arrives_so_many_steps_after_it_was_asked_for(steps):
    world = maze()
    with Runner(Straight(), period=PERIOD, executor=DelayedExecutor(steps * PERIOD)) as runner:
        commands = [runner.start(world)]
        for _ in range(steps + 2):
            world = later(world, commands[-1].twist)
            runner.update(world)
            commands.append(runner.command(world.time))
    arrived = [command.plan is not None for command in commands]
    assert arrived == [False] * steps + [True] * 3
    waits = [command.status is CommandStatus.WAITING for command in commands]
    assert waits == [not there for there in arrived]


def test_the_rule_ends_each_call():
    rules = []
    executor = DelayedExecutor(1.0, MaxIterations(3))
    executor.submit(rules.append, 0.0)
    check = rules[0].start()
    assert not check(2, 0.0)
    assert check(3, 0.0)


def test_a_negative_delay_is_refused():
    with pytest.raises(InvalidInputError, match="delay"):
        DelayedExecutor(-0.1)


def test_the_loop_of_the_page_repeats_and_shows_the_delay():
    (block,) = (
        b for b in re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.S) if "Delayed" in b
    )
    names: dict = {"__name__": "page"}
    block = block.replace("< 200", "< 60")  # of its steps: 40 are the longer delay
    exec(block, names)  # asserts that two runs have the same bytes
    assert names["drive"](4).tobytes() != names["drive"](40).tobytes()
