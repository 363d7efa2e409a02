"""Policies from files, as they are named on the command line."""

from __future__ import annotations

import functools
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pushplan.world import InvalidInputError, UnknownNameError

if TYPE_CHECKING:
    from pushplan.learned.network_policy import NetworkPolicy


LEARNED_PREFIXES = ("onnx:", "sb3:")
_ENDINGS = {"onnx": ".onnx", "sb3": ".zip"}


@functools.cache
def shipped_files(package: str, pattern: str) -> dict[str, Path]:
    """Files that come with a package of ours, by the first part of their names."""
    folder = Path(str(resources.files(package)))
    return {path.stem: path for path in sorted(folder.glob(pattern), key=lambda path: path.stem)}


def _shipped() -> dict[str, Path]:
    return shipped_files("pushplan.learned", "weights/*.onnx")


def learned_names() -> tuple[str, ...]:
    """The names of the shipped networks, such as ``maze-ppo``."""
    return tuple(_shipped())


def weights_of(name: str) -> Path:
    """The file of a shipped network.

    Raises:
        UnknownNameError: if there is none of that name.
    """
    if name not in _shipped():
        raise UnknownNameError("learned policy", name, learned_names())
    return _shipped()[name]


def load_policy(source: str, label: str | None = None, **options: Any) -> NetworkPolicy:
    """A policy from a file, or a shipped one.

    Args:
        source: ``"onnx:FILE"``, ``"sb3:FILE"`` (the ending may be left out) or the name of a
            shipped network.
        label: what errors call it.
        options: ``trust`` for ``sb3``, see `pushplan.learned.sb3_policy.Sb3Policy`.

    Raises:
        InvalidInputError: if the file is no such policy, or is not trusted.
        UnknownNameError: if there is no shipped network of that name.
        MissingDependencyError: if a library that runs it is not there.
    """
    if source.startswith(LEARNED_PREFIXES):
        path = learned_file(source)
    else:
        path = weights_of(source)
        label = label or source
    if source.startswith("sb3:"):
        from pushplan.learned.sb3_policy import Sb3Policy

        return Sb3Policy(path, label=label, **options)
    if options:
        raise InvalidInputError(f"an ONNX policy has no options, got {', '.join(options)}")
    from pushplan.learned.onnx_policy import OnnxPolicy

    return OnnxPolicy(path, label)


def learned_file(source: str) -> Path:
    """The file that a text such as ``onnx:FILE`` names.

    Raises:
        InvalidInputError: if it is not there.
    """
    kind, _, name = source.partition(":")
    if not name:
        raise InvalidInputError(f"policy {source!r}: the file is missing, as in {kind}:FILE")
    path = Path(name).expanduser()
    with_ending = path
    if path.name:  # "/" and "." have none
        with_ending = path.with_name(path.name + _ENDINGS[kind])
    for candidate in (path, with_ending):
        if candidate.is_file():
            return candidate.resolve()
    raise InvalidInputError(f"policy {source!r}: there is no file {path} or {with_ending}")
