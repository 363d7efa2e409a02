"""What became of a job whose process did not say so itself."""

from __future__ import annotations

from concurrent.futures import BrokenExecutor, Future

from pushplan.evaluation.jobs import (
    BatchStoppedError,
    Job,
    JobResult,
    JobSettings,
    batch_stopped,
    failed_result,
    timeout_reason,
)
from pushplan.evaluation.rows import Status
from pushplan.evaluation.worker_process import (
    WorkerDiedError,
    WorkerOutOfMemoryError,
    WorkerOverranError,
)
from pushplan.world import InvalidInputError
from pushplan.world.errors import describe

PRELOAD = (
    "pushplan.evaluation.execute",
    "pushplan.planners.push_aware.policies",
    "pushplan.planners.rrt.policies",
    "pushplan.planners.ship_predictive.policies",
    "pushplan.envs.push_env",
    "pushplan.envs.simulators.pymunk_simulator",
)
"""What a worker imports before its first job, so that no job's time holds it."""


def outcome_of(job: Job, future: Future[JobResult], settings: JobSettings) -> JobResult:
    """Wait for a job; a process that died, overran or took too much memory is a failed result.

    Raises:
        BrokenExecutor: if the executor as a whole has failed.
        InvalidInputError: if nothing can run: a worker cannot load what it was sent.
    """
    try:
        return future.result().checked(job)
    except WorkerOverranError as error:
        reason = timeout_reason(settings.timeout_s)
        detail = "The process did not react and was ended.\n" + error.log
        return failed_result(job, Status.TIMEOUT, reason, detail)
    except WorkerDiedError as error:
        memory = isinstance(error, WorkerOutOfMemoryError)
        status = Status.OUT_OF_MEMORY if memory else Status.CRASHED
        return failed_result(job, status, str(error), f"{error}\n{error.log}")
    except (BrokenExecutor, InvalidInputError):
        raise
    except (OSError, MemoryError, RuntimeError) as error:
        raise BatchStoppedError(batch_stopped(error)) from error
    except Exception as error:
        return failed_result(job, Status.CRASHED, describe(error))
