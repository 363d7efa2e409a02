"""The command line. Nothing heavy is imported until a command needs it."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NoReturn

from pushplan import __version__
from pushplan.cli import (
    bench,
    bounds,
    compare,
    compiling,
    demo,
    describe,
    doctor,
    experiment,
    gtsp,
    ice,
    listing,
    plan,
    report,
    run,
    score,
    serve,
    stored,
    stress,
    teleop,
    train,
)
from pushplan.cli.common import see_help

if TYPE_CHECKING:
    from pushplan.world import PushplanError

COMMANDS = (
    demo,
    doctor,
    run,
    teleop,
    plan,
    bench,
    experiment,
    stress,
    serve,
    listing,
    score,
    report,
    compare,
    bounds,
    stored,
    ice,
    gtsp,
    train,
    describe,
    compiling,
)

_USER_OS_ERRORS = (FileNotFoundError, FileExistsError, PermissionError, IsADirectoryError)
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
  1    something that was run failed, or a gate says no: a job, a plan, an episode, 'compare'
  2    the command cannot be carried out as it was given: an option, a name, a file, an extra
  130  interrupted by Ctrl-C
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        arguments: what follows the program's name; from the command line if None.

    Returns:
        0, 1, 2 or 130: the exit codes that ``pushplan --help`` lists.
    """
    parser = build_parser()
    if "_ARGCOMPLETE" in os.environ:  # the shell asks how a line may go on
        from pushplan.world.libraries import need

        need("argcomplete").autocomplete(parser)
    try:
        options = parser.parse_args(arguments)
    except SystemExit as error:  # argparse has written why
        return error.code if isinstance(error.code, int) else 2
    try:
        code: int = options.run(options)
        sys.stdout.flush()
        return code
    except KeyboardInterrupt:
        return _fail("interrupted", 130)
    except BrokenPipeError:  # the reader of our output has gone
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception as error:
        from pushplan.world.errors import (
            InvalidInputError,
            MissingDependencyError,
            PushplanError,
            UnknownNameError,
        )
        from pushplan.world.libraries import missing

        error = missing(error) or error
        if not isinstance(error, PushplanError | OSError):
            raise
        users = (InvalidInputError, UnknownNameError, MissingDependencyError, *_USER_OS_ERRORS)
        return _fail(_said(error), 2 if isinstance(error, users) else 1)


class _Parser(argparse.ArgumentParser):
    """Says in one line what is wrong, with the nearest choices, as all of pushplan does."""

    def error(self, message: str) -> NoReturn:
        """Say it without the usage, and end."""
        sys.exit(_fail(see_help(message, self.prog), 2))

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> tuple[Any, list[str]]:
        """Refuse what is not known here, where it is known which options are."""
        found, unknown = super().parse_known_args(args, namespace)
        if unknown and unknown[0].startswith("-"):
            from pushplan.world.errors import unknown_name_message

            options = [name for name in self._option_string_actions if name.startswith("--")]
            self.error(unknown_name_message("option", unknown[0].partition("=")[0], options))
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return found, unknown

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            from pushplan.world.errors import unknown_name_message

            kind = "command" if action.metavar == "COMMAND" else "choice"
            text = unknown_name_message(kind, value, map(str, action.choices))
            raise argparse.ArgumentError(None if kind == "command" else action, text)


def build_parser() -> argparse.ArgumentParser:
    """The parser of the whole command line."""
    parser = _Parser(
        prog="pushplan",
        description=_DESCRIPTION,
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"pushplan {__version__}")
    commands = parser.add_subparsers(
        title="commands", metavar="COMMAND", required=True, parser_class=_Parser
    )
    for command in COMMANDS:
        command.add(commands)
    return parser


def _said(error: PushplanError | OSError) -> str:
    """An error in words; that of the operating system without its number."""
    if isinstance(error, OSError) and error.strerror and error.filename is not None:
        return f"{error.filename!r}: {error.strerror}"
    return str(error)


def _fail(message: str, code: int) -> int:
    from pushplan.world.errors import one_line

    sys.stderr.write(f"pushplan: {one_line(message)}\n")
    return code
