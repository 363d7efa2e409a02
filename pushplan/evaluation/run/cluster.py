"""Jobs on a Dask cluster: on this machine, or on many."""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future
from contextlib import contextmanager
from typing import Any

from pushplan.errors import describe
from pushplan.evaluation.run.jobs import Job, JobResult, JobSettings
from pushplan.evaluation.run.pool import WorkerPool, outcome_of
from pushplan.imports.on_demand import need
from pushplan.world import InvalidInputError

CONNECT_S = 30.0
"""Time limit for an answer of a scheduler [s]."""
_local = threading.local()


class ClusterError(InvalidInputError):
    """The cluster cannot be reached, or was lost."""


class DaskExecutor(Executor):
    """Runs jobs on the workers of a Dask cluster, each in a process of its own beside the worker.

    There it has the limits of time and memory that it has here, and what it does to its process
    costs nobody else. A job whose Dask worker is lost goes to another one.

    Args:
        client: a `distributed.Client`.
        memory_limit_mb: see `run_batch`.
    """

    window = 256
    """So many jobs are in hand at a time."""

    def __init__(self, client: Any, memory_limit_mb: float | None) -> None:
        self._client = client
        self._memory_limit_mb = memory_limit_mb

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **_: Any) -> Future[Any]:
        """Queue one job: ``function`` is `execute`, ``arguments`` are job and settings."""
        job, settings, *_rest = arguments
        found: Future[Any] = Future()
        found.set_running_or_notify_cancel()
        try:
            task = self._client.submit(
                run_isolated, job, settings, self._memory_limit_mb, pure=False
            )
        except (OSError, RuntimeError, ValueError) as error:
            raise ClusterError(f"the cluster takes no jobs: {describe(error)}") from error
        task.add_done_callback(lambda done: _hand_over(done, found))
        return found


def _hand_over(task: Any, found: Future[Any]) -> None:
    """Let a future end as a task of Dask ended."""
    text = "the scheduler of the cluster was lost; what was stored is kept, and the same command "
    lost = ClusterError(f"{text}goes on")
    try:
        if task.status == "finished":
            found.set_result(task.result())
            return
        if task.status == "error":
            lost = task.exception()
            if type(lost).__name__ != "KilledWorker":  # a job's own errors are in its result
                lost = ClusterError(f"the cluster's workers cannot run jobs: {describe(lost)}")
    except (OSError, CancelledError):  # the scheduler went before the result was fetched
        pass
    except Exception as error:
        lost = ClusterError(f"a result was lost: {describe(error)}")
    found.set_exception(lost)


@contextmanager
def dask_executor(where: str, memory_limit_mb: float | None) -> Iterator[DaskExecutor]:
    """An executor on a Dask cluster.

    Args:
        where: ``"local:N"`` for N processes here, or the address of a scheduler.
        memory_limit_mb: see `run_batch`.

    Raises:
        ClusterError: if there is no scheduler.
        InvalidInputError: if ``where`` is neither.
        MissingDependencyError: without the extra `cluster`.
    """
    distributed = need("distributed")
    local = re.fullmatch(r"local:([1-9][0-9]{0,3})", where)
    if local is None and not re.fullmatch(r"([a-z]+://)?(?!local:)[^\s:/]+:[0-9]+", where):
        raise InvalidInputError(
            f"a cluster is 'local:N' or the address of a Dask scheduler, such as "
            f"tcp://10.0.0.1:8786, got {where!r}"
        )
    try:
        if local is not None:
            cluster = distributed.LocalCluster(
                n_workers=int(local[1]), threads_per_worker=1, dashboard_address=None
            )
            client = distributed.Client(cluster)
        else:
            cluster = None
            client = distributed.Client(where, timeout=CONNECT_S)
    except (OSError, ValueError, RuntimeError) as error:
        raise ClusterError(f"there is no Dask scheduler at {where}: {describe(error)}") from error
    try:
        yield DaskExecutor(client, memory_limit_mb)
    finally:
        client.close(timeout=5.0)
        if cluster is not None:
            cluster.close(timeout=5.0)


def run_isolated(job: Job, settings: JobSettings, memory_limit_mb: float | None) -> JobResult:
    """Run a job on a Dask worker, in a process beside it that outlives the job."""
    wanted = (settings, memory_limit_mb)
    if getattr(_local, "wanted", None) != wanted:
        if (old := getattr(_local, "pool", None)) is not None:
            old.kill()
        _local.pool = WorkerPool(1, settings, memory_limit_mb)
        _local.wanted = wanted
    return outcome_of(job, _local.pool.submit(job), settings)
