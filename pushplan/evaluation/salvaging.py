"""Save what can be read of a damaged run directory."""

from __future__ import annotations

import contextlib
import csv
import json
import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pushplan.evaluation.database import DATABASE, read_about
from pushplan.evaluation.rows import ResultRow, checked_row, columns, row_from_texts
from pushplan.evaluation.store import RunDirectory, trace_digest
from pushplan.world import InvalidInputError

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
    if (Path(out) / DATABASE).exists():
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
            trace = _trace(path, row)
            if row.trace and trace is None:
                without.append(row.job)
            note = path / row.detail_file
            detail = note.read_text(errors="replace") if note.is_file() else ""
            store.add(replace(row, trace=""), trace, detail, spec, show=shown)
        store.write_csv()
    return Salvaged(len(found), len(found) - of_database, tuple(without))


def _from_database(file: Path) -> Iterator[tuple[ResultRow, dict[str, Any], bool]]:
    """Each row by its number: one that cannot be read costs no other."""
    if not file.is_file():
        return
    uri = f"{file.absolute().as_uri()}?mode=ro"
    with contextlib.suppress(*_BAD), contextlib.closing(sqlite3.connect(uri, uri=True)) as db:
        there = {name for _, name, *_ in db.execute("PRAGMA table_info(results)")}
        names = [name for name in columns() if name in there]
        listed = ", ".join(f'"{name}"' for name in names)
        query = f"SELECT {listed}, spec, current FROM results WHERE rowid = ?"
        misses = number = 0
        while misses < _MISSES:
            number, misses = number + 1, misses + 1
            with contextlib.suppress(*_BAD):
                for *values, spec, current in db.execute(query, (number,)):
                    data = dict(zip(names, values, strict=True))
                    data["success"] = bool(data["success"])
                    misses = 0
                    yield checked_row(ResultRow.from_columns(data)), json.loads(spec), bool(current)


def _from_csv(file: Path) -> Iterator[ResultRow]:
    if not file.is_file():
        return
    with file.open(newline="", errors="replace") as lines, contextlib.suppress(csv.Error):
        for line in csv.DictReader(lines):
            with contextlib.suppress(*_BAD, AttributeError):
                yield row_from_texts(line)


def _notes(file: Path) -> dict[str, Any]:
    with contextlib.suppress(*_BAD):
        uri = f"{file.absolute().as_uri()}?mode=ro"
        with contextlib.closing(sqlite3.connect(uri, uri=True)) as db:
            return {key: value for key, value in read_about(db).items() if key != "schema"}
    return {}


def _trace(path: Path, row: ResultRow) -> bytes | None:
    """The recorded episode of a row, if it is whole."""
    file = None if row.trace_file is None else path / row.trace_file
    if file is None or not file.is_file():
        return None
    trace = file.read_bytes()
    return trace if trace_digest(trace) == row.trace else None
