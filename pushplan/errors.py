"""Errors that a caller may want to catch, all below one root."""

from __future__ import annotations

import difflib
import os
import reprlib
from collections.abc import Iterable
from typing import NoReturn

LONGEST_MESSAGE = 300
"""Most characters of a message; of a longer one, the middle is left out."""
MOST_CHOICES = 12
"""Most choices that a message lists; of more, the `NEAREST` to the name that was given."""
NEAREST = 3
_ALIKE = 0.55
"""Similarity above which the nearest choice may be meant: "circle" is no "receptacle"."""
_LONGEST_INTEGER = 200
"""Bits from which on a number is not written out, which takes time with its square."""
_OURS = os.path.dirname(os.path.abspath(__file__))
_PYTHONS = os.path.dirname(os.__file__)
_NOT_A_USERS = ("<", f"{_OURS}{os.sep}", f"{_PYTHONS}{os.sep}")
_INSTALLED = {"site-packages", "dist-packages"}


class PushplanError(Exception):
    """Root of every error that pushplan raises on purpose.

    Its text is one line of `LONGEST_MESSAGE` at most, in which nothing moves a terminal's cursor.
    """

    def __str__(self) -> str:
        return one_line(" ".join(map(str, self.args)))


class InvalidInputError(PushplanError, ValueError):
    """A value breaks a stated rule: wrong type, shape, range, or not finite."""


class UnknownNameError(PushplanError, KeyError):
    """A name is not among the valid choices; the message lists them."""

    def __init__(self, kind: str, name: object, choices: Iterable[str]) -> None:
        self.kind = kind
        self.name = name
        self.choices = tuple(sorted(choices))
        super().__init__(unknown_name_message(kind, name, self.choices))

    def __reduce__(self) -> tuple[type[UnknownNameError], tuple[str, object, tuple[str, ...]]]:
        return type(self), (self.kind, self.name, self.choices)


class SchemaError(InvalidInputError):
    """A file or mapping does not follow its documented schema."""


class ScenarioError(InvalidInputError):
    """A scenario asks for something that cannot be built, such as too many boxes."""


class MissingDependencyError(PushplanError, ImportError):
    """An optional library is needed; the message says which extra installs it."""


def refuse_copy(one: object, _protocol: object = None) -> NoReturn:
    """Raise a `PushplanError`; as ``__reduce_ex__`` of a class it says that there are no copies."""
    raise PushplanError(
        f"a {type(one).__name__} cannot be copied or pickled, as its memory is outside Python or "
        "in other threads: make another one, or copy a policy before reset()"
    )


def unknown_name_message(kind: str, name: object, choices: Iterable[str]) -> str:
    """One line that names the unknown value, and every choice or, of many, the three nearest."""
    valid = sorted(choices)
    near = difflib.get_close_matches(str(name)[:80], valid, n=NEAREST, cutoff=0.5)
    alike = difflib.get_close_matches(str(name)[:80], near, n=1, cutoff=_ALIKE)
    hint = f"; did you mean {alike[0]!r}?" if alike else ""
    if len(valid) <= MOST_CHOICES:
        return f"unknown {kind} {short(name)}{hint} (valid: {', '.join(valid) or 'none'})"
    shown = f"nearest of {len(valid)}: {', '.join(near)}"
    if not near:
        shown = f"{len(valid)} are valid, such as {', '.join(valid[:3])}"
    return f"unknown {kind} {short(name)}{hint} ({shown})"


def describe(error: BaseException) -> str:
    """One line for an exception: its type, its message, and its `place` in a user's code."""
    try:
        text = one_line(str(error))
    except BaseException:  # its text may be code of a stranger
        text = ""
    name = type(error).__name__
    where = place(error)
    return one_line(f"{name}{': ' if text else ''}{text}{f' ({where})' if where else ''}")


def place(error: BaseException) -> str:
    """``file.py:line`` of the innermost frame that an exception left in a user's code.

    A user's is what belongs neither to pushplan nor to Python nor to an installed library. Empty
    if there is no such frame, or the message says the place itself, as that of a SyntaxError.
    """
    frame = error.__traceback__
    found = ""
    while frame is not None and not isinstance(error, SyntaxError):
        file = frame.tb_frame.f_code.co_filename
        if is_a_users(file):
            found = f"{os.path.basename(file)}:{frame.tb_lineno}"
        frame = frame.tb_next
    return found


def is_a_users(file: str) -> bool:
    """True if a file of code belongs neither to pushplan nor to Python nor to a library."""
    return not file.startswith(_NOT_A_USERS) and not _INSTALLED & {*file.split(os.sep)}


def one_line(text: str) -> str:
    """A text on one line, with its control characters escaped, and without its middle if long."""
    text = " ".join(text.split())
    if len(text) > LONGEST_MESSAGE:
        text = f"{text[: LONGEST_MESSAGE // 2]} ... {text[5 - LONGEST_MESSAGE // 2 :]}"
    if text.isprintable():
        return text
    visible = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
    return one_line(visible)  # longer by what was escaped


class _Short(reprlib.Repr):
    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxother = 60
        self.maxlevel = 3

    def repr_int(self, x: int, level: int) -> str:
        if x.bit_length() < _LONGEST_INTEGER:
            return repr(x)
        return f"a number of {x.bit_length()} bits"


short = _Short().repr
"""The ``repr`` of a value, without its middle where it is long; never costly."""
