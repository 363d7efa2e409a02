"""Run one job. Whatever goes wrong becomes part of its outcome."""

from __future__ import annotations

import contextlib
import logging
import os
import platform
import random
import time
import traceback
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from pushplan.errors import describe
from pushplan.evaluation.run.job_identity import check_unchanged, read_by
from pushplan.evaluation.run.job_limits import EpisodeTimeout, hard_limit, is_ctrl_c, soft_limit
from pushplan.evaluation.run.jobs import (
    BatchStoppedError,
    Job,
    JobResult,
    JobSettings,
    clipped,
    failed_result,
    timeout_reason,
)
from pushplan.evaluation.run.policy_calls import (
    InvalidActionError,
    PolicyError,
    asked,
    plan_times,
)
from pushplan.evaluation.run.policy_specs import UnusablePolicyError
from pushplan.evaluation.run.recording import Recording
from pushplan.evaluation.store.rows import Status, blank_row, clean_reason, instant, scored_row
from pushplan.imports.observed_reads import Reads, kept, observing
from pushplan.world import InvalidInputError, MissingDependencyError
from pushplan.world.policy_abilities import (
    ChecksEnvironment,
    ChoosesActions,
    ChoosesObservation,
    HoldsDecisions,
    LogsPlans,
    PlansBesideDriving,
    ShowsPlan,
)

DRY_RUN_STEPS = 2
_CLOCKS = {"wall": time.perf_counter, "cpu": time.process_time}
_ABILITIES = (
    *(ChecksEnvironment, ChoosesActions, ChoosesObservation, HoldsDecisions, LogsPlans),
    *(PlansBesideDriving, ShowsPlan),
)
_log = logging.getLogger(__name__)
_dry_runs: set[tuple[str, str, str]] = set()


def execute(job: Job, settings: JobSettings, owner_pid: int | None = None) -> JobResult:
    """Run one job. Whatever goes wrong is in the outcome, unless it ends the process.

    Args:
        job: what to run.
        settings: what all jobs share.
        owner_pid: process that waits for the outcome and cannot end this one by force. Given
            from another process, a job that ignores its limit ends its own process.
    """
    by_force = None
    if owner_pid not in (None, os.getpid()):
        by_force = settings.force_after_s
    reads: Reads = {}
    result = _outcome(job, settings, by_force, reads)
    return replace(result, read=read_by(job, {**kept, **reads}))


def _outcome(job: Job, settings: JobSettings, by_force: float | None, reads: Reads) -> JobResult:
    try:
        check_unchanged(job, settings)
        with observing(reads), _folder_kept(), hard_limit(by_force), soft_limit(settings.timeout_s):
            return _execute(job, settings)
    except BatchStoppedError:
        raise
    except EpisodeTimeout:
        reason = timeout_reason(settings.timeout_s)
        return failed_result(job, Status.TIMEOUT, reason, traceback.format_exc())
    except MemoryError as error:
        error.__traceback__ = None  # its frames hold what took the memory
        return failed_result(job, Status.OUT_OF_MEMORY, "an allocation failed", "MemoryError")
    except BaseException as error:  # what a policy left behind trips whoever reads it
        if is_ctrl_c(error):
            raise
        return failed_result(job, Status.POLICY_ERROR, describe(error), traceback.format_exc())


@contextlib.contextmanager
def _folder_kept() -> Iterator[None]:
    """Go back to the working folder, in which the files of the next job are looked for."""
    folder = os.getcwd()
    try:
        yield
    finally:
        os.chdir(folder)


def _execute(job: Job, settings: JobSettings) -> JobResult:
    if settings.dry_run:
        dry_run(job, settings)
    # a policy that uses the global generators against our advice repeats all the same
    random.seed(job.scenario.seed)
    np.random.seed(job.scenario.seed % 2**32)  # noqa: NPY002
    try:
        policy = job.policy.make()
    except UnusablePolicyError as error:
        return failed_result(job, Status.POLICY_ERROR, str(error), traceback.format_exc())
    recording = Recording(
        policy,
        job.scenario,
        job.policy.label,
        latency_factor=settings.latency_factor,
        clock=_CLOCKS[settings.clock],
    )
    begin = time.perf_counter()
    began = instant()
    status = Status.DONE
    detail = ""
    try:
        # whoever looks at a policy later may look at what raises
        asked(lambda: [isinstance(policy, one) for one in _ABILITIES])
        try:
            env = settings.environment(job.scenario, policy)
        except MissingDependencyError as error:
            raise BatchStoppedError(str(error)) from error
        begin = time.perf_counter()
        try:
            recording.run(env)
        finally:
            getattr(env, "close", _nothing)()
    except (BatchStoppedError, MemoryError):
        raise
    except Exception as error:
        status = Status.ENV_ERROR
        reason = describe(error)
        if isinstance(error, PolicyError):
            invalid = isinstance(error, InvalidActionError)
            status = Status.INVALID_ACTION if invalid else Status.POLICY_ERROR
            reason = str(error)
        recording.reason = clean_reason(reason)
        detail = traceback.format_exc()
    reason = clean_reason(recording.reason)
    row = replace(
        blank_row(job.policy.label, job.scenario, status, reason),
        wall_time_s=time.perf_counter() - begin,
        began=began,
        host=platform.node(),
    )
    if not recording.started:
        return JobResult(row, detail=detail)
    episode = recording.episode()
    calls = plan_times(policy)
    row = scored_row(row, episode, None if calls is None else len(calls))
    try:
        trace = episode.to_bytes()
    except InvalidInputError as error:  # too large: the scores are there all the same
        _log.warning("%s in %s is not kept: %s", job.policy.label, job.title, error)
        trace = None
    return JobResult(row, trace, clipped(detail))


def dry_run(job: Job, settings: JobSettings) -> None:
    """Load what a job needs; what goes wrong here goes wrong again in the job."""
    what = (job.policy.label, job.policy.identity, job.scene)
    if what in _dry_runs:
        return
    _dry_runs.add(what)
    with contextlib.suppress(Exception, SystemExit):
        policy = job.policy.make()
        env = settings.environment(job.scenario, policy)
        try:
            Recording(policy, job.scenario).run(env, limit=DRY_RUN_STEPS)
        finally:
            getattr(env, "close", _nothing)()


def _nothing() -> None:
    """An environment without ``close`` needs none."""
