"""What several commands share."""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pushplan.world import Episode


def add_command(
    commands: Any, name: str, summary: str, examples: str, run: Callable[[Any], int]
) -> argparse.ArgumentParser:
    """Add a command with examples below its options."""
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=summary,
        description=summary[0].upper() + summary[1:] + ".",
        epilog=f"examples:\n{examples}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(run=run)
    return parser


def see_help(message: str, program: str) -> str:
    """What is wrong with the words of a command, and what lists its options."""
    return f"{message}; see '{program} --help'"


def complete(action: argparse.Action, kind: str) -> None:
    """Let the shell complete an argument with the names of a kind of `pushplan list`."""

    def names(**_: Any) -> list[str]:
        from pushplan.cli.listing import names_of

        return names_of(kind)

    action.completer = names  # type: ignore[attr-defined]


def add_run_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of commands that run jobs in a run directory."""
    parser.add_argument(
        "--workers",
        type=whole(0),
        default=os.cpu_count() or 1,
        metavar="W",
        help="processes (default: one a core; 0: this process)",
    )
    parser.add_argument(
        "--check", action="store_true", help="say what would be run and what it costs, and end"
    )
    parser.add_argument(
        "--retry-failed", action="store_true", help="run jobs again that raised, hung or crashed"
    )
    parser.add_argument(
        "--any-version",
        action="store_true",
        help="take results as they are that other versions of pushplan or its packages made",
    )
    parser.add_argument(
        "--shard",
        type=_shard,
        metavar="K/N",
        help="only the K-th of N parts of the jobs, as on one of N machines; see 'pushplan merge'",
    )
    parser.add_argument(
        "--dask",
        metavar="WHERE",
        help="run jobs on a Dask cluster: 'local:N', or the address of its scheduler",
    )


def run_options(options: argparse.Namespace) -> dict[str, Any]:
    """What `add_run_options` read, as `Experiment.run` takes it."""
    names = ("workers", "retry_failed", "any_version", "shard", "dask")
    return {name: getattr(options, name) for name in names}


def _shard(text: str) -> tuple[int, int]:
    part, _, parts = text.partition("/")
    if not (part.isascii() and part.isdigit() and parts.isascii() and parts.isdigit()):
        raise argparse.ArgumentTypeError(f"a part is given as K/N, such as 3/16, got {text!r}")
    if not 1 <= int(part) <= int(parts):
        raise argparse.ArgumentTypeError(f"K must be between 1 and N, got {text}")
    return int(part), int(parts)


def add_latency(parser: argparse.ArgumentParser) -> None:
    """Add the option that lets time pass while a policy computes."""
    parser.add_argument(
        "--latency",
        type=positive,
        metavar="FACTOR",
        help="let the world go on while the policy computes, FACTOR seconds for each second "
        "(default: it stands still)",
    )


def add_trust(parser: argparse.ArgumentParser) -> None:
    """Add the option that lets policies from files with pickles run."""
    parser.add_argument(
        "--trust-pickles",
        action=_Trust,
        nargs=0,
        help="let sb3:FILE load: this runs whatever code the author of the file put there",
    )


class _Trust(argparse.Action):
    """Says so in the environment, where worker processes see it too."""

    def __call__(self, *arguments: Any, **options: Any) -> None:
        import os

        from pushplan.learned.sb3_policy import TRUST_VARIABLE

        os.environ[TRUST_VARIABLE] = "1"


def whole(low: int) -> Callable[[str], int]:
    """An option type: a whole number that is at least ``low``."""

    def read(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
        if value < low:
            raise argparse.ArgumentTypeError(f"must be at least {low}, got {value}")
        return value

    return read


def positive(text: str) -> float:
    """An option type: a number greater than 0."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"must be positive and finite, got {text}")
    return value


def check_episode_file(path: str | None) -> None:
    """Refuse a file for an episode that cannot be written.

    Raises:
        InvalidInputError: as `check_file`.
        MissingDependencyError: if it is to be MCAP and a library for that is missing.
    """
    from pushplan.cli.outputs import check_file
    from pushplan.world.libraries import need

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
    """Whether a file is a log as robots keep them, by its ending."""
    return path.lower().endswith(".mcap")


def has_screen() -> bool:
    """Whether windows can be shown: on Linux a display server says so in the environment."""
    return sys.platform != "linux" or bool({"DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys())


def say(text: str, end: str = "\n") -> None:
    """Write a line to standard output."""
    sys.stdout.write(text + end)


def say_json(value: Any) -> None:
    """Write a value to standard output as JSON; what is not finite becomes null."""
    say(json.dumps(_finite(value), indent=1))


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


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
    return f"{minutes} min" if minutes < 120 else f"{minutes / 60.0:.1f} h"
