"""Options by which a command is told what to run."""

from __future__ import annotations

import argparse
import os
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pushplan.scenarios import Scenario


def scenario_of(options: argparse.Namespace) -> Scenario:
    """The scenario that was asked for, by a suite or a task; errors as `start_of_task`."""
    from pushplan.scenarios import suite, suite_names
    from pushplan.world import InvalidInputError

    if (found := start_of_task(options)) is not None:
        return found
    if options.suite not in suite_names() and os.path.exists(options.suite):
        raise InvalidInputError(
            f"{options.suite!r} is a file or a folder, no suite: a world is given as "
            "--task room --set world_file=FILE"
        )
    return suite(options.suite, episodes=1, first_seed=options.seed).scenarios[0]


def start_of_task(options: argparse.Namespace) -> Scenario | None:
    """The scenario of ``--task`` with its variations; None where a suite is given instead.

    Raises:
        InvalidInputError: if both are given or none, or variations with a suite.
    """
    from pushplan.envs.registry import default_preset
    from pushplan.scenarios import Scenario
    from pushplan.world import InvalidInputError

    shown = {name: getattr(options, name) for name in ("boxes", "shape", "robot")}
    chosen = {key: value for key, value in shown.items() if value is not None}
    given = chosen | variations("variation", options.variations, chosen)
    if (options.suite is None) == (options.task is None):
        raise InvalidInputError("give either a SUITE or --task NAME, see --help")
    if options.suite is None:
        simulator = options.simulator or "pymunk"
        preset = options.preset or default_preset(options.task, simulator)
        return Scenario(options.task, simulator, preset, given, options.seed)
    extra = [*given, *(name for name in ("simulator", "preset") if getattr(options, name))]
    if extra:
        raise InvalidInputError(
            f"a suite says what its scenarios are: {', '.join(sorted(extra))} needs --task instead"
        )
    return None


def variations(kind: str, texts: Sequence[str], chosen: Collection[str] = ()) -> dict[str, Any]:
    """Values by name of texts of the form ``NAME=VALUE``.

    Args:
        kind: what errors call one of them.
        texts: what was given.
        chosen: names that have a value already.

    Raises:
        InvalidInputError: as `variation`, or if a name is given twice.
    """
    from pushplan.world import InvalidInputError

    values: dict[str, Any] = {}
    for name, value in map(variation, texts):
        if name in values or name in chosen:
            raise InvalidInputError(f"{kind} {name!r} is given twice")
        values[name] = value
    return values


def variation(text: str) -> tuple[str, Any]:
    """Name and value of a text of the form ``NAME=VALUE``.

    Raises:
        InvalidInputError: if it has another form, or the value is no YAML.
    """
    from pushplan.files.safe_files import parse_yaml
    from pushplan.world import InvalidInputError

    name, equals, value = text.partition("=")
    if not equals or not name:
        raise InvalidInputError(f"--set takes NAME=VALUE, got {text!r:.80}")
    return name, parse_yaml(value, f"{value!r:.60} of --set {name!r:.60}")
