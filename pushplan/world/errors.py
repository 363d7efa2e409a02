"""Errors that a caller may want to catch, all below one root."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class PushplanError(Exception):
    """Root of every error that pushplan raises on purpose."""


class InvalidInputError(PushplanError, ValueError):
    """A value breaks a stated rule: wrong type, shape, range, or not finite."""


class UnknownNameError(PushplanError, KeyError):
    """A name is not among the valid choices; the message lists them."""

    def __init__(self, kind: str, name: object, choices: Iterable[str]) -> None:
        self.kind = kind
        self.name = name
        self.choices = tuple(sorted(choices))
        super().__init__(unknown_name_message(kind, name, self.choices))

    def __str__(self) -> str:  # KeyError would show the repr of the message
        return str(self.args[0])

    def __reduce__(self) -> tuple[type[UnknownNameError], tuple[str, object, tuple[str, ...]]]:
        return type(self), (self.kind, self.name, self.choices)


class SchemaError(InvalidInputError):
    """A file or mapping does not follow its documented schema."""


class ScenarioError(InvalidInputError):
    """A scenario asks for something that cannot be built, such as too many boxes."""


class MissingDependencyError(PushplanError, ImportError):
    """An optional library is needed; the message says which extra installs it."""


def unknown_name_message(kind: str, name: object, choices: Iterable[str]) -> str:
    """One line that names the unknown value, the nearest valid one and every choice."""
    valid = sorted(choices)
    near = difflib.get_close_matches(str(name), valid, n=1, cutoff=0.5)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    return f"unknown {kind} {name!r}{hint} (valid: {', '.join(valid) or 'none'})"


def describe(error: BaseException) -> str:
    """One line for an exception: its type and its message."""
    text = " ".join(str(error).split())
    name = type(error).__name__
    return f"{name}: {text}" if text else name
