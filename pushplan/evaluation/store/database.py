"""The database of a run directory: its tables, and how rows are written and read."""

from __future__ import annotations

import json
import math
import os
import re
import sqlite3
import stat
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pushplan.errors import describe, one_line, short
from pushplan.evaluation.store.provenance import in_words
from pushplan.evaluation.store.rows import ResultRow, checked_row, column_type, columns, moment
from pushplan.files.file_locks import is_locked
from pushplan.files.safe_files import MAX_TEXT, parse_json
from pushplan.world import InvalidInputError, PushplanError, SchemaError

SCHEMA = "pushplan-run/2"
DATABASE = "results.db"
LOCK = ".lock"
"""File in a run directory that its writer holds."""
WAIT_S = 30.0
"""Time for which a writer waits for another program that holds the database [s]."""
_UNLOCKED = "&vfs=unix-none"
"""Option of SQLite for a disk without locks, or without the file that readers of a log share."""
_TYPES = {"str": "TEXT", "bool": "INTEGER", "int": "INTEGER", "float": "REAL"}
_TABLES = """
CREATE TABLE IF NOT EXISTS about (key TEXT PRIMARY KEY, value TEXT);
CREATE TABLE IF NOT EXISTS results ({columns}, spec TEXT, current INTEGER, PRIMARY KEY (job));
CREATE INDEX IF NOT EXISTS shown ON results (policy, scenario, seed);
CREATE TABLE IF NOT EXISTS measured
    (job TEXT, metric TEXT, source TEXT, value REAL, PRIMARY KEY (job, metric)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS running (job TEXT PRIMARY KEY, title TEXT, began REAL);
"""
_KEY = r"PRIMARY KEY \((?:\w+, )*\w+\)"
_COLUMN = r'(?:"\w+"|\w+) (?:TEXT|INTEGER|REAL)(?: PRIMARY KEY)?'
_TABLE = r'CREATE TABLE "?(?:about|results|measured|running)"? ?'
_PLAIN = re.compile(
    rf"{_TABLE}\((?:{_COLUMN}, )*(?:{_COLUMN}|{_KEY})\)(?: WITHOUT ROWID)?|"
    r"CREATE INDEX shown ON results \(policy, scenario, seed\)|sqlite_autoindex_\w+"
)
"""Definitions of our tables: plain columns, nothing that SQLite would compute."""
_STEPS = 10_000
_LEAST_STEPS = 5_000_000
_STEPS_PER_BYTE = 50
"""Instructions of SQLite for each byte on the disk: reading all rows takes fewer than ten."""
_NOT_NOW = ("BUSY", "LOCKED", "FULL", "IOERR", "READONLY", "CANTOPEN", "PERM", "PROTOCOL", "AUTH")
_NOTES = {
    **dict.fromkeys(("policies", "settings", "deadlines", "configuration"), dict),
    **dict.fromkeys(("runs", "metrics"), list),
}
"""Notes on a run that are read, and their types."""


def database_of(path: str | Path) -> Path:
    """The database of a run directory.

    Raises:
        InvalidInputError: if there is none.
        DamagedResultsError: if it, or a file that SQLite would use with it, is none of ours.
    """
    file = Path(path) / DATABASE
    if not os.path.lexists(file):
        raise InvalidInputError(f"{path} holds no results: there is no {DATABASE} in it")
    for ending in ("", "-wal", "-shm"):
        part = file.with_name(DATABASE + ending)
        if os.path.lexists(part) and not stat.S_ISREG(part.lstat().st_mode):
            raise _damaged(file, f"{part.name} is no regular file")
    # a journal can make SQLite remove any file, and we never write one
    if os.path.lexists(file.with_name(f"{DATABASE}-journal")):
        raise _damaged(file, f"there is a {DATABASE}-journal")
    return file


class DamagedResultsError(SchemaError):
    """The database of a run directory is torn, or holds what no run wrote."""


@contextmanager
def clear_errors(path: Path) -> Iterator[None]:
    """Let what goes wrong with a run directory's database be one clear line.

    Raises:
        InvalidInputError: if it cannot be used now: locked, no space, no right.
        DamagedResultsError: if it is damaged.
    """
    try:
        yield
    except PushplanError:
        raise
    except (sqlite3.Error, OSError, KeyError, TypeError, ValueError, OverflowError) as error:
        name = getattr(error, "sqlite_errorname", "").removeprefix("SQLITE_")
        if isinstance(error, OSError) or name.startswith(_NOT_NOW):
            raise InvalidInputError(
                f"cannot use {path}: {error}; what was stored is kept, and the same command goes on"
            ) from error
        raise _damaged(path, describe(error)) from error


