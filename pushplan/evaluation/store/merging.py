"""Join run directories, such as those of several machines."""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pushplan.evaluation.store.database import database_of, read_about, read_results, reading
from pushplan.evaluation.store.rows import TIMING_COLUMNS, ResultRow, columns
from pushplan.evaluation.store.run_directory import RunDirectory, files_of
from pushplan.world import InvalidInputError


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
