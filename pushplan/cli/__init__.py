"""The command line. Nothing heavy is imported until a command needs it.

`main` imports the parser itself, so that it handles Ctrl-C from the start.
"""

from __future__ import annotations

import codecs
import os
import sys
import warnings

TYPE_CHECKING = False  # as the module typing has it, whose import takes a while
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import TextIO

__all__ = ["main"]

_USER_OS_ERRORS = (FileNotFoundError, FileExistsError, PermissionError, IsADirectoryError)
_PLAIN = {"─": "-", "\u2212": "-", "±": "+-", "≥": ">="}
"""ASCII spellings of signs in our tables."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        arguments: what follows the program's name; from the command line if None.

    Returns:
        0, 1, 2 or 130: the exit codes that ``pushplan --help`` lists.
    """
    try:
        if arguments is None:
            from pushplan.cli.interrupts import Interrupts

            with Interrupts():
                return main(sys.argv[1:])
        codecs.register_error("pushplan", _in_plain_signs)
        for name in ("stdout", "stderr"):
            stream = getattr(sys, name) or open(os.devnull, "w")  # the shell may have closed it
            setattr(sys, name, stream)
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="pushplan")
        return _run(arguments)
    except KeyboardInterrupt:
        sys.stderr.write("pushplan: interrupted\n")
        return 130
    except BrokenPipeError:  # the reader of our output has gone
        # Python flushes once more when it ends, which would fail again
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


def _run(arguments: Sequence[str]) -> int:
    """Run one command; when it returns, its output has been written."""
    from pushplan.cli.parser import build_parser, current_spelling, fail, named

    parser = build_parser()
    if "_ARGCOMPLETE" in os.environ:  # the shell asks how a line may go on
        from pushplan.imports.on_demand import need

        need("argcomplete").autocomplete(parser)
    try:
        try:
            options = parser.parse_args(current_spelling(arguments))
        except SystemExit as error:  # argparse has written why
            sys.stdout.flush()
            return error.code if isinstance(error.code, int) else 2
        if getattr(options, "trust_pickles", False):
            from pushplan.learned.sb3_policy import TRUST_VARIABLE

            os.environ[TRUST_VARIABLE] = "1"  # where worker processes see it too
        with warnings.catch_warnings():
            warnings.showwarning = _show_in_a_line
            if getattr(options, "strict_units", False):
                from pushplan.world.units import UnitsWarning

                warnings.simplefilter("error", UnitsWarning)
            code: int = named(options.run)(options)
        sys.stdout.flush()  # a full disk or a closed pipe is reported here, or nowhere
        return code
    except BrokenPipeError:
        raise
    except Exception as error:
        from pushplan.errors import (
            InvalidInputError,
            MissingDependencyError,
            PushplanError,
            UnknownNameError,
        )
        from pushplan.imports.on_demand import missing

        error = missing(error) or error
        if not isinstance(error, PushplanError | OSError):
            raise  # a fault of ours: its traceback is wanted
        users = (InvalidInputError, UnknownNameError, MissingDependencyError, *_USER_OS_ERRORS)
        text = str(error)
        if isinstance(error, OSError) and error.strerror and error.filename is not None:
            text = f"{error.filename!r}: {error.strerror}"  # without the system's number
        return fail(text, 2 if isinstance(error, users) else 1)


def _in_plain_signs(error: UnicodeError) -> tuple[str, int]:
    """Return what is written for signs that an encoding of standard output does not have."""
    import unicodedata

    assert isinstance(error, UnicodeEncodeError)
    written = ""
    for sign in error.object[error.start : error.end]:
        plain = unicodedata.normalize("NFKD", sign).encode("ascii", "ignore").decode()
        written += _PLAIN.get(sign) or plain or ascii(sign)[1:-1]
    return written, error.end


def _show_in_a_line(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Write a warning to standard error: of ours its message, which is for the user."""
    text = f"pushplan: note: {message}\n"
    if not category.__module__.startswith("pushplan."):
        text = warnings.formatwarning(message, category, filename, lineno, line)
    (file or sys.stderr).write(text)
