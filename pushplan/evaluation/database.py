"""The database of a run directory: its tables, and how rows are written and read."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pushplan.evaluation.rows import ResultRow, columns
from pushplan.metrics import METRICS
from pushplan.world import InvalidInputError, SchemaError

SCHEMA = "pushplan-run/2"
DATABASE = "results.db"
HIDE_OTHERS = (
    "UPDATE results SET current = (job = ?) WHERE (policy, scenario, seed) = "
    "(SELECT policy, scenario, seed FROM results WHERE job = ?)"
)
"""Let the result of one job be the one that counts for its policy and scenario."""
_TEXTS = "policy task simulator scenario status reason began host job trace"
_TYPES = dict.fromkeys(_TEXTS.split(), "TEXT")
_TYPES |= dict.fromkeys(("seed", "success", "plan_calls"), "INTEGER")
_TABLES = """
CREATE TABLE IF NOT EXISTS results ({columns}, spec TEXT, current INTEGER, PRIMARY KEY (job));
CREATE INDEX IF NOT EXISTS shown ON results (policy, scenario, seed);
CREATE TABLE IF NOT EXISTS measured
    (job TEXT, metric TEXT, source TEXT, value REAL, PRIMARY KEY (job, metric)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS running (job TEXT PRIMARY KEY, title TEXT, began REAL);
"""


def database_of(path: str | Path) -> Path:
    """The database of a run directory.

    Raises:
        InvalidInputError: if there is none.
    """
    file = Path(path) / DATABASE
    if not file.is_file():
        raise InvalidInputError(f"{path} holds no results: there is no {DATABASE} in it")
    return file


def connect(path: Path) -> sqlite3.Connection:
    """Open the database of a run directory.

    Raises:
        SchemaError: if that fails.
    """
    try:
        db = sqlite3.connect(path, timeout=30.0)
        db.execute("PRAGMA journal_mode=WAL")
        db.execute("PRAGMA synchronous=NORMAL")
    except sqlite3.Error as error:
        raise SchemaError(f"cannot open {path}: {error}") from error
    return db


def connect_to_read(path: Path) -> sqlite3.Connection:
    """Open the database of a run directory, perhaps on a disk that cannot be written.

    Raises:
        SchemaError: if that fails.
    """
    uri = path.absolute().as_uri()
    for mode in ("mode=ro", "immutable=1"):  # reading a log beside it needs a file to share
        db = sqlite3.connect(f"{uri}?{mode}", uri=True, timeout=30.0)
        try:
            db.execute("SELECT name FROM sqlite_master").fetchall()
            return db
        except sqlite3.Error as error:
            failure = error
            db.close()
    raise SchemaError(f"cannot open {path}: {failure}")


def create(db: sqlite3.Connection) -> None:
    """Make the tables, or add the columns of metrics that have come since they were made.

    Raises:
        SchemaError: if the database is of another version.
    """
    names = columns()
    kinds = ", ".join(f'"{name}" {_type(name)}' for name in names)
    with db:
        db.execute("CREATE TABLE IF NOT EXISTS about (key TEXT PRIMARY KEY, value TEXT)")
        read_about(db)
    db.executescript(_TABLES.format(columns=kinds))
    with db:
        for name in names:
            if name not in _columns(db):
                db.execute(f'ALTER TABLE results ADD COLUMN "{name}" {_type(name)}')
        db.execute("INSERT OR REPLACE INTO about VALUES ('schema', ?)", (json.dumps(SCHEMA),))


def insert(db: sqlite3.Connection, row: ResultRow, spec: str, current: int = 0) -> None:
    """Add a row, or replace that of its job."""
    names = columns()
    listed = ", ".join(f'"{name}"' for name in names)
    marks = ", ".join("?" * (len(names) + 2))
    values = [getattr(row, name) for name in names]
    db.execute(
        f"INSERT OR REPLACE INTO results ({listed}, spec, current) VALUES ({marks})",
        (*values, spec, current),
    )


@dataclass(frozen=True)
class StoredResult:
    """A result as it is stored.

    Attributes:
        row: the row.
        spec: what `job_spec` said about its job.
        current: whether it is the one that counts for its policy and scenario.
        measured: metric, its source and its value, of metrics that are no columns.
    """

    row: ResultRow
    spec: Mapping[str, Any]
    current: bool
    measured: tuple[tuple[str, str, float | None], ...] = ()


def read_results(db: sqlite3.Connection) -> list[StoredResult]:
    """Every result, also those that do not count now."""
    measured: dict[str, list[tuple[str, str, float | None]]] = {}
    for job, *value in db.execute("SELECT job, metric, source, value FROM measured"):
        measured.setdefault(job, []).append((value[0], value[1], value[2]))
    return [
        StoredResult(row, json.loads(spec), bool(current), tuple(measured.get(row.job, ())))
        for row, spec, current in _rows(db, "spec, current", "ORDER BY job")
    ]


def read_rows(db: sqlite3.Connection) -> list[ResultRow]:
    """All rows that count, sorted; a column that the database lacks is empty."""
    order = "WHERE current ORDER BY policy, task, simulator, seed, scenario"
    return [row for row, _ in _rows(db, "1", order)]


def read_measured(db: sqlite3.Connection) -> dict[str, dict[str, float]]:
    """Job -> its metrics that are no columns."""
    found: dict[str, dict[str, float]] = {}
    for job, metric, value in db.execute("SELECT job, metric, value FROM measured"):
        if value is not None:
            found.setdefault(job, {})[metric] = value
    return found


def _rows(db: sqlite3.Connection, more: str, rest: str) -> Iterator[tuple[Any, ...]]:
    there = [name for name in columns() if name in _columns(db)]
    names = ", ".join(f'"{name}"' for name in there)
    for values in db.execute(f"SELECT {names}, {more} FROM results {rest}"):
        data = dict(zip(there, values, strict=False))
        data["success"] = bool(data["success"])
        yield ResultRow.from_columns(data), *values[len(there) :]


def _type(column: str) -> str:
    whole = column in METRICS and METRICS[column].whole
    return _TYPES.get(column, "INTEGER" if whole else "REAL")


def _columns(db: sqlite3.Connection) -> set[str]:
    return {row[1] for row in db.execute("PRAGMA table_info(results)")}


def read_about(db: sqlite3.Connection) -> dict[str, Any]:
    """What was noted about a run."""
    about = {key: json.loads(value) for key, value in db.execute("SELECT key, value FROM about")}
    if about.get("schema", SCHEMA) != SCHEMA:
        raise SchemaError(
            f"this pushplan reads runs of schema {SCHEMA!r}, got {about['schema']!r}: read its "
            "results.csv, or run it again in another directory"
        )
    return about