def _damaged(path: Path, why: str) -> DamagedResultsError:
    return DamagedResultsError(
        f"{path} is damaged ({why}): 'pushplan runs salvage {path.parent} NEW' saves what can be "
        "read"
    )


def new_database() -> bytes:
    """The file of a database without results, to be put in place whole."""
    with closing(sqlite3.connect(":memory:")) as db:
        _create(db)
        data = bytearray(db.serialize())
    data[18:20] = b"\2\2"  # it has a write-ahead log: section 1.3.3 of SQLite's file format
    return bytes(data)


def connect(path: Path) -> sqlite3.Connection:
    """Open the database of a run directory to write, check it, add the columns that it lacks.

    Raises:
        SchemaError: if it is damaged or of another version.
        InvalidInputError: if it cannot be written.
    """
    with clear_errors(path):
        db = open_checked(path, "rw")
        try:
            read_about(db)
            db.execute("PRAGMA synchronous=NORMAL")
            ((verdict,),) = db.execute("PRAGMA quick_check(1)")
            if verdict != "ok":
                raise sqlite3.DatabaseError(verdict)
            _create(db)
            db.set_progress_handler(None, 0)
        except BaseException:
            db.close()
            raise
    return db


@contextmanager
def reading(path: str | Path) -> Iterator[sqlite3.Connection]:
    """The database of a run directory, perhaps on a disk that cannot be written.

    Raises:
        InvalidInputError: if there are no results.
        SchemaError: if it is damaged or of another version.
    """
    file = database_of(path)
    with clear_errors(file), closing(open_checked(file)) as db:
        read_about(db)
        yield db


def open_checked(path: Path, mode: str = "ro") -> sqlite3.Connection:
    """Open a database that a stranger may have written, with bounds on its values and its work.

    Args:
        path: the database.
        mode: ``"ro"`` to read, ``"rw"`` to write, too.

    Raises:
        sqlite3.Error: if it cannot be read.
        SchemaError: if it holds other tables than a run makes, or anything that is no table.
    """
    ways = [_UNLOCKED]
    if is_locked(path.with_name(LOCK), posix=True) is not None:
        ways = ["", *ways] if mode == "ro" else [""]
    if mode == "ro" and not path.with_name(f"{path.name}-wal").exists():
        ways.append("&immutable=1")  # on a disk that cannot be written
    for way in ways[:-1]:
        with suppress(sqlite3.OperationalError):
            return _checked(path, mode, way)
    return _checked(path, mode, ways[-1])


