"""Run many jobs, whatever single ones do, and store what became of each."""

from __future__ import annotations

import logging
import os
import pickle
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pushplan
from pushplan.evaluation.execute import execute
from pushplan.evaluation.jobs import (
    DEFAULT_ENV,
    Job,
    JobResult,
    JobSettings,
    failed_result,
    timeout_reason,
)
from pushplan.evaluation.pool import WorkerPool
from pushplan.evaluation.provenance import provenance
from pushplan.evaluation.rows import ResultRow, Status, setting_of
from pushplan.evaluation.store import RunDirectory
from pushplan.evaluation.worker import WORKER_VARIABLE
from pushplan.evaluation.worker_process import (
    WorkerDiedError,
    WorkerOutOfMemoryError,
    WorkerOverranError,
)
from pushplan.world import InvalidInputError
from pushplan.world.checks import integer, number
from pushplan.world.errors import describe

Progress = Callable[[int, int, ResultRow | None], None]
"""Called with jobs done, jobs in all, and the row just stored (None at the beginning)."""

_log = logging.getLogger(__name__)
PRELOAD = (
    "pushplan.evaluation.execute",
    "pushplan.planners.push_aware.policies",
    "pushplan.planners.rrt.policies",
    "pushplan.planners.ship_predictive.policies",
    "pushplan.envs.push_env",
    "pushplan.envs.simulators.pymunk_simulator",
)
"""What a worker imports before its first job, so that no job's time holds it."""
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
    memory_limit_mb: float | None = None,
    retry_failed: bool = False,
    about: Mapping[str, Any] | None = None,
    progress: Progress | None = None,
) -> list[ResultRow]:
    """Run jobs and store one row for each; jobs that have a row already are not run again.

    A job that raises, returns nonsense, takes too long or ends its process becomes a row with a
    status and a reason, and the batch goes on. Killed at any instant, it continues with the next
    call and ends with the same results.

    Args:
        jobs: what to run; a job is known by policy label, scenario key and seed.
        out: run directory, new or to be continued.
        workers: processes; all cores by default. 0 runs the jobs in this process, where a
            policy that never returns to the interpreter cannot be ended.
        executor: runs the jobs instead of our own processes; ``workers`` then says how many jobs
            it is given at a time.
        settings: environment, observation and time limit of all jobs.
        memory_limit_mb: private memory of a worker at which allocations fail, and memory of it and
            what it started, shared or not, at which it is ended [MB].
        retry_failed: run jobs again whose row says that they failed.
        about: what else the results depend on; has to be the same when a run is continued.
        progress: told of every row.

    Returns:
        All rows of the run directory, sorted.

    Raises:
        InvalidInputError: if the directory holds a run with another configuration, two jobs are
            the same, or a policy cannot be sent to a process.
    """
    jobs = list(jobs)
    settings = JobSettings() if settings is None else settings
    workers = os.cpu_count() or 1 if workers is None else integer("workers", workers, low=0)
    if memory_limit_mb is not None:
        number("memory_limit_mb", memory_limit_mb, low=1.0)
    _check(jobs)
    with RunDirectory(out) as store:
        store.configure(
            _configuration(settings, memory_limit_mb, about),
            {job.policy.label: job.policy.identity for job in jobs},
        )
        store.extend("settings", {setting_of(*job.id[1:]): job.title for job in jobs})
        if retry_failed:
            store.forget_failures()
        done = store.done()
        pending = [job for job in jobs if job.id not in done]
        if pending:
            store.append("runs", provenance(workers))
        if progress is not None:
            progress(len(jobs) - len(pending), len(jobs), None)
        batch = _Batch(pending, store, settings, memory_limit_mb, len(jobs), progress)
        if executor is None and workers == 0:
            batch.run_here()
        elif pending:
            batch.run(executor, max(1, min(workers, len(pending))))
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
        if job.id in seen:
            raise InvalidInputError(f"two jobs are the same: policy, scenario, seed = {job.id}")
        seen.add(job.id)


def _configuration(
    settings: JobSettings, memory_limit_mb: float | None, about: Mapping[str, Any] | None
) -> dict[str, Any]:
    make = settings.make_env
    return {
        "pushplan": pushplan.__version__,
        "make_env": make if isinstance(make, str) else getattr(make, "__qualname__", "callable"),
        "observation": settings.observation,
        "timeout_s": settings.timeout_s,
        "memory_limit_mb": memory_limit_mb,
        **({} if settings.latency_factor is None else {"latency_factor": settings.latency_factor}),
        **(about or {}),
    }


class _Batch:
    """The jobs of one call of `run_batch` that have no row yet."""

    def __init__(
        self,
        jobs: Sequence[Job],
        store: RunDirectory,
        settings: JobSettings,
        memory_limit_mb: float | None,
        total: int,
        progress: Progress | None,
    ) -> None:
        self._jobs = deque(jobs)
        self._store = store
        self._settings = settings
        self._memory_limit_mb = memory_limit_mb
        self._total = total
        self._left = len(jobs)
        self._progress = progress

    def run_here(self) -> None:
        """One after the other in this process."""
        while self._jobs:
            job = self._jobs.popleft()
            self._keep(execute(job, self._settings).checked(job))

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
        logs.mkdir(exist_ok=True)
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
                    self._keep(outcome)
        return [*suspects, *flying.values()]

    def _outcome(self, job: Job, future: Future[JobResult], foreign: bool) -> JobResult | None:
        """What became of a job; None if its executor broke and it may be innocent."""
        try:
            return future.result().checked(job)
        except WorkerOverranError as error:
            reason = timeout_reason(self._settings.timeout_s)
            detail = "The process did not react and was ended.\n" + error.log
            return failed_result(job, Status.TIMEOUT, reason, detail)
        except WorkerDiedError as error:
            memory = isinstance(error, WorkerOutOfMemoryError)
            status = Status.OUT_OF_MEMORY if memory else Status.CRASHED
            return failed_result(job, status, str(error), f"{error}\n{error.log}")
        except BrokenExecutor as error:
            if not foreign:
                raise InvalidInputError(f"no worker process can be started: {error}") from error
            return None
        except InvalidInputError:
            raise  # a worker cannot load what it was sent: nothing can run
        except Exception as error:
            return failed_result(job, Status.CRASHED, describe(error))

    def _clear(self, suspects: Sequence[Job]) -> None:
        """Run jobs that were in flight when a process died each alone in a fresh process."""
        for job in suspects:
            with _closing(self._pool(1)) as pool:
                future = _sent(_sending(pool, self._settings), job)
                outcome = self._outcome(job, future, foreign=False)
                assert outcome is not None
                self._keep(outcome)

    def _keep(self, outcome: JobResult) -> None:
        self._store.add(outcome.row, outcome.trace, outcome.detail)
        self._left -= 1
        if self._progress is not None:
            self._progress(self._total - self._left, self._total, outcome.row)


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
