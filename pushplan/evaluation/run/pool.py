"""Processes for jobs: a dead or hanging one costs its own job only."""

from __future__ import annotations

import itertools
import math
import os
import pickle
import sys
import threading
from collections import deque
from concurrent.futures import BrokenExecutor, Future
from dataclasses import dataclass, field
from pathlib import Path

from pushplan.errors import describe
from pushplan.evaluation.run.jobs import (
    DEFAULT_ENV,
    Job,
    JobResult,
    JobSettings,
    batch_stopped,
    failed_result,
    timeout_reason,
)
from pushplan.evaluation.run.worker import WorkerSetup
from pushplan.evaluation.run.worker_process import WorkerDiedError, WorkerProcess
from pushplan.evaluation.store.rows import Status
from pushplan.world import InvalidInputError

PRELOAD = (
    "pushplan.evaluation.run.execute",
    "pushplan.planners.push_aware.policies",
    "pushplan.planners.rrt.policies",
    "pushplan.planners.ship_predictive.policies",
    "pushplan.envs.push_env",
    "pushplan.envs.simulators.pymunk_simulator",
)
"""Modules that a worker imports before its first job, so that no job's time holds it."""
_STARTS = 2  # so many workers in a row may end before they are ready until a call gives up


@dataclass
class _Call:
    group: str
    payload: bytes
    future: Future[JobResult] = field(default_factory=Future)
    tries: int = 2  # so often it may lose its worker to somebody outside


class WorkerPool:
    """Runs jobs in processes of its own, one at a time in each.

    Unlike the executors of the standard library, Pebble and loky it reads nothing from its workers
    that could run code, and knows groups of policies: a process runs jobs of one group only. It
    ends jobs that take too long or too much memory, with everything that they started, and tries
    a job again whose process was killed from outside. It does not import the main module of the
    program unless a job needs it. Workers ignore Ctrl-C and end when their owner does. Results
    with a true attribute ``tainted`` retire the worker they come from.

    Args:
        workers: number of processes.
        settings: of the jobs.
        memory_limit_mb: private memory of a worker at which allocations fail, and memory of it and
            its children, shared or not, at which it is ended [MB].
        log_dir: folder for what workers write to standard output and error; discarded if None.
    """

    def __init__(
        self,
        workers: int,
        settings: JobSettings,
        memory_limit_mb: float | None,
        log_dir: Path | None = None,
    ) -> None:
        main = getattr(sys.modules.get("__main__"), "__file__", None)
        limit_s = settings.force_after_s
        self._setup = WorkerSetup(
            main=None if main is None else os.path.abspath(main),
            preload=PRELOAD if settings.make_env == DEFAULT_ENV else PRELOAD[:1],
            memory_limit_mb=memory_limit_mb,
            trace_after_s=limit_s,
        )
        self._most = workers
        self._settings = settings
        self._log_dir = log_dir
        self._limit_s = math.inf if limit_s is None else limit_s
        self._calls: deque[_Call] = deque()
        self._threads: list[threading.Thread] = []  # one for each worker
        self._workers: dict[threading.Thread, WorkerProcess] = {}
        self._changed = threading.Condition()
        self._closing = self._killed = False
        self._numbers = itertools.count(1)

    def submit(self, job: Job) -> Future[JobResult]:
        """Queue one job."""
        call = _Call(job.policy.group, pickle.dumps((job, self._settings)))
        with self._changed:
            if self._closing:
                raise RuntimeError("cannot submit to a pool that has been shut down")
            self._calls.append(call)
            if len(self._threads) < self._most:
                thread = threading.Thread(target=self._serve, daemon=True)
                thread.start()
                self._threads.append(thread)
            self._changed.notify()
        return call.future

    def shutdown(self) -> None:
        """Finish the queue and end the workers."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        for thread in self._threads:
            thread.join()

    def kill(self) -> None:
        """End the workers at once, whatever they are doing, and drop the queue."""
        with self._changed:
            self._killed = True
            for call in self._calls:
                call.future.cancel()
            self._calls.clear()
            for worker in self._workers.values():
                worker.kill()
        self.shutdown()

    def _serve(self) -> None:
        """Hand calls to a worker of this thread's own until there are no more."""
        name = f"worker-{next(self._numbers)}.log"
        log = None if self._log_dir is None else self._log_dir / name
        worker: WorkerProcess | None = None
        while (call := self._next(worker)) is not None:
            try:
                if worker is not None and worker.group != call.group:
                    worker.end()
                    worker = None
                if worker is None:
                    worker = self._start(log)
                    worker.group = call.group
                result = worker.ask(call.payload, self._limit_s)
            except InvalidInputError as error:
                call.future.set_exception(error)
            except WorkerDiedError as error:
                worker = None
                call.tries -= 1
                with self._changed:
                    if error.from_outside and call.tries and not self._killed:
                        self._calls.appendleft(call)
                        continue
                call.future.set_exception(error)
            except BaseException as error:  # of files, processes or memory of ours
                if worker is not None:
                    worker.kill()
                    worker = None
                call.future.set_exception(batch_stopped(error))
            else:
                if result.tainted:
                    worker.end()
                    worker = None
                call.future.set_result(result)
        if worker is not None:
            worker.end(force=self._killed)

    def _next(self, worker: WorkerProcess | None) -> _Call | None:
        """The call to run next, if there is one of a worker's own group; None at the end."""
        group = None if worker is None else worker.group
        with self._changed:
            while True:
                while not self._calls and not self._closing:
                    self._changed.wait()
                if not self._calls:
                    return None
                same = (i for i, call in enumerate(self._calls) if call.group == group)
                at = next(same, 0)
                call = self._calls[at]
                del self._calls[at]
                if call.future.running() or call.future.set_running_or_notify_cancel():
                    return call

    def _start(self, log: Path | None) -> WorkerProcess:
        """A worker that is ready."""
        ending = ""
        for _ in range(_STARTS):
            worker = WorkerProcess(self._setup, log)
            with self._changed:
                self._workers[threading.current_thread()] = worker
                if self._killed:
                    worker.kill()
            try:
                worker.begin()
            except WorkerDiedError as error:
                ending = f"{error} while it started: {error.log[-500:]}"
            else:
                return worker
        raise InvalidInputError(f"no worker process can be started: {ending}")


def outcome_of(job: Job, future: Future[JobResult], settings: JobSettings) -> JobResult:
    """Wait for a job; a process that died, overran or took too much memory is a failed result.

    Raises:
        BrokenExecutor: if the executor as a whole has failed.
        InvalidInputError: if nothing can run: a worker cannot load what it was sent.
    """
    try:
        return future.result().checked(job)
    except WorkerDiedError as error:
        reason = str(error)
        detail = f"{error}\n{error.log}"
        if error.status is Status.TIMEOUT:
            reason = timeout_reason(settings.timeout_s)
            detail = f"The process did not react and was ended.\n{error.log}"
        return failed_result(job, error.status, reason, detail)
    except (BrokenExecutor, InvalidInputError):
        raise
    except (OSError, MemoryError, RuntimeError) as error:
        raise batch_stopped(error) from error
    except Exception as error:
        return failed_result(job, Status.CRASHED, describe(error))
