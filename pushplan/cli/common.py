"""Helpers that several commands share."""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pushplan.evaluation import PolicySpec
    from pushplan.scenarios import Scenario
    from pushplan.world import Episode

DRIVEN_WITH_KEYS = ("turn_rate", "velocity")
"""Action modes that a person with keys can use."""


def check_episode_file(path: str | None) -> None:
    """Refuse a file for an episode that cannot be written.

    Raises:
        InvalidInputError: as `check_file`.
        MissingDependencyError: if it is to be MCAP and a library for that is missing.
    """
    from pushplan.cli.output_files import check_file
    from pushplan.imports.on_demand import need

    check_file(path)
    if path is not None and is_mcap(path):
        need("mcap")
        need("rosbags")


def load_episode(path: str) -> Episode:
    """Read an episode: MCAP by the ending ``.mcap``, else what `Episode.save` wrote."""
    from pushplan.world import Episode

    if not is_mcap(path):
        return Episode.load(path)
    from pushplan.ros import load_episode

    return load_episode(path)


def save_episode(episode: Episode, path: str) -> None:
    """Write an episode, as MCAP if the file ends in ``.mcap``."""
    if not is_mcap(path):
        return episode.save(path)
    from pushplan.ros import save_episode

    return save_episode(episode, path)


def is_mcap(path: str) -> bool:
    """Return True if a file is an MCAP log, as robots record them, by its ending."""
    return path.lower().endswith(".mcap")


def has_screen() -> bool:
    """Return True if windows can be shown; on Linux the environment names a display server."""
    return sys.platform != "linux" or bool({"DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys())


def say(text: str, end: str = "\n") -> None:
    """Write a line to standard output."""
    sys.stdout.write(text + end)


def tell(options: argparse.Namespace, value: Any, *lines: str) -> None:
    """Write a result to standard output: with ``--json`` as JSON alone, else in these lines."""
    if options.json:
        say_json(value)
    elif lines:
        say("\n".join(lines))


def say_without_deadline(policies: Iterable[PolicySpec]) -> None:
    """Name on standard error the policies that take no limit of their planning calls."""
    free = [spec.label for spec in policies if "stop" not in spec.options]
    if free:
        sys.stderr.write(f"without a deadline, since they take none: {', '.join(free)}\n")


def say_written(options: argparse.Namespace, *files: str | None) -> None:
    """Say which files were written, those that are not None, unless ``--json`` is given."""
    for file in files:
        if file is not None and not options.json:
            say(f"wrote {file}")


def say_json(value: Any) -> None:
    """Write a value to standard output as JSON; what is not finite becomes null."""
    say(json.dumps(_finite(value), indent=1))


def _finite(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        return _finite({one.name: getattr(value, one.name) for one in fields(value)})
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None  # JSON has no word for NaN and infinity
    return value


def say_scores(episode: Episode, names: Sequence[str] | None = None, who: str = "") -> None:
    """Write how an episode ended, and a line for each of its metrics."""
    from pushplan.metrics import compute

    say(f"{who}{'success' if episode.success else 'no success'} ({episode.reason})")
    for name, value in compute(episode, names).items():
        say(f"  {name:24s}{value:.6g}")


def milliseconds(seconds: float) -> str:
    """A time in words."""
    value = 1e3 * seconds
    return f"{value:.0f} ms" if value >= 100.0 else f"{value:.3g} ms"


def duration(seconds: float) -> str:
    """A time in words."""
    if seconds < 60.0:
        return f"{seconds:.3g} s"
    minutes = round(seconds / 60.0)
    if minutes < 120:
        return f"{minutes} min"
    return f"{minutes / 60.0:.1f} h"


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
