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

from pushplan.evaluation.database import (
    DATABASE,
    columns_of,
    database_of,
    open_checked,
    read_about,
    read_spec,
    row_of,
)
from pushplan.evaluation.rows import ResultRow, columns, csv_lines, row_from_texts
from pushplan.evaluation.store import RunDirectory, files_of
from pushplan.world import InvalidInputError, SchemaError

_MISSES = 2000  # so many row numbers without a row in turn: there are no more
_BAD = (sqlite3.Error, KeyError, TypeError, ValueError, OverflowError)


@dataclass(frozen=True)
class Salvaged:
    """What `salvage` saved.

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
    found = {row.job: (row, spec, shown) for row, spec, shown in _from_database(path / DATABASE)}
    of_database = len(found)
    for row in _from_csv(path / "results.csv"):
        found.setdefault(row.job, (row, {}, True))
    without = []
    with RunDirectory(out) as store:
        for key, value in _notes(path / DATABASE).items():
            store.note(key, value)
        for row, spec, shown in found.values():
            trace, detail = files_of(path, row)
            if row.trace and trace is None:
                without.append(row.job)
            store.add(replace(row, trace=""), trace, detail, spec, show=shown)
        store.write_csv()
    return Salvaged(len(found), len(found) - of_database, tuple(without))


def _from_database(file: Path) -> Iterator[tuple[ResultRow, dict[str, Any], bool]]:
    """Each row by its number: one that cannot be read costs no other."""
    with contextlib.suppress(*_BAD), contextlib.closing(_opened(file)) as db:
        names = [name for name in columns() if name in columns_of(db)]
        listed = ", ".join(f'"{name}"' for name in names)
        query = f"SELECT {listed}, spec, current FROM results WHERE rowid = ?"
        misses = number = 0
        while misses < _MISSES:
            number, misses = number + 1, misses + 1
            with contextlib.suppress(*_BAD):
                for *values, spec, current in db.execute(query, (number,)):
                    misses = 0
                    row = row_of(dict(zip(names, values, strict=True)))
                    yield row, read_spec(spec), bool(current)


def _opened(file: Path) -> sqlite3.Connection:
    return open_checked(database_of(file.parent))


def _from_csv(file: Path) -> Iterator[ResultRow]:
    with contextlib.suppress(csv.Error, SchemaError):
        for line in csv_lines(file):
            with contextlib.suppress(*_BAD):
                yield row_from_texts(line)


def _notes(file: Path) -> dict[str, Any]:
    with contextlib.suppress(*_BAD), contextlib.closing(_opened(file)) as db:
        return {key: value for key, value in read_about(db).items() if key != "schema"}
    return {}
