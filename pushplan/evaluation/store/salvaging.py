"""Save what can be read of a damaged run directory."""

from __future__ import annotations

import contextlib
import csv
import os
import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pushplan.evaluation.store.database import (
    DATABASE,
    StoredResult,
    database_of,
    open_checked,
    read_about,
    result_of,
)
from pushplan.evaluation.store.rows import ResultRow, csv_lines, row_from_texts
from pushplan.evaluation.store.run_directory import RunDirectory, files_of
from pushplan.world import InvalidInputError, SchemaError

_MISSES = 2000  # so many row numbers without a row in turn: there are no more
_BAD = (sqlite3.Error, KeyError, TypeError, ValueError, OverflowError)


@dataclass(frozen=True)
class Salvaged:
    """Result of `salvage`.

    Attributes:
        rows: results in the new directory.
        from_csv: how many of them come from ``results.csv`` only.
        without_episode: jobs whose recorded episode is missing or damaged.
    """

    rows: int
    from_csv: int
    without_episode: tuple[str, ...]


def salvage(path: str | Path, out: str | Path) -> Salvaged:
    """Copy every result that can still be read, from the database or ``results.csv``, and episodes.

    Args:
        path: the damaged run directory; it is only read.
        out: a folder that holds no run.

    Raises:
        InvalidInputError: if there is neither database nor ``results.csv``, or ``out`` is in use.
    """
    path = Path(path)
    if not (path / DATABASE).is_file() and not (path / "results.csv").is_file():
        raise InvalidInputError(f"{path} holds neither {DATABASE} nor results.csv")
    if os.path.lexists(Path(out) / DATABASE):
        raise InvalidInputError(f"{out} holds a run already: choose another folder")
    notes, found = _from_database(path)
    of_database = len(found)
    for row in _from_csv(path / "results.csv"):
        found.setdefault(row.job, StoredResult(row, {}, True))
    without = []
    with RunDirectory(out) as store:
        for key, value in notes.items():
            if key != "schema":
                store.note(key, value)
        for one in found.values():
            trace, detail = files_of(path, one.row)
            if one.row.trace and trace is None:
                without.append(one.row.job)
            store.add(replace(one.row, trace=""), trace, detail, one.spec, show=one.current)
        store.write_csv()
    return Salvaged(len(found), len(found) - of_database, tuple(without))


def _from_database(path: Path) -> tuple[dict[str, Any], dict[str, StoredResult]]:
    """Notes, and each row by its number: one that cannot be read costs no other."""
    notes: dict[str, Any] = {}
    found: dict[str, StoredResult] = {}
    with contextlib.suppress(*_BAD), contextlib.closing(open_checked(database_of(path))) as db:
        with contextlib.suppress(*_BAD):
            notes = read_about(db)
        misses = number = 0
        while misses < _MISSES:
            number += 1
            misses += 1
            with contextlib.suppress(*_BAD):
                for values in db.execute("SELECT * FROM results WHERE rowid = ?", (number,)):
                    misses = 0
                    one = result_of(dict(values))
                    found[one.row.job] = one
    return notes, found


def _from_csv(file: Path) -> Iterator[ResultRow]:
    with contextlib.suppress(csv.Error, SchemaError):
        for line in csv_lines(file):
            with contextlib.suppress(*_BAD):
                yield row_from_texts(line)
