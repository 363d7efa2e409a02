"""Progress of a run, seen from another process."""

from __future__ import annotations

import time
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from pushplan.errors import one_line
from pushplan.evaluation.store.database import LOCK, read_about, reading
from pushplan.evaluation.store.rows import Status, moment
from pushplan.files.file_locks import is_locked
from pushplan.world.checks import number


@dataclass(frozen=True)
class RunStatus:
    """Progress of a run.

    Attributes:
        active: True if a process writes into the directory now; None on a disk without file locks,
            where nothing tells.
        jobs: jobs of the last call that ran any.
        done: of these, how many have a result.
        failed: results in the directory, of whatever call, that are failures.
        per_minute: results a minute since that call began; 0 before the first.
        left_s: what that lets expect [s]; None before the first result, or if nothing is left.
        running: jobs in hand, longest first: title, seconds since they were handed to a worker.
        slowest: results of the directory that took longest: title, seconds.
    """

    active: bool | None
    jobs: int
    done: int
    failed: int
    per_minute: float
    left_s: float | None
    running: tuple[tuple[str, float], ...]
    slowest: tuple[tuple[str, float], ...]


def run_status(path: str | Path, slowest: int = 3) -> RunStatus:
    """Look at a run directory, perhaps while another process writes into it.

    Args:
        path: run directory.
        slowest: how many slow episodes to name.

    Raises:
        InvalidInputError: if it holds no results.
        SchemaError: if they cannot be read.
    """
    active = is_locked(Path(path) / LOCK)
    with reading(path) as db:
        *_, call = read_about(db).get("runs", []) or [{}]
        began = call.get("began", "")
        query = "SELECT count(*) FROM results WHERE status != ?"
        ((failed,),) = db.execute(query, (str(Status.DONE),))
        query = "SELECT count(*), max(began) FROM results WHERE began >= ?"
        ((new, last),) = db.execute(query, (began,))
        flying = db.execute("SELECT title, began FROM running ORDER BY began")
        running = tuple(
            (one_line(str(title)), max(0.0, time.time() - number("began", start)))
            for title, start in flying
        )
        took = db.execute(
            "SELECT policy || ' ' || scenario, wall_time_s FROM results "
            "WHERE wall_time_s IS NOT NULL ORDER BY wall_time_s DESC LIMIT ?",
            (slowest,),
        )
        longest = tuple(
            (one_line(str(title)), number("wall_time_s", seconds)) for title, seconds in took
        )
        end = moment(last) if last and not active else datetime.now(UTC)
        elapsed = (end - moment(began)).total_seconds() if began else 0.0
    jobs = call.get("jobs", 0)
    done = min(jobs, call.get("done", 0) + new)
    rate = new / elapsed if elapsed > 0.0 else 0.0
    return RunStatus(
        active=active,
        jobs=jobs,
        done=done,
        failed=failed,
        per_minute=60.0 * rate,
        left_s=(jobs - done) / rate if rate and done < jobs else None,
        running=running if active else (),
        slowest=longest,
    )
