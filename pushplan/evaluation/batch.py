"""Run many jobs, whatever single ones do, and store what became of each."""

from __future__ import annotations

import logging
import os
import pickle
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from pushplan.evaluation.execute import execute
from pushplan.evaluation.job_identity import identified
from pushplan.evaluation.jobs import (
    DEFAULT_ENV,
    BatchStoppedError,
    Job,
    JobResult,
    JobSettings,
    batch_stopped,
)
from pushplan.evaluation.limits import MEMORY_MB, check_limits
from pushplan.evaluation.outcome import PRELOAD, outcome_of
from pushplan.evaluation.pending import note_batch, pending_jobs
from pushplan.evaluation.pool import WorkerPool
from pushplan.evaluation.provenance import provenance
from pushplan.evaluation.rows import ResultRow, instant
from pushplan.evaluation.store import RunDirectory, remove_report
from pushplan.evaluation.worker import WORKER_VARIABLE
from pushplan.world import InvalidInputError
from pushplan.world.checks import choice, integer, number
from pushplan.world.output_files import make_folder

Progress = Callable[[int, int, ResultRow | None], None]
"""Called with jobs done, jobs in all, and the row just stored (None at the beginning)."""

_log = logging.getLogger(__name__)
TRACES = ("all", "failures", "none")
"""Which recorded episodes are kept: of every job, of those without success, or of none."""
_TURN = 20
"""So many jobs of a policy follow each other where policies do not share a process."""

Submit = Callable[[Job], "Future[JobResult]"]


def run_batch(
    jobs: Iterable[Job],
    *,
    out: str | Path,
    workers: int | None = None,
    executor: Executor | None = None,
    settings: JobSettings | None = None,
    memory_limit_mb: float | None = MEMORY_MB,
    retry_failed: bool = False,
    any_version: bool = False,
    traces: str = "all",
    about: Mapping[str, Any] | None = None,
    progress: Progress | None = None,
) -> list[ResultRow]:
    """Run jobs and store one row for each. What is done is not run again, what has changed is.

    A job that raises, returns nonsense, takes too long or ends its process becomes a row with a
    status and a reason, and the batch goes on. Killed at any instant, it continues with the next
    call and ends with the same results.

    A job is known by a hash of all that its result depends on (`job_identity.job_spec`): the
    policy's code and parameters, the scenario, the settings, and versions. A row shows the result
    that was asked for last of its policy label, scenario and seed; other ones stay stored, and
    count at once when they are asked for again.

    Args:
        jobs: what to run; policy label, scenario key and seed tell them apart.
        out: run directory, new or to be continued.
        workers: processes; all cores by default. 0 runs the jobs in this process, where a
            policy that never returns to the interpreter cannot be ended.
        executor: runs the jobs instead of our own processes; ``workers`` then says how many jobs
            it is given at a time.
        settings: environment, observation and time limit of all jobs.
        memory_limit_mb: private memory of a worker at which allocations fail, and memory of it and
            what it started, shared or not, at which it is ended [MB]; None for no limit.
        retry_failed: run jobs again whose row says that they failed.
        any_version: take results that differ only in versions of pushplan and of packages.
        traces: which recorded episodes are kept, one of `TRACES`.
        about: what else to note about the run: JSON values.
        progress: told of every row.

    Returns:
        All rows of the run directory, sorted.

    Raises:
        InvalidInputError: if another process writes into the directory, two jobs are the same, or
            a policy cannot be sent to a process.
    """
    jobs = list(jobs)
    settings = JobSettings() if settings is None else settings
    workers = os.cpu_count() or 1 if workers is None else integer("workers", workers, low=0)
    if memory_limit_mb is not None:
        number("memory_limit_mb", memory_limit_mb, low=1.0)
    choice("traces", traces, TRACES)
    _check(jobs)
    jobs = identified(jobs, settings)
    with RunDirectory(out) as store:
        note_batch(store, jobs, settings, about)
        if retry_failed:
            store.forget_failures()
        pending = pending_jobs(jobs, store, any_version)
        if pending:
            begun = {**provenance(workers), "jobs": len(jobs), "done": len(jobs) - len(pending)}
            store.append("runs", begun)
            remove_report(store.path)
        if progress is not None:
            progress(len(jobs) - len(pending), len(jobs), None)
        batch = _Batch(pending, store, settings, memory_limit_mb, traces, len(jobs), progress)
        if executor is None and workers == 0:
            batch.run_here()
        elif pending:
            check_limits(workers, memory_limit_mb)
            batch.run(executor, max(1, min(workers, len(pending))))
        store.tidy()
        store.write_csv()
        return store.rows()


def _check(jobs: Sequence[Job]) -> None:
    if os.environ.get(WORKER_VARIABLE):
        raise InvalidInputError(
            "a worker process came upon run_batch while it imported the main script: put the "
            "call under `if __name__ == '__main__':`"
        )
    seen: set[tuple[str, str, int]] = set()
    for job in jobs:
        if job.key in seen:
            raise InvalidInputError(f"two jobs are the same: policy, scenario, seed = {job.key}")
        seen.add(job.key)