def _checked(path: Path, mode: str, way: str) -> sqlite3.Connection:
    uri = f"{path.absolute().as_uri()}?mode={mode}{way}"
    db = sqlite3.connect(uri, uri=True, timeout=WAIT_S)
    try:
        if way:
            db.execute("PRAGMA locking_mode=EXCLUSIVE")
        db.row_factory = sqlite3.Row
        db.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_TEXT)
        room = _LEAST_STEPS + _STEPS_PER_BYTE * 512 * path.stat().st_blocks
        steps = iter(range(room // _STEPS))
        db.set_progress_handler(lambda: next(steps, None) is None, _STEPS)
        db.execute("PRAGMA trusted_schema=OFF")
        # an index that SQLite makes itself has no text
        for name, sql in db.execute("SELECT name, coalesce(sql, name) FROM sqlite_master"):
            if not _PLAIN.fullmatch(" ".join(str(sql).split())):
                raise _damaged(path, f"it holds what no run makes: {short(name)}")
    except BaseException:
        db.close()
        raise
    return db


def _create(db: sqlite3.Connection) -> None:
    """Make the tables, or add the columns of metrics that have come since they were made."""
    kinds = {name: f'"{name}" {_TYPES[column_type(name)]}' for name in columns()}
    db.executescript(_TABLES.format(columns=", ".join(kinds.values())))
    with db:
        there = {name for _, name, *_ in db.execute("PRAGMA table_info(results)")}
        for name, kind in kinds.items():
            if name not in there:
                db.execute(f"ALTER TABLE results ADD COLUMN {kind}")
        db.execute("INSERT OR REPLACE INTO about VALUES ('schema', ?)", (json.dumps(SCHEMA),))


def insert(db: sqlite3.Connection, row: ResultRow, spec: Mapping[str, Any]) -> None:
    """Add a row that does not count yet, or replace that of its job."""
    names = columns()
    listed = ", ".join(f'"{name}"' for name in names)
    marks = "?, " * len(names)
    values = [getattr(row, name) for name in names]
    db.execute(
        f"INSERT OR REPLACE INTO results ({listed}, spec, current) VALUES ({marks}?, 0)",
        (*values, json.dumps(spec)),
    )


@dataclass(frozen=True)
class StoredResult:
    """A result as it is stored.

    Attributes:
        row: the row.
        spec: what `job_spec` said about its job.
        current: it is the one that counts for its policy and scenario.
        measured: metric, its source and its value, of metrics that are no columns.
    """

    row: ResultRow
    spec: Mapping[str, Any]
    current: bool
    measured: tuple[tuple[str, str, float | None], ...] = ()


def read_results(db: sqlite3.Connection) -> list[StoredResult]:
    """Every result, also those that do not count now."""
    measured = _measured(db)
    found = db.execute("SELECT * FROM results ORDER BY job")
    return [result_of(dict(values), measured.get(values["job"], ())) for values in found]


def result_of(
    values: Mapping[str, Any], measured: Sequence[tuple[str, str, float | None]] = ()
) -> StoredResult:
    """The result that the database holds, by column.

    Raises:
        KeyError, TypeError, ValueError: if it can be none.
    """
    spec = _json(values["spec"])
    if not isinstance(spec, dict):
        raise TypeError(f"spec is {short(spec)}")
    return StoredResult(_row_of(values), spec, bool(values["current"]), tuple(measured))


def read_rows(db: sqlite3.Connection) -> list[ResultRow]:
    """All rows that count, sorted; a column that the database lacks is empty."""
    order = "policy, task, simulator, seed, scenario"
    found = db.execute(f"SELECT * FROM results WHERE current ORDER BY {order}")
    return [_row_of(dict(values)) for values in found]


def read_left_out(db: sqlite3.Connection) -> dict[str, int]:
    """Policy -> scenarios and seeds of which it has results, none of which counts."""
    key = "policy, scenario, seed"
    others = f"SELECT {key} FROM results EXCEPT SELECT {key} FROM results WHERE current"
    found = db.execute(f"SELECT policy, count(*) FROM ({others}) GROUP BY policy")
    return {one_line(str(policy)): count for policy, count in found}


def read_measured(db: sqlite3.Connection) -> dict[str, dict[str, float]]:
    """Job -> its metrics that are no columns."""
    return {
        job: {metric: value for metric, _, value in values if value is not None}
        for job, values in _measured(db).items()
    }


def _measured(db: sqlite3.Connection) -> dict[str, list[tuple[str, str, float | None]]]:
    found: dict[str, list[tuple[str, str, float | None]]] = {}
    for job, metric, source, value in db.execute("SELECT job, metric, source, value FROM measured"):
        if not isinstance(metric, str) or not isinstance(value, int | float | None):
            raise TypeError(f"metric {short(metric)} is {short(value)}")
        found.setdefault(job, []).append((metric, source, value))
    return found


def _row_of(values: Mapping[str, Any]) -> ResultRow:
    found = {name: values[name] for name in columns() if name in values}
    success = {0: False, 1: True}[values["success"]]
    return checked_row(ResultRow.from_columns({**found, "success": success}))


def read_about(db: sqlite3.Connection) -> dict[str, Any]:
    """Read the notes about a run.

    Raises:
        SchemaError: if it is of another version, or a note is none that can be read.
    """
    found = db.execute("SELECT key, value FROM about")
    about = {key: _json(value) for key, value in found}
    if about.get("schema") != SCHEMA:
        raise SchemaError(
            f"this pushplan reads runs of schema {SCHEMA!r}, got {short(about.get('schema'))}: "
            "read its results.csv, or run it again in another directory"
        )
    for key, kind in _NOTES.items():
        values = about.get(key, kind())
        if not isinstance(values, kind):
            raise TypeError(f"the note {key!r} is {short(values)}")
        for value in values.values() if isinstance(values, dict) else values:
            known = key == "configuration" or isinstance(value, str)
            if key == "runs":
                known = isinstance(value, dict) and isinstance(value["packages"], dict)
                known = known and bool(in_words(value))  # it reads all that others read
                known = known and {type(value.get(name, 0)) for name in ("jobs", "done")} == {int}
                moment(value["began"])
            elif key == "deadlines":
                known = type(value) in (int, float) and math.isfinite(value)
            if not known:
                raise TypeError(f"the note {key!r} holds {short(value)}")
    return about


def _json(text: object) -> Any:
    """The values of a text in JSON.

    Raises:
        TypeError, ValueError: if it is none, or over a limit of `parse_json`.
    """
    if not isinstance(text, str):
        raise TypeError(f"{short(text)} is no JSON")
    try:
        return parse_json(text)
    except SchemaError as error:
        raise ValueError(f"{error}") from error
