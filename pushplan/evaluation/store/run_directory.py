"""A run directory: one SQLite file with the results, episode traces and failure notes beside it."""

from __future__ import annotations

import contextlib
import hashlib
import json
import logging
import os
import re
import sqlite3
import time
from collections.abc import Container, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from pushplan.evaluation.store.database import (
    DATABASE,
    LOCK,
    StoredResult,
    clear_errors,
    connect,
    database_of,
    insert,
    new_database,
    read_about,
    read_left_out,
    read_measured,
    read_results,
    read_rows,
    reading,
)
from pushplan.evaluation.store.rows import ResultRow, Status, rows_csv
from pushplan.files.file_locks import NO_FOLLOW, take_lock
from pushplan.files.output_files import TEMPORARY, check_folder, make_folder, write_atomic
from pushplan.files.safe_files import MAX_BYTES, read_bytes
from pushplan.world import InvalidInputError, SchemaError

_log = logging.getLogger(__name__)
_HIDE_OTHERS = (
    "UPDATE results SET current = (job = ?) WHERE (policy, scenario, seed) = "
    "(SELECT policy, scenario, seed FROM results WHERE job = ?)"
)
"""Let the result of one job be the one that counts for its policy and scenario."""
_MAX_DETAIL = 1_000_000  # bytes of a traceback
_EPISODE = re.compile(r"[0-9a-f]{32}\.npz(\.tmp)?")
"""Names of recorded episodes, and of those that version 0.2 left half written."""

REPORT = re.compile(
    r"report\.html|summary\.(md|csv)|differences\.csv|(paper|stress)\.md"
    r"|(intervals|tradeoff|scores|profiles|planning_time)\.(svg|pdf|png)"
)
"""Files that are derived from the rows, beside ``results.csv`` and those in ``replays``."""
_REPLAY = re.compile(r"[\w-]{1,64}\.js", re.ASCII)


def remove_report(folder: Path) -> None:
    """Remove what `Results.report` has written into a folder, so that it is not beside new rows."""
    _remove(folder, REPORT)
    _remove(folder / "replays", _REPLAY)


class RunDirectory:
    """The one writer of a run directory. Safe against being killed at any instant.

    Args:
        path: the folder.
        new: it may be one without results.

    Raises:
        InvalidInputError: if another process is writing there, or there are no results.
        SchemaError: if the folder holds results of another version.
    """

    def __init__(self, path: str | Path, *, new: bool = True) -> None:
        self.path = Path(path)
        if not new:
            database_of(path)
        check_folder(path, "run directory", DATABASE)
        file = self.path / DATABASE
        if os.path.lexists(file):
            with reading(path):  # nothing is made beside a database that no run wrote
                pass
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            flags = os.O_RDWR | os.O_CREAT | os.O_NONBLOCK | NO_FOLLOW
            self._lock = os.open(self.path / LOCK, flags, 0o644)
        except OSError as error:
            raise InvalidInputError(f"cannot use {path} as a run directory: {error}") from error
        try:
            _lock(self._lock, self.path)
            with clear_errors(self.path):
                if not os.path.lexists(file):  # the mark of a run directory comes first
                    write_atomic(file, new_database())
                _remove(self.path, TEMPORARY)
                for name in ("episodes", "failures"):
                    make_folder(self.path / name)
                    _remove(self.path / name, TEMPORARY)
            self._db = connect(file)
        except BaseException:
            os.close(self._lock)
            raise
        self._inode = _inode(self.path / DATABASE)
        with self._use() as db:
            db.execute("DELETE FROM running")

    def __enter__(self) -> RunDirectory:
        return self

    def __exit__(self, *_: object) -> None:
        """Fold the write-ahead log into the database file and let others write."""
        with contextlib.suppress(sqlite3.Error):
            self._db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        self._db.close()
        os.close(self._lock)

    @contextlib.contextmanager
    def _use(self) -> Iterator[sqlite3.Connection]:
        """The database, in a transaction; what goes wrong there, or on the disk, is one line."""
        if _inode(self.path / DATABASE) != self._inode:
            raise InvalidInputError(
                f"{self.path / DATABASE} was removed or replaced while it was written to: put it "
                "back and run the same command again, or begin anew in another folder"
            )
        with clear_errors(self.path / DATABASE), self._db:
            yield self._db

    def note(self, key: str, value: Any) -> None:
        """Keep a JSON value about the run."""
        with self._use() as db:
            db.execute("INSERT OR REPLACE INTO about VALUES (?, ?)", (key, json.dumps(value)))

    def extend(self, key: str, entries: Mapping[str, Any]) -> None:
        """Add entries to a JSON mapping about the run."""
        self.note(key, {**self.about().get(key, {}), **entries})

    def show(self, job: str) -> None:
        """Let this result be the one that counts for its policy and scenario."""
        with self._use() as db:
            db.execute(_HIDE_OTHERS, (job, job))

    def show_only(self, jobs: Iterable[str]) -> None:
        """Let these results count and no others, until those are asked for again."""
        with self._use() as db:
            db.execute("UPDATE results SET current = 0 WHERE current")
            db.executemany("UPDATE results SET current = 1 WHERE job = ?", ((j,) for j in jobs))

    def begin(self, job: str, title: str) -> None:
        """Note that a job is being run."""
        with self._use() as db:
            db.execute("INSERT OR REPLACE INTO running VALUES (?, ?, ?)", (job, title, time.time()))

    def add(
        self,
        row: ResultRow,
        trace: bytes | None = None,
        detail: str = "",
        spec: Mapping[str, Any] | None = None,
        *,
        show: bool = True,
    ) -> ResultRow:
        """Store what became of one job, in one transaction.

        Args:
            row: its result; ``row.job`` says which it was.
            trace: the recorded episode.
            detail: traceback of a failure.
            spec: what `job_spec` said about the job.
            show: it is the result that counts for its policy and scenario.

        Returns:
            The row as it is stored: with the name of its trace.
        """
        with self._use() as db:
            if trace is not None:
                row = replace(row, trace=trace_digest(trace))
                assert row.trace_file is not None
                write_atomic(self.path / row.trace_file, trace)
            if detail:
                write_atomic(self.path / row.detail_file, detail.encode(errors="replace"))
            insert(db, row, spec or {})
            if show:
                db.execute(_HIDE_OTHERS, (row.job, row.job))
            db.execute("DELETE FROM running WHERE job = ?", (row.job,))
        return row

    def forget_failures(self, keys: Iterable[tuple[str, str, int]]) -> None:
        """Remove the failed results of these policies, scenarios and seeds."""
        query = "DELETE FROM results WHERE policy = ? AND scenario = ? AND seed = ? AND status != ?"
        with self._use() as db:
            db.executemany(query, ((*key, str(Status.DONE)) for key in keys))

    def tidy(self) -> None:
        """Remove recorded episodes that no result names: of calls that were killed or forgotten."""
        with self._use() as db:
            named = {f"{trace}.npz" for (trace,) in db.execute("SELECT trace FROM results")}
            _remove(self.path / "episodes", _EPISODE, named)

    def measure(self, values: Iterable[tuple[str, str, str, float | None]]) -> None:
        """Keep values of metrics that are no columns: job, metric, its source, value."""
        with self._use() as db:
            db.executemany("INSERT OR REPLACE INTO measured VALUES (?, ?, ?, ?)", values)

    def about(self) -> dict[str, Any]:
        """Return the notes about the run."""
        with self._use() as db:
            return read_about(db)

    def results(self) -> list[StoredResult]:
        """Every result, also those that do not count now."""
        with self._use() as db:
            return read_results(db)

    def rows(self) -> list[ResultRow]:
        """All rows, sorted."""
        with self._use() as db:
            return read_rows(db)

    def write_csv(self) -> Path:
        """Write ``results.csv`` from the database; a report of other rows is removed."""
        path = self.path / "results.csv"
        with self._use() as db:
            text = rows_csv(read_rows(db)).encode()
            if not path.is_file() or path.read_bytes() != text:
                remove_report(self.path)
                write_atomic(path, text)
        return path


