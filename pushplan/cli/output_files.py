"""Files and folders that commands write: refused before the work begins, not after it."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path


def check_file(path: str | None, endings: Sequence[str] = ()) -> None:
    """Refuse a file that cannot be written.

    Args:
        path: the file; None is none to be written.
        endings: what its name may end in; anything if there is none.

    Raises:
        InvalidInputError: naming the path and what is wrong with it.
    """
    if path is None:
        return
    from pushplan.errors import InvalidInputError

    file = Path(path)
    if endings and file.suffix.lower() not in endings:
        raise InvalidInputError(f"a file to write ends in {' or '.join(endings)}, got {path!r}")
    if file.is_dir():
        raise InvalidInputError(f"cannot write {path!r}: it is a folder")
    if file.is_symlink() and not path.startswith("/dev/"):  # /dev/stdout is one
        raise InvalidInputError(f"cannot write {path!r}: it is a link, which is not followed")
    if not file.absolute().parent.is_dir():
        raise InvalidInputError(f"there is no folder {file.parent} for {path!r}")
    if file.exists():
        if not os.access(file, os.W_OK):
            raise InvalidInputError(f"cannot write {path!r}: permission denied")
    elif not _takes_files(file.absolute().parent):
        raise InvalidInputError(f"cannot write {path!r}: {file.parent} takes no new files")


def check_picture(path: str | None, endings: Sequence[str] = (".png",)) -> None:
    """Refuse a picture that cannot be written; errors as `check_file`.

    Raises:
        MissingDependencyError: if the library that draws it is not installed.
    """
    if path is not None:
        from pushplan.imports.on_demand import need

        check_file(path, endings)
        need("PIL")


def check_figure(path: str | None, films: Sequence[str] = ()) -> None:
    """Refuse a picture with axes and a legend, or a film, as `check_picture` does.

    Args:
        path: the file; None is none to be written.
        films: endings of films that may be written, too.
    """
    if path is not None:
        from pushplan.imports.on_demand import need

        need("PIL")
        from pushplan.drawing.figure import FORMATS

        check_picture(path, (*FORMATS, *films))
        if Path(path).suffix.lower() in FORMATS:
            need("matplotlib")


def check_directory(
    path: str | None, kind: str = "run directory", mark: str = "results.db"
) -> None:
    """Refuse a folder that cannot be written to, or holds files of the user's own.

    Args:
        path: the folder, there or not; None is none.
        kind: as for `check_folder`.
        mark: the same.

    Raises:
        InvalidInputError: naming the path and what is wrong with it.
    """
    if path is None:
        return
    from pushplan.errors import InvalidInputError
    from pushplan.files.output_files import check_folder

    folder = Path(path).absolute()
    # the folders that are missing will be made in the last one that is there
    there = next(one for one in (folder, *folder.parents) if one.exists())
    if not there.is_dir():
        raise InvalidInputError(f"cannot use {path!r} as a folder: {there} is a file")
    if not _takes_files(there):
        raise InvalidInputError(f"cannot use {path!r} as a folder: {there} takes no new files")
    check_folder(path, kind, mark)


def _takes_files(folder: Path) -> bool:
    """Return True if files can be created in a folder: on some disks only a try can tell."""
    try:
        with tempfile.TemporaryDirectory(prefix=".pushplan-", dir=folder):
            return True
    except OSError:
        return False
