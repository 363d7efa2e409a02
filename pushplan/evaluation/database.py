"""The database of a run directory: its tables, and how rows are written and read."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pushplan.evaluation.rows import ResultRow, checked_row, columns
from pushplan.metrics import METRICS
from pushplan.world import InvalidInputError, PushplanError, SchemaError
from pushplan.world.errors import describe

SCHEMA = "pushplan-run/2"
DATABASE = "results.db"
WAIT_S = 30.0
"""How long a writer waits for another program that holds the database [s]."""
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
    except (sqlite3.OperationalError, OSError) as error:
        if "malformed" in str(error):
            raise _damaged(path, error) from error
        raise InvalidInputError(
            f"cannot use {path}: {error}; what was stored is kept, and the same command goes on"
        ) from error
    except (sqlite3.Error, KeyError, TypeError, ValueError, OverflowError) as error:
        raise _damaged(path, error) from error


def _damaged(path: Path, error: BaseException) -> DamagedResultsError:
    return DamagedResultsError(
        f"{path} is damaged ({describe(error)}): 'pushplan salvage {path.parent} NEW' saves what "
        "can be read"
    )


def connect(path: Path) -> sqlite3.Connection:
    """Open the database of a run directory, make its tables where they are missing, check it.

    Raises:
        SchemaError: if it is damaged or of another version.
        InvalidInputError: if it cannot be written.
    """
    db = None
    with clear_errors(path):
        try:
            db = sqlite3.connect(path, timeout=WAIT_S)
            db.execute("PRAGMA journal_mode=WAL")
            db.execute("PRAGMA synchronous=NORMAL")
            ((verdict,),) = db.execute("PRAGMA quick_check(1)")
            if verdict != "ok":
                raise sqlite3.DatabaseError(verdict)
            _create(db)
            return db
        except BaseException:
            if db is not None:
                db.close()
            raise
    raise AssertionError("unreachable")


@contextmanager
def reading(path: str | Path) -> Iterator[sqlite3.Connection]:
    """The database of a run directory, perhaps on a disk that cannot be written.

    Raises:
        InvalidInputError: if there are no results.
        SchemaError: if it is damaged or of another version.
    """
    file = database_of(path)
    with clear_errors(file), closing(_connect_to_read(file)) as db:
        read_about(db)
        yield db


def _connect_to_read(path: Path) -> sqlite3.Connection:
    uri = path.absolute().as_uri()
    db = sqlite3.connect(f"{uri}?mode=ro", uri=True, timeout=WAIT_S)
    try:
        db.execute("SELECT name FROM sqlite_master").fetchall()
        return db
    except sqlite3.OperationalError:  # the log beside it needs a file that cannot be made here
        db.close()
        return sqlite3.connect(f"{uri}?immutable=1", uri=True)


def _create(db: sqlite3.Connection) -> None:
    """Make the tables, or add the columns of metrics that have come since they were made."""
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
        yield checked_row(ResultRow.from_columns(data)), *values[len(there) :]


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
