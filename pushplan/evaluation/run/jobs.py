"""A job is one policy on one scenario; what became of it is an outcome."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

from pushplan.errors import describe
from pushplan.evaluation.run.policy_calls import wanted_observation
from pushplan.evaluation.run.policy_specs import PolicySpec
from pushplan.evaluation.store.rows import ResultRow, Status, blank_row, checked_row, clean_reason
from pushplan.imports.named_objects import load_object
from pushplan.world import ChecksEnvironment, ChoosesActions, InvalidInputError, Policy
from pushplan.world.checked_fields import CheckedFields, NonNegativeFloat, OneOf, PositiveFloat

DEFAULT_ENV = "pushplan.envs:make"
MOST_READS = 1000
"""Most files and environment variables that are noted for a job: the first that it reads."""
DETAIL_HALF = 10_000  # characters of a traceback that are kept at its beginning and at its end


class BatchStoppedError(InvalidInputError):
    """Something is wrong that is no policy's fault: nothing is recorded, and the batch ends."""


def batch_stopped(error: BaseException) -> BatchStoppedError:
    """The error to raise where files, processes or memory of a batch itself fail."""
    return BatchStoppedError(
        f"no job can be run now ({describe(error)}); what was stored is kept, and the same command "
        "goes on"
    )


@dataclass(frozen=True)
class Job:
    """One policy on one scenario.

    Args:
        policy: how to make the policy.
        scenario: a `pushplan.scenarios.Scenario`, or anything with ``task``, ``simulator``,
            ``key``, ``seed`` and ``to_dict``.
        spec: what `job_spec` says about it, where a batch has asked.
    """

    policy: PolicySpec
    scenario: Any
    spec: Mapping[str, Any] | None = None

    @property
    def key(self) -> tuple[str, str, int]:
        """Key of the job among others of a batch: policy, scenario key, seed."""
        return (self.policy.label, str(self.scenario.key), int(self.scenario.seed))

    @property
    def id(self) -> str:
        """Text of the column ``job``; empty where nobody has asked for its specification."""
        return "" if self.spec is None else job_id(self.spec)

    @property
    def scene(self) -> str:
        """Text that is the same for scenarios whose environments are alike, whatever the seed."""
        data = {**self.scenario.to_dict(), "seed": 0, "name": ""}
        return json.dumps(data, sort_keys=True, default=repr)

    @property
    def title(self) -> str:
        """The scenario without its seed, in words."""
        data = self.scenario.to_dict()
        parts = [str(data[key]) for key in ("task", "simulator", "preset") if key in data]
        changes = data.get("variations", {}).items()
        extra = [f"{key}={os.path.basename(str(value))}" for key, value in changes]
        words = map(os.path.basename, parts)  # of files without their folders
        return " ".join([*words, *extra])


@dataclass(frozen=True)
class JobSettings(CheckedFields):
    """Settings that all jobs of a batch share.

    Args:
        make_env: factory of environments, as a callable or as ``"module:function"``; called as
            ``make_env(scenario, observation=...)``, and with ``action=...`` where the policy
            `ChoosesActions`.
        observation: kind of observation; ``"auto"`` takes what a policy that
            `ChoosesObservation` asks for, else ``"state"``.
        timeout_s: wall-clock limit of one job [s], None for none.
        grace_s: how much later a job is ended by force [s].
        dry_run: in each process, run the first steps of a policy's first job once without
            recording them, so that the loading of libraries is in nobody's planning times.
        latency_factor: seconds of the world's clock for each second that a policy computes; None
            for a world that stands still meanwhile. See `run_episode`.
        clock: what times of decisions count: ``"wall"``, or ``"cpu"``, the processor time of the
            process, to which other processes on the machine matter little.
    """

    make_env: str | Callable[..., Any] = DEFAULT_ENV
    observation: str = "auto"
    timeout_s: PositiveFloat | None = 300.0
    grace_s: NonNegativeFloat = 2.0
    dry_run: bool = True
    latency_factor: NonNegativeFloat | None = None
    clock: Annotated[str, OneOf(("wall", "cpu"))] = "wall"

    @property
    def force_after_s(self) -> float | None:
        """When a job is ended by force [s]."""
        if self.timeout_s is None:
            return None
        return self.timeout_s + self.grace_s

    def environment(self, scenario: Any, policy: Policy | None, **options: Any) -> Any:
        """A fresh environment for one job; ``options`` go to its factory."""
        observation = self.observation
        if observation == "auto":
            wanted = wanted_observation(policy)
            observation = "state" if wanted is None else wanted
        if isinstance(policy, ChoosesActions):
            options = {"action": policy.actions, **options}
        make = self.make_env
        if isinstance(make, str):
            make = load_object(make)
        env = make(scenario, observation=observation, **options)
        if isinstance(policy, ChecksEnvironment):
            policy.check_environment(env, scenario)
        return env


@dataclass(frozen=True)
class JobResult:
    """Outcome of a job.

    Args:
        row: its row of the results.
        trace: the recorded episode as the bytes of an ``.npz`` file, if anything was recorded.
        detail: traceback of a failure.
        read: hash of each file and environment variable that code of users has read.
    """

    row: ResultRow
    trace: bytes | None = None
    detail: str = ""
    read: Mapping[str, str] = field(default_factory=dict)

    @property
    def tainted(self) -> bool:
        """True if the process that ran the job should not run another one."""
        return self.row.status in (Status.TIMEOUT, Status.OUT_OF_MEMORY)

    def checked(self, job: Job) -> JobResult:
        """This result, or a failure if it cannot be one of that job."""
        try:
            row = checked_row(self.row)
            texts = [text for pair in self.read.items() for text in pair]
            if len(texts) > 2 * MOST_READS or not all(isinstance(one, str) for one in texts):
                raise TypeError("what it has read is no table of hashes")
            mine = blank_row(job.policy.label, job.scenario, Status.DONE, "")
            for name in ("policy", "task", "simulator", "scenario", "seed"):
                if getattr(row, name) != getattr(mine, name):
                    raise ValueError(f"{name} is {getattr(row, name)!r:.60}")
        except (KeyError, TypeError, ValueError) as error:
            return failed_result(job, Status.POLICY_ERROR, f"impossible result: {error}")
        return replace(self, row=row, detail=clipped(self.detail))


def job_id(spec: Mapping[str, Any]) -> str:
    """Content hash of what `job_spec` gave, 32 hexadecimal digits.

    Where the file of a policy or a task lies does not count: its content does, in ``identity`` or
    ``files``. What the job has ``read`` is known only afterwards: `pending_jobs` compares it.
    """
    policy = {name: spec["policy"][name] for name in ("label", "identity")}
    scenario = dict(spec["scenario"])
    if "task" in scenario:
        scenario["task"] = os.path.basename(str(scenario["task"]))
    known = {name: value for name, value in spec.items() if name != "read"}
    text = json.dumps({**known, "policy": policy, "scenario": scenario}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def clipped(detail: str) -> str:
    """A traceback without its middle, if it is long."""
    if len(detail) <= 2 * DETAIL_HALF:
        return detail
    return f"{detail[:DETAIL_HALF]}\n...\n{detail[-DETAIL_HALF:]}"


def failed_result(job: Job, status: Status, reason: str, detail: str = "") -> JobResult:
    """The outcome of a job of which nothing was recorded."""
    row = blank_row(job.policy.label, job.scenario, status, clean_reason(reason))
    return JobResult(row, detail=clipped(detail))


def timeout_reason(timeout_s: float | None) -> str:
    """Why a job was ended."""
    return f"not done after {timeout_s:g} s of wall-clock time"
