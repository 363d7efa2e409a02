"""Files that we write: nothing of a user's is lost, and no link leads us elsewhere."""

from __future__ import annotations

import contextlib
import os
import re
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from pushplan.errors import InvalidInputError

TEMPORARY = re.compile(r"\.pushplan-[0-9a-f]{16}\.tmp")
"""Names of files that are being written."""


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[IO[bytes]]:
    """A new file that takes a name in one instant at the end: it is never seen half written.

    A file of that name is replaced. So is a link, which is not followed.
    """
    # nobody can lay a link at a name that cannot be guessed, and "x" would refuse it; it is in the
    # same folder because `os.replace` takes one instant only within a disk
    temporary = path.with_name(f".pushplan-{secrets.token_hex(8)}.tmp")
    try:
        with temporary.open("xb") as file:
            yield file
        os.replace(temporary, path)
    except BaseException as error:
        temporary.unlink(missing_ok=True)
        if isinstance(error, OSError):
            error.filename = str(path)  # nobody knows the name of the temporary file
        raise


def write_atomic(path: Path, data: bytes) -> None:
    """Write a file as `replacing` does."""
    with replacing(path) as file:
        file.write(data)


def check_folder(path: str | Path, kind: str, mark: str) -> None:
    """Refuse to write into a folder that holds a user's own files.

    Args:
        path: the folder; one that is missing or empty is free.
        kind: what it may be, such as ``"run directory"``.
        mark: the file that tells such a folder from others.

    Raises:
        InvalidInputError: if it is a file, or is not empty and has no mark.
    """
    path = Path(path)
    try:
        names = os.listdir(path)
    except FileNotFoundError:
        return
    except OSError as error:
        raise InvalidInputError(f"cannot use {path} as a folder: {error.strerror}") from error
    begun = [name for name in names if name != ".lock" and not TEMPORARY.fullmatch(name)]
    if begun and mark not in names:
        raise InvalidInputError(
            f"{path} is not empty and is no {kind}, there is no {mark} in it: choose a new or an "
            "empty folder, nothing in this one was changed"
        )


def make_folder(path: Path) -> None:
    """Make a folder inside one of ours.

    Raises:
        InvalidInputError: if there is a link in its place.
    """
    path.mkdir(parents=True, exist_ok=True)
    if path.is_symlink():  # one to a folder is no error of `mkdir`
        raise InvalidInputError(f"{path} is a link, which is not followed: put the folder there")
