"""Run many jobs, whatever single ones do, and store what became of each."""

from __future__ import annotations

import logging
import os
import pickle
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pushplan.evaluation.run.execute import execute
from pushplan.evaluation.run.job_identity import identified
from pushplan.evaluation.run.job_limits import MEMORY_MB, WORKER_VARIABLE, check_limits
from pushplan.evaluation.run.jobs import (
    BatchStoppedError,
    Job,
    JobResult,
    JobSettings,
    batch_stopped,
)
from pushplan.evaluation.run.pending import note_batch, pending_jobs
from pushplan.evaluation.run.pool import WorkerPool, outcome_of
from pushplan.evaluation.store.provenance import provenance
from pushplan.evaluation.store.rows import ResultRow, instant
from pushplan.evaluation.store.run_directory import RunDirectory, remove_report
from pushplan.files.output_files import make_folder
from pushplan.world import InvalidInputError
from pushplan.world.checks import choice, integer, number

Progress = Callable[[int, int, ResultRow | None], None]
"""Called with jobs done, jobs in all, and the row just stored (None at the beginning)."""

_log = logging.getLogger(__name__)
TRACES = ("all", "failures", "none")
"""Recorded episodes that can be kept: of every job, of those without success, or of none."""
_TURN = 20
"""So many jobs of a policy follow each other where policies do not share a process."""

Submit = Callable[[Job], "Future[JobResult]"]


def worker_count(workers: int | None) -> int:
    """The number of worker processes: that of the cores if it is None; 0 are none."""
    if workers is None:
        return os.cpu_count() or 1
    return integer("workers", workers, low=0)


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
    policy's code and parameters, the scenario, the settings, and versions. Only the jobs of the
    last call have rows; results of others stay stored, and count at once when they are asked for
    again.

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
        The rows of these jobs, sorted.

    Raises:
        InvalidInputError: if another process writes into the directory, two jobs are the same, or
            a policy cannot be sent to a process.
    """
    jobs = list(jobs)
    settings = JobSettings() if settings is None else settings
    workers = worker_count(workers)
    if memory_limit_mb is not None:
        number("memory_limit_mb", memory_limit_mb, low=1.0)
    choice("traces", traces, TRACES)
    if os.environ.get(WORKER_VARIABLE):
        raise InvalidInputError(
            "a worker process came upon run_batch while it imported the main script: put the "
            "call under `if __name__ == '__main__':`"
        )
    for key, count in Counter(job.key for job in jobs).items():
        if count > 1:
            raise InvalidInputError(f"two jobs are the same: policy, scenario, seed = {key}")
    jobs = identified(jobs, settings)
    with RunDirectory(out) as store:
        note_batch(store, jobs, settings, about)
        if retry_failed:
            store.forget_failures(job.key for job in jobs)
        pending = pending_jobs(jobs, store, any_version)
        if pending:
            begun = {**provenance(workers), "jobs": len(jobs), "done": len(jobs) - len(pending)}
            store.note("runs", [*store.about().get("runs", []), begun])
            remove_report(store.path)
        if progress is not None:
            progress(len(jobs) - len(pending), len(jobs), None)
        batch = _Batch(
            jobs=deque(pending),
            store=store,
            settings=settings,
            memory_limit_mb=memory_limit_mb,
            traces=traces,
            total=len(jobs),
            done=len(jobs) - len(pending),
            progress=progress,
        )
        if executor is None and workers == 0:
            batch.run_here()
        elif pending:
            check_limits(workers, memory_limit_mb)
            batch.run(executor, max(1, min(workers, len(pending))))
        store.tidy()
        store.write_csv()
        return store.rows()


@dataclass
class _Batch:
    """The jobs of one call of `run_batch` that have no row yet."""

    jobs: deque[Job]
    store: RunDirectory
    settings: JobSettings
    memory_limit_mb: float | None
    traces: str
    total: int
    done: int
    progress: Progress | None
    began: dict[tuple[str, str, int], str] = field(default_factory=dict)
    read: dict[str, dict[str, str]] = field(default_factory=dict)  # by the jobs of each policy

    def run_here(self) -> None:
        """One after the other in this process."""
        while self.jobs:
            job = self.jobs.popleft()
            self._begin(job)
            self._keep(job, execute(job, self.settings).checked(job))

    def run(self, executor: Executor | None, window: int) -> None:
        """Through an executor, ``window`` jobs at a time; through our own pool if None."""
        if executor is None:
            self.jobs = _in_turns(self.jobs)
            logs = self.store.path / "logs"
            make_folder(logs)
            with _closing(WorkerPool(window, self.settings, self.memory_limit_mb, logs)) as pool:
                # one job waits for each worker, so that none is idle while a row is stored
                self._drain(pool.submit, 2 * window)
            return
        settings = self.settings
        owner = os.getpid()

        def submit(job: Job) -> Future[JobResult]:
            return executor.submit(execute, job, settings, owner)

        if suspects := self._drain(submit, window):
            rest = self.jobs
            for job in suspects:  # each alone in a fresh process: one of them ended the other
                self.jobs = deque([job])
                self.run(None, 1)
            self.jobs = rest
            _log.warning("the executor broke; its jobs go on in %d processes of ours", window)
            self.run(None, window)

    def _drain(self, submit: Submit, window: int) -> list[Job]:
        """Run jobs until there are none; those in flight when the executor broke otherwise."""
        flying: dict[Future[JobResult], Job] = {}
        suspects: list[Job] = []
        while (self.jobs or flying) and not suspects:
            while self.jobs and len(flying) < window:
                job = self.jobs.popleft()
                self._begin(job)
                try:
                    flying[_sent(submit, job)] = job
                except BrokenExecutor:
                    suspects.append(job)
                    break
            done, _ = wait(flying, return_when=FIRST_COMPLETED)
            for future in done:
                job = flying.pop(future)
                try:
                    outcome = outcome_of(job, future, self.settings)
                except BrokenExecutor:  # it may be innocent
                    suspects.append(job)
                else:
                    self._keep(job, outcome)
        return [*suspects, *flying.values()]

    def _begin(self, job: Job) -> None:
        self.began[job.key] = instant()
        self.store.begin(job.id, " ".join(map(str, job.key[:2])))

    def _keep(self, job: Job, outcome: JobResult) -> None:
        began = self.began.pop(job.key)
        row = replace(outcome.row, job=job.id, trace="", began=outcome.row.began or began)
        kept = self.traces == "all" or (self.traces == "failures" and not row.success)
        trace = outcome.trace if kept else None
        spec = {**(job.spec or {}), **({"read": dict(outcome.read)} if outcome.read else {})}
        known = self.read.setdefault(row.policy, {})
        for name, digest in (*spec.get("data", {}).items(), *outcome.read.items()):
            if known.setdefault(name, digest) != digest:
                raise BatchStoppedError(
                    f"{name}, which code of yours reads, has changed while jobs of "
                    f"{row.policy!r} ran; what was stored is kept, and the same command goes on"
                )
        row = self.store.add(row, trace, outcome.detail, spec)
        self.done += 1
        if self.progress is not None:
            self.progress(self.done, self.total, row)


@contextmanager
def _closing(pool: WorkerPool) -> Iterator[WorkerPool]:
    """End a pool in order after success and at once after an exception such as Ctrl-C."""
    try:
        yield pool
    except BaseException:
        pool.kill()
        raise
    pool.shutdown()


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
        raise batch_stopped(error) from error


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
