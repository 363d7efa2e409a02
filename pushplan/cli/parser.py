"""The parser of the command line. The commands and their options stand in ``commands.toml``."""

from __future__ import annotations

import argparse
import os
import re
import sys
import tomllib
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from importlib.resources import files
from typing import Any, NoReturn

from pushplan import __version__

_DESCRIPTION = "Plan, push, score and compare: baselines for robots that push things."
_EXAMPLES = """\
examples:
  pushplan demo
  pushplan bench maze-2d-5 --policies straight,kinodynamic-rrt --episodes 20 --out runs/first
  pushplan run maze-2d-5 --policy kinodynamic-rrt --seed 3 --render episode.gif
  pushplan plan room.yaml --planner kinodynamic-rrt --deadline 1.0 --render plan.png
  pushplan list policies

'pushplan COMMAND --help' explains a command.

exit codes:
  0    done
  1    something that was run failed, or a gate says no: a job, a plan, an episode, 'runs compare'
  2    the command cannot be carried out as it was given: an option, a name, a file, an extra
  130  interrupted by Ctrl-C
"""
_MOVED = ("compare", "export", "merge", "reproduce", "rescore", "salvage", "status")
"""Commands that stood beside ``runs`` up to version 0.3 and still work there."""


class CommandParser(argparse.ArgumentParser):
    """Says in one line what is wrong, with the nearest choices, as all of pushplan does."""

    def error(self, message: str) -> NoReturn:
        """Say it without the usage, and end."""
        sys.exit(fail(f"{message}; see '{self.prog} --help'", 2))

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> tuple[Any, list[str]]:
        """Refuse what is not known here, where it is known which options are."""
        found, unknown = super().parse_known_args(args, namespace)
        if unknown and unknown[0].startswith("-"):
            # here as elsewhere: what most command lines need none of is imported late
            from pushplan.errors import unknown_name_message

            options = [name for name in self._option_string_actions if name.startswith("--")]
            self.error(unknown_name_message("option", unknown[0].partition("=")[0], options))
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return found, unknown

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            from pushplan.errors import unknown_name_message

            kind = "command" if action.metavar == "COMMAND" else "choice"
            text = unknown_name_message(kind, value, map(str, action.choices))
            raise argparse.ArgumentError(None if kind == "command" else action, text)


class _PrintCmakeDir(argparse.Action):
    """Prints the folder of the CMake package, and ends."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> NoReturn:
        from pushplan.core import cmake_dir
        from pushplan.errors import PushplanError

        try:
            print(cmake_dir())
        except PushplanError as error:
            sys.exit(fail(str(error), 1))
        sys.exit(0)


def fail(message: str, code: int) -> int:
    """Say on one line why a command ends, and give its exit code."""
    from pushplan.errors import one_line

    sys.stderr.write(f"pushplan: {one_line(message)}\n")
    return code


def build_parser() -> argparse.ArgumentParser:
    """The parser of the whole command line."""
    parser = CommandParser(
        prog="pushplan",
        description=_DESCRIPTION,
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"pushplan {__version__}")
    parser.add_argument(
        "--cmake-dir",
        action=_PrintCmakeDir,
        nargs=0,
        help="print the folder for CMake's find_package(pushplan) and exit",
    )
    text = files("pushplan.cli").joinpath("commands.toml").read_text(encoding="utf-8")
    described = tomllib.loads(text)
    shared = described.pop("shared")
    _add_commands(parser, described, shared)
    return parser


def current_spelling(arguments: Sequence[str]) -> Sequence[str]:
    """The words of a command line as they are spelt now; warns of an old spelling."""
    if not arguments or arguments[0] not in _MOVED:
        return arguments
    name = arguments[0]
    sys.stderr.write(
        f"pushplan: 'pushplan {name}' is now 'pushplan runs {name}'; the old spelling goes with "
        "the next release\n"
    )
    return ["runs", *arguments]


def _add_commands(
    parser: argparse.ArgumentParser, described: Mapping[str, Any], shared: Mapping[str, Any]
) -> None:
    """Add commands, and those below them, with their options."""
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name, about in described.items():
        summary = about["summary"]
        command = commands.add_parser(
            name,
            help=summary,
            description=summary[0].upper() + summary[1:] + ".",
            epilog=f"examples:\n{about['examples']}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        if "commands" in about:
            _add_commands(command, about["commands"], shared)
            continue
        command.set_defaults(run=about["run"])
        _add_options(command, about.get("options", {}), shared)
        for group in about.get("also", ()):
            _add_options(command, shared[group], shared)


def _add_options(
    parser: argparse._ActionsContainer, options: Mapping[str, Any], shared: Mapping[str, Any]
) -> None:
    """Add the entries of ``options``, by the names that are their keys."""
    for names, about in options.items():
        if "one_of" in about:
            _add_options(parser.add_mutually_exclusive_group(), about["one_of"], shared)
        elif "shared" in about:
            for name in names.split():
                _add_options(parser, shared[name], shared)
        else:
            _add_option(parser, names, **about)


def named(name: str) -> Any:
    """Import what ``"module:name"`` stands for, of a module of this package."""
    module, _, attribute = name.partition(":")
    return getattr(import_module(f"pushplan.cli.{module}"), attribute)


def _add_option(
    parser: argparse._ActionsContainer, names: str, complete: str | None = None, **given: Any
) -> None:
    """Add one entry of ``commands.toml``."""
    if "type" in given:
        given["type"] = OPTION_TYPES[given["type"]]
    if isinstance(given.get("choices"), str):
        given["choices"] = named(given["choices"])
    if given.get("default") == "cores":
        given["default"] = os.cpu_count() or 1
    action = parser.add_argument(*names.split(), **given)
    if complete is not None:

        def completions(**_: Any) -> list[str]:
            from pushplan.cli.listing import names_of

            return names_of(complete)

        action.completer = completions  # type: ignore[attr-defined]


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


def _shard(text: str) -> tuple[int, int]:
    if re.fullmatch("[0-9]+/[0-9]+", text) is None:
        raise argparse.ArgumentTypeError(f"a part is given as K/N, such as 3/16, got {text!r}")
    part, parts = map(int, text.split("/"))
    if not 1 <= part <= parts:
        raise argparse.ArgumentTypeError(f"K must be between 1 and N, got {text}")
    return part, parts


def _numbers(separator: str, count: int) -> Callable[[str], tuple[float, ...]]:
    """An option type: so many numbers between separators."""

    def read(text: str) -> tuple[float, ...]:
        try:
            values = tuple(float(part) for part in text.split(separator))
        except ValueError:
            values = ()
        if len(values) != count:
            example = separator.join("12345"[:count])
            raise argparse.ArgumentTypeError(
                f"must be {count} numbers like {example}, got {text!r}"
            )
        return values

    return read


OPTION_TYPES: Mapping[str, Callable[[str], Any]] = {
    "whole": whole(0),
    "count": whole(1),
    "number": float,
    "positive": positive,
    "names": lambda text: text.split(",") if text else None,
    "shard": _shard,
    "size": _numbers("x", 2),
    "range": _numbers(",", 2),
    "corners": _numbers(",", 4),
}
"""Names in ``commands.toml`` for what reads an option's value."""
