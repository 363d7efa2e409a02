"""A run directory: one SQLite file with the results, episode traces and failure notes beside it."""

from __future__ import annotations

import contextlib
import fcntl
import json
import sqlite3
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

from pushplan.evaluation.rows import ResultRow, Status, columns, csv_text
from pushplan.metrics import METRICS
from pushplan.world import InvalidInputError, SchemaError
from pushplan.world.files import write_atomic

SCHEMA = "pushplan-run/1"
DATABASE = "results.db"
REPORT = (
    *("report.html", "summary.md", "summary.csv", "differences.csv"),
    *("tradeoff.png", "scores.png", "planning_time.png"),
)
"""Files that `Results.report` derives from the rows, beside ``results.csv``."""
_TYPES = dict.fromkeys(("policy", "task", "simulator", "scenario", "status", "reason"), "TEXT")
_TYPES |= dict.fromkeys(("seed", "success", "plan_calls"), "INTEGER")


class RunDirectory:
    """The one writer of a run directory. Safe against being killed at any instant.

    Raises:
        InvalidInputError: if another process is writing there.
        SchemaError: if the folder holds results of another version.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        try:
            self.episodes.mkdir(parents=True, exist_ok=True)
            self.failures.mkdir(exist_ok=True)
        except OSError as error:
            raise InvalidInputError(f"cannot use {path} as a run directory: {error}") from error
        self._lock = (self.path / ".lock").open("w")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            self._lock.close()
            raise InvalidInputError(f"another process is writing into {path}") from error
        for leftover in [*self.path.glob("*.tmp"), *self.episodes.glob("*.tmp")]:
            leftover.unlink()
        self._db = _connect(self.path / DATABASE)
        names = columns()
        kinds = ", ".join(f'"{name}" {_type(name)}' for name in names)
        with self._db:
            self._db.execute(
                f"CREATE TABLE IF NOT EXISTS results ({kinds}, "
                "PRIMARY KEY (policy, scenario, seed)) WITHOUT ROWID"
            )
            self._db.execute("CREATE TABLE IF NOT EXISTS about (key TEXT PRIMARY KEY, value TEXT)")
            for name in names:  # a run that an earlier version began
                if name not in _columns(self._db):
                    self._db.execute(f'ALTER TABLE results ADD COLUMN "{name}" {_type(name)}')

    def __enter__(self) -> RunDirectory:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    @property
    def episodes(self) -> Path:
        """Folder of the recorded episodes."""
        return self.path / "episodes"

    @property
    def failures(self) -> Path:
        """Folder of the tracebacks of failed jobs."""
        return self.path / "failures"

    def configure(self, configuration: Mapping[str, Any], policies: Mapping[str, str]) -> None:
        """Note what the run is, or check that it is the run that was begun here.

        Policies may be added to a run; a label may not change its meaning.

        Args:
            configuration: everything that results depend on; JSON values.
            policies: label -> identity of its source.

        Raises:
            InvalidInputError: if something differs; the message says what.
        """
        known = read_about(self._db)
        before = known.get("configuration")
        if before is not None:
            for key in sorted({*before, *configuration}):
                old, new = before.get(key), json.loads(json.dumps(configuration.get(key)))
                if old != new:
                    raise self._differs(key, old, new)
        sources = dict(known.get("policies", {}))
        for label, source in policies.items():
            if sources.setdefault(label, source) != source:
                raise self._differs(f"policy {label!r}", sources[label], source)
        self.note("schema", SCHEMA)
        self.note("configuration", dict(configuration))
        self.note("policies", sources)

    def _differs(self, key: str, old: object, new: object) -> InvalidInputError:
        return InvalidInputError(
            f"{self.path} holds a run with another configuration: {key} was {old!r}, is now "
            f"{new!r}; choose another directory, or the old value to continue that run"
        )

    def note(self, key: str, value: Any) -> None:
        """Keep a JSON value about the run."""
        with self._db:
            self._db.execute("INSERT OR REPLACE INTO about VALUES (?, ?)", (key, json.dumps(value)))

    def extend(self, key: str, entries: Mapping[str, str]) -> None:
        """Add entries to a JSON mapping about the run."""
        self.note(key, {**read_about(self._db).get(key, {}), **entries})

    def append(self, key: str, value: Any) -> None:
        """Add a value to a JSON list about the run."""
        self.note(key, [*read_about(self._db).get(key, []), value])

    def done(self) -> set[tuple[str, str, int]]:
        """(policy, scenario, seed) of every job that has a row."""
        return set(self._db.execute("SELECT policy, scenario, seed FROM results"))

    def add(self, row: ResultRow, trace: bytes | None = None, detail: str = "") -> None:
        """Store what became of one job, in one transaction."""
        if trace is not None:
            write_atomic(self.path / row.trace_file, trace)
        if detail:
            write_atomic(self.failures / f"{row.file_stem}.txt", detail.encode(errors="replace"))
        marks = ", ".join("?" * len(columns()))
        names = ", ".join(f'"{name}"' for name in columns())
        values = [getattr(row, name) for name in columns()]
        with self._db:
            self._db.execute(f"INSERT OR REPLACE INTO results ({names}) VALUES ({marks})", values)

    def forget_failures(self) -> None:
        """Remove the rows of jobs that did not end by the rules of their task."""
        with self._db:
            self._db.execute("DELETE FROM results WHERE status != ?", (str(Status.DONE),))

    def rows(self) -> list[ResultRow]:
        """All rows, sorted."""
        return read_rows(self._db)

    def write_csv(self) -> Path:
        """Write ``results.csv`` from the database; a report of other rows is removed."""
        path = self.path / "results.csv"
        text = rows_csv(self.rows()).encode()
        if not path.is_file() or path.read_bytes() != text:
            for name in REPORT:
                (self.path / name).unlink(missing_ok=True)
            write_atomic(path, text)
        return path

    def close(self) -> None:
        """Fold the write-ahead log into the database file and let others write."""
        with contextlib.suppress(sqlite3.Error):
            self._db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        self._db.close()
        self._lock.close()


def open_results(path: str | Path) -> tuple[list[ResultRow], Mapping[str, Any]]:
    """Read the rows of a run directory, and what was noted about the run.

    Raises:
        InvalidInputError: if there are no results.
    """
    file = Path(path) / DATABASE
    if not file.is_file():
        raise InvalidInputError(f"{path} holds no results: there is no {file.name} in it")
    db = _connect(file)
    try:
        return read_rows(db), read_about(db)
    except sqlite3.Error as error:
        raise SchemaError(f"{file} holds no readable results: {error}") from error
    finally:
        db.close()


def read_rows(db: sqlite3.Connection) -> list[ResultRow]:
    """All rows of a database, sorted; a column that it lacks is empty."""
    there = [name for name in columns() if name in _columns(db)]
    names = ", ".join(f'"{name}"' for name in there)
    query = f"SELECT {names} FROM results ORDER BY policy, task, simulator, seed, scenario"
    rows = []
    for values in db.execute(query):
        data = dict(zip(there, values, strict=True))
        data["success"] = bool(data["success"])
        rows.append(ResultRow.from_columns(data))
    return rows


def _type(column: str) -> str:
    whole = column in METRICS and METRICS[column].whole
    return _TYPES.get(column, "INTEGER" if whole else "REAL")


def _columns(db: sqlite3.Connection) -> set[str]:
    return {row[1] for row in db.execute("PRAGMA table_info(results)")}


def read_about(db: sqlite3.Connection) -> dict[str, Any]:
    """What was noted about a run."""
    about = {key: json.loads(value) for key, value in db.execute("SELECT key, value FROM about")}
    if about.get("schema", SCHEMA) != SCHEMA:
        raise SchemaError(f"this pushplan reads schema {SCHEMA!r}, got {about['schema']!r}")
    return about


def rows_csv(rows: Iterable[ResultRow]) -> str:
    """The rows as CSV with a header."""
    names = columns()
    return csv_text(names, ([_cell(getattr(row, name)) for name in names] for row in rows))


def _cell(value: object) -> object:
    if value is None:
        return ""
    if isinstance(value, bool):
        return int(value)
    return repr(value) if isinstance(value, float) else value


def _connect(path: Path) -> sqlite3.Connection:
    try:
        db = sqlite3.connect(path, timeout=30.0)
        db.execute("PRAGMA journal_mode=WAL")
        db.execute("PRAGMA synchronous=NORMAL")
    except sqlite3.Error as error:
        raise SchemaError(f"cannot open {path}: {error}") from error
    return db
