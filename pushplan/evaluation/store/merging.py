"""Run directories made of others: those of several machines joined, a damaged one salvaged."""

from __future__ import annotations

import contextlib
import csv
import os
import sqlite3
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pushplan.evaluation.store.database import (
    DATABASE,
    StoredResult,
    database_of,
    open_checked,
    read_about,
    read_results,
    reading,
    result_of,
)
from pushplan.evaluation.store.rows import (
    TIMING_COLUMNS,
    ResultRow,
    columns,
    csv_lines,
    row_from_texts,
)
from pushplan.evaluation.store.run_directory import RunDirectory, files_of
from pushplan.world import InvalidInputError, SchemaError

_MISSES = 2000  # so many row numbers without a row in turn: there are no more
_BAD = (sqlite3.Error, KeyError, TypeError, ValueError, OverflowError)


@dataclass(frozen=True)
class Merged:
    """Result of `merge`.

    Attributes:
        added: results that were not there.
        known: results that were there already.
        differing: jobs, of those known, whose two results differ in more than times; the result
            that was there first is kept.
        incomplete: jobs that were left out because their recorded episode is missing or damaged.
    """

    added: int
    known: int
    differing: tuple[str, ...]
    incomplete: tuple[str, ...]


def merge(out: str | Path, sources: Sequence[str | Path]) -> Merged:
    """Take the results of run directories into another one, with their episodes and notes.

    Killed at any instant, it goes on when it is called again. Where two directories have results of
    one policy, scenario and seed that came about differently, those of the last one count.

    Args:
        out: run directory, new or with results of its own.
        sources: run directories; they are only read.

    Raises:
        InvalidInputError: if there is no source, one holds no results, or ``out`` is among them.
        SchemaError: if one cannot be read.
    """
    folders = [Path(source) for source in sources]
    if not folders:
        raise InvalidInputError("merge needs at least one run directory to read")
    for folder in folders:
        database_of(folder)
        if folder.resolve() == Path(out).resolve():
            raise InvalidInputError(f"{folder} cannot be merged into itself")
    added = 0
    known = 0
    differing: list[str] = []
    incomplete: list[str] = []
    with RunDirectory(out) as store:
        for folder in folders:
            with reading(folder) as db:
                there = {one.row.job: one.row for one in store.results()}
                for one in read_results(db):
                    if one.row.job in there:
                        known += 1
                        if _timeless(one.row) != _timeless(there[one.row.job]):
                            differing.append(one.row.job)
                        if one.current:
                            store.show(one.row.job)
                        continue
                    trace, detail = files_of(folder, one.row)
                    if one.row.trace and trace is None:  # its episode is not what its name says
                        incomplete.append(one.row.job)
                        continue
                    store.add(one.row, trace, detail, one.spec, show=one.current)
                    store.measure((one.row.job, *value) for value in one.measured)
                    added += 1
                _note(db, store)
        store.write_csv()
    return Merged(added, known, tuple(differing), tuple(incomplete))


def _note(db: sqlite3.Connection, store: RunDirectory) -> None:
    about = read_about(db)
    for key in ("policies", "settings"):
        store.extend(key, about.get(key, {}))
    mine = store.about()
    if "configuration" not in mine and "configuration" in about:
        store.note("configuration", about["configuration"])
    runs = [*mine.get("runs", []), *about.get("runs", [])]
    distinct = [run for index, run in enumerate(runs) if run not in runs[:index]]
    store.note("runs", sorted(distinct, key=lambda run: str(run["began"])))
    store.note("jobs", None)  # nobody has asked for all of them


def _timeless(row: ResultRow) -> list[object]:
    return [getattr(row, name) for name in columns() if name not in TIMING_COLUMNS]


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