def files_of(folder: Path, row: ResultRow) -> tuple[bytes | None, str]:
    """Read the files that belong to a row in the run directory of a stranger.

    Returns:
        The recorded episode, None if it is missing or is not what its name says, and the traceback.
    """
    trace = _own_file(folder, row.trace_file or "", MAX_BYTES)
    detail = _own_file(folder, row.detail_file, _MAX_DETAIL)
    whole = bool(row.trace) and trace_digest(trace) == row.trace
    return trace if whole else None, detail.decode(errors="replace")


def _own_file(folder: Path, name: str, limit: int) -> bytes:
    """The content of a file that is in a folder indeed, not where a link leads; else nothing."""
    path = (folder / name).resolve()
    if not path.is_relative_to(folder.resolve()) or not path.is_file():
        return b""
    with contextlib.suppress(SchemaError):
        return read_bytes(path, limit=limit)
    return b""


def _inode(path: Path) -> tuple[int, int] | None:
    """Return device and inode of a file, to tell it from another of its name; None if missing."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def trace_digest(trace: bytes) -> str:
    """The hash that names a recorded episode, 32 hexadecimal digits."""
    return hashlib.sha256(trace).hexdigest()[:32]


def _remove(folder: Path, names: re.Pattern[str], kept: Container[str] = ()) -> None:
    """Remove files of ours from a folder that is there, and nothing that has another name."""
    if folder.is_symlink() or not folder.is_dir():
        return
    for entry in [*os.scandir(folder)]:
        ours = names.fullmatch(entry.name) and entry.name not in kept
        if ours and not entry.is_dir(follow_symlinks=False):
            os.unlink(entry)


def _lock(handle: int, path: Path) -> None:
    """Lock a run directory; a process that only looks at it holds it for a moment.

    Raises:
        InvalidInputError: if another process holds it.
    """
    for _ in range(5):
        taken = take_lock(handle)
        if taken is None:
            _log.warning("%s is on a disk without file locks: let only one process write", path)
        if taken is not False:
            return
        time.sleep(0.05)
    raise InvalidInputError(f"another process is writing into {path}")


def open_results(
    path: str | Path,
) -> tuple[list[ResultRow], Mapping[str, Any], Mapping[str, Mapping[str, float]]]:
    """Read the rows of a run directory, and what was noted about the run.

    Returns:
        Rows, notes with `read_left_out` among them, and for each job its metrics that are no
        columns.

    Raises:
        InvalidInputError: if there are no results.
    """
    with reading(path) as db:
        about = {**read_about(db), "left_out": read_left_out(db)}
        return read_rows(db), about, read_measured(db)