class _Batch:
    """The jobs of one call of `run_batch` that have no row yet."""

    def __init__(
        self,
        jobs: Sequence[Job],
        store: RunDirectory,
        settings: JobSettings,
        memory_limit_mb: float | None,
        traces: str,
        total: int,
        progress: Progress | None,
    ) -> None:
        self._jobs = deque(jobs)
        self._began: dict[tuple[str, str, int], str] = {}
        self._store = store
        self._settings = settings
        self._memory_limit_mb = memory_limit_mb
        self._traces = traces
        self._total = total
        self._left = len(jobs)
        self._progress = progress

    def run_here(self) -> None:
        """One after the other in this process."""
        while self._jobs:
            job = self._jobs.popleft()
            self._begin(job)
            self._keep(job, execute(job, self._settings).checked(job))

    def run(self, executor: Executor | None, window: int) -> None:
        """Through an executor, ``window`` jobs at a time; through our own pool if None."""
        if executor is None:
            self._jobs = _in_turns(self._jobs)
            with _closing(self._pool(window)) as pool:
                # one job waits for each worker, so that none is idle while a row is stored
                self._drain(_sending(pool, self._settings), 2 * window, foreign=False)
        else:
            settings, owner = self._settings, os.getpid()

            def submit(job: Job) -> Future[JobResult]:
                return executor.submit(execute, job, settings, owner)

            if suspects := self._drain(submit, window, foreign=True):
                self._clear(suspects)
                _log.warning("the executor broke; its jobs go on in %d processes of ours", window)
                self.run(None, window)

    def _pool(self, workers: int) -> WorkerPool:
        logs = self._store.path / "logs"
        make_folder(logs)
        return WorkerPool(
            workers,
            limit_s=self._settings.force_after_s,
            memory_limit_mb=self._memory_limit_mb,
            preload=PRELOAD if self._settings.make_env == DEFAULT_ENV else PRELOAD[:1],
            log_dir=logs,
        )

    def _drain(self, submit: Submit, window: int, *, foreign: bool) -> list[Job]:
        """Run jobs until there are none; those in flight when the executor broke otherwise."""
        flying: dict[Future[JobResult], Job] = {}
        suspects: list[Job] = []
        while (self._jobs or flying) and not suspects:
            while self._jobs and len(flying) < window:
                job = self._jobs.popleft()
                self._begin(job)
                try:
                    flying[_sent(submit, job)] = job
                except BrokenExecutor:
                    suspects.append(job)
                    break
            done, _ = wait(flying, return_when=FIRST_COMPLETED)
            for future in done:
                job = flying.pop(future)
                outcome = self._outcome(job, future, foreign)
                if outcome is None:
                    suspects.append(job)
                else:
                    self._keep(job, outcome)
        return [*suspects, *flying.values()]

    def _outcome(self, job: Job, future: Future[JobResult], foreign: bool) -> JobResult | None:
        """What became of a job; None if its executor broke and it may be innocent."""
        try:
            return outcome_of(job, future, self._settings)
        except BrokenExecutor as error:
            if not foreign:
                raise InvalidInputError(f"no worker process can be started: {error}") from error
            return None

    def _clear(self, suspects: Sequence[Job]) -> None:
        """Run jobs that were in flight when a process died each alone in a fresh process."""
        for job in suspects:
            with _closing(self._pool(1)) as pool:
                future = _sent(_sending(pool, self._settings), job)
                outcome = self._outcome(job, future, foreign=False)
                assert outcome is not None
                self._keep(job, outcome)

    def _begin(self, job: Job) -> None:
        self._began[job.key] = instant()
        self._store.begin(job.id, " ".join(map(str, job.key[:2])))

    def _keep(self, job: Job, outcome: JobResult) -> None:
        began = self._began.pop(job.key)
        row = replace(outcome.row, job=job.id, trace="", began=outcome.row.began or began)
        kept = self._traces == "all" or (self._traces == "failures" and not row.success)
        trace = outcome.trace if kept else None
        row = self._store.add(row, trace, outcome.detail, job.spec)
        self._left -= 1
        if self._progress is not None:
            self._progress(self._total - self._left, self._total, row)


@contextmanager
def _closing(pool: WorkerPool) -> Iterator[WorkerPool]:
    """End a pool in order after success and at once after an exception such as Ctrl-C."""
    try:
        yield pool
    except BaseException:
        pool.kill()
        raise
    pool.shutdown()


def _sending(pool: WorkerPool, settings: JobSettings) -> Submit:
    return lambda job: pool.submit(job.policy.group, execute, job, settings)


def _sent(submit: Submit, job: Job) -> Future[JobResult]:
    try:
        return submit(job)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise InvalidInputError(
            f"policy {job.policy.label!r} cannot be sent to a worker process ({error}): define it "
            "at the top level of a file, name it as 'file.py:Class', or use workers=0"
        ) from error
    except BrokenExecutor:
        raise
    except (OSError, MemoryError, RuntimeError) as error:  # no thread can be started
        raise BatchStoppedError(batch_stopped(error)) from error


def _in_turns(jobs: Iterable[Job]) -> deque[Job]:
    """The jobs in runs of policies that may share a process: a change takes a new process."""
    waiting: dict[str, deque[Job]] = {}
    for job in jobs:
        waiting.setdefault(job.policy.group, deque()).append(job)
    turns: deque[Job] = deque()
    while any(waiting.values()):
        for queue in waiting.values():
            turns.extend(queue.popleft() for _ in range(min(_TURN, len(queue))))
    return turns
