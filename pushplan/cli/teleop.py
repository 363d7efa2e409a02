"""``pushplan teleop``: a person drives with the keyboard."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from pushplan.cli.common import say, say_scores
from pushplan.cli.output_files import check_file
from pushplan.cli.scenario_options import scenario_of

if TYPE_CHECKING:
    from pushplan.scenarios import Scenario

ACTIONS = ("turn_rate", "velocity")
"""Action modes that a person with keys can use."""


def run(options: argparse.Namespace) -> int:
    """Open a window, drive, print the scores, write the episode."""
    scenario = scenario_of(options)
    check_file(options.out)
    env = _environment(scenario, options.action)
    from pushplan.cli.cockpit import drive
    from pushplan.cli.keyboard import Keyboard
    from pushplan.envs.window import Window

    keyboard = Keyboard()
    window = Window(f"pushplan {scenario.task}, seed {scenario.seed}", keyboard=keyboard)
    try:
        episode = drive(env, scenario, window, speed=options.speed)
    finally:
        window.close()
        env.close()
    if options.out:
        episode.save(options.out)
    say_scores(episode)
    if options.out:
        say(f"wrote {options.out}")
    return 0


def _environment(scenario: Scenario, action: str | None) -> Any:
    from pushplan.envs import make
    from pushplan.envs.registry import task_class
    from pushplan.world import InvalidInputError

    known = task_class(scenario.task).actions
    usable = [name for name in known if name in ACTIONS]
    if not usable:
        raise InvalidInputError(
            f"task {scenario.task!r} cannot be driven with keys: it has none of the actions "
            f"{', '.join(ACTIONS)} (it has: {', '.join(known)})"
        )
    return make(scenario, observation="state", action=action or usable[0])
