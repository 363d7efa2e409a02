"""`Experiment`: several suites, policies with parameters, and what is measured."""

from __future__ import annotations

import shutil
import tempfile
import zlib
from collections.abc import Hashable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from pushplan.evaluation.report.results import Results
from pushplan.evaluation.run.batch import TRACES, Progress, run_batch, worker_count
from pushplan.evaluation.run.compatibility import is_wanted, misfits
from pushplan.evaluation.run.job_identity import identified
from pushplan.evaluation.run.job_limits import MEMORY_MB
from pushplan.evaluation.run.jobs import Job, JobSettings
from pushplan.evaluation.run.pending import sorted_out
from pushplan.evaluation.run.policy_specs import PolicySpec, parse_policies
from pushplan.evaluation.store.database import DATABASE, read_results, reading
from pushplan.evaluation.store.rescoring import rescore
from pushplan.evaluation.store.rows import setting_of
from pushplan.files.safe_files import read_data
from pushplan.metrics import metric_function
from pushplan.scenarios.suite import Suite, distinct
from pushplan.world import InvalidInputError, UnknownNameError
from pushplan.world.checks import choice, expect, integer

EPISODE_BYTES = 20_000
"""A recorded episode in a maze or a small room (measured: 18 to 26 kB); larger scenes have more."""
_MEASURED = 200  # recorded episodes whose mean size is taken


@dataclass(frozen=True)
class Cost:
    """The expected cost of a batch.

    Attributes:
        jobs: all of them.
        new: those without a result.
        seconds: what the new ones take [s], by the stored episodes; None where there are none.
        most_s: what they take if each uses its whole time limit [s]; None without a limit.
        stored: episodes in the run directory.
        size: of what the new ones store [byte].
        free: what the disk has room for [byte].
    """

    jobs: int
    new: int
    seconds: float | None
    most_s: float | None
    stored: int
    size: float
    free: int


@dataclass(frozen=True)
class Experiment:
    """Every policy on every scenario that it is made for.

    Args:
        name: what the report is called.
        suites: the scenarios.
        policies: each with its parameters, under a label of its own.
        settings: what all jobs share.
        metrics: beside those that every run has: names of `pushplan.metrics`, or functions as
            ``"module:function"`` or ``"file.py:function"``.
        memory_limit_mb: private memory of a worker at which allocations fail [MB]; None for no
            limit.
        about: what else is noted about the run: JSON values.
        traces: which recorded episodes are kept: ``"all"``, ``"failures"`` (those without success)
            or ``"none"``. Metrics of one's own, replays and `rescore` need them.
        only: name of a suite -> labels of the policies that run on it; all that fit by default.
        allow_misfits: leave out a policy that fits no suite; else it is refused.
        skipped: (suite, policy label) -> why that pair is not run.

    Raises:
        InvalidInputError: if there is nothing to run, or two policies share a label.
        UnknownNameError: if there is no such metric.
        UnusablePolicyError: if a policy cannot be made, or fits no suite.
    """

    name: str
    suites: tuple[Suite, ...]
    policies: tuple[PolicySpec, ...]
    settings: JobSettings = field(default_factory=JobSettings)
    metrics: tuple[str, ...] = ()
    memory_limit_mb: float | None = MEMORY_MB
    about: Mapping[str, Any] = field(default_factory=dict)
    traces: str = "all"
    only: Mapping[str, Sequence[str]] = field(default_factory=dict)
    allow_misfits: bool = False
    skipped: Mapping[tuple[str, str], str] = field(init=False)

    def __post_init__(self) -> None:
        expect("settings", self.settings, JobSettings)
        choice("traces", self.traces, TRACES)
        if self.metrics and self.traces != "all":
            raise InvalidInputError("metrics of one's own need traces: all")
        if not self.suites:
            raise InvalidInputError("an experiment needs at least one suite")
        object.__setattr__(self, "suites", distinct(self.suites))
        for metric in self.metrics:
            metric_function(metric)
        object.__setattr__(self, "policies", tuple(parse_policies(self.policies)))
        labels = [p.label for p in self.policies]
        names = [one.name for one in self.suites]
        for name, wanted in self.only.items():
            if name not in names:
                raise UnknownNameError("suite of this experiment", name, names)
            for label in wanted:
                if label not in labels:
                    raise UnknownNameError("policy of this experiment", label, labels)
        found = misfits(
            self.policies,
            self.suites,
            self.settings,
            only=self.only,
            allow_all=self.allow_misfits,
        )
        object.__setattr__(self, "skipped", found)

    @classmethod
    def load(cls, path: str | Path) -> Experiment:
        """Read a YAML file; files that it names are looked for beside it.

        Raises:
            SchemaError: if it is missing, not YAML, or off the schema.
            UnknownNameError: if there is no suite, policy, parameter, variation or metric of a
                name.
            UnusablePolicyError: as the class.
        """
        return cls.from_dict(read_data(path, "experiment file"), Path(path).parent)

    @classmethod
    def from_dict(cls, data: object, folder: Path = Path()) -> Experiment:
        """Read plain values, as in a file of that folder; errors as `load`."""
        from pushplan.evaluation.experiment_file import fields_of

        return cls(**fields_of(data, folder))

    @property
    def jobs(self) -> list[Job]:
        """Jobs to run, with the policies of a scenario close together."""
        return [
            Job(spec, scenario)
            for suite in self.suites
            for scenario in suite.scenarios
            for spec in self.policies
            if (suite.name, spec.label) not in self.skipped and is_wanted(spec, suite, self.only)
        ]

    def cost(
        self,
        out: str | Path,
        *,
        workers: int | None = None,
        retry_failed: bool = False,
        any_version: bool = False,
        shard: tuple[int, int] | None = None,
    ) -> Cost:
        """Number of jobs of `run`, about how long they take, and about what they store.

        A job is expected to take the mean of its policy in its setting, else of its policy, else
        of all stored episodes.
        """
        out = Path(out)
        jobs = self._part(shard)
        stored = []
        if (out / DATABASE).is_file():
            with reading(out) as db:
                stored = read_results(db)
            jobs = identified(jobs, self.settings)  # which takes a while where there are many
        kept = [one for one in stored if not (retry_failed and one.row.failed)]
        _, new = sorted_out(jobs, kept, any_version)
        rows = [one.row for one in stored]
        times: dict[Hashable, list[float]] = {}
        for row in rows:
            for key in ((row.policy, row.setting), row.policy, None):
                times.setdefault(key, []).append(row.wall_time_s or 0.0)
        means = {key: float(np.mean(found)) for key, found in times.items()}
        seconds = 0.0
        most_s = None
        for job in new if means else ():
            label = job.policy.label
            known = ((label, setting_of(*job.key[1:])), label, None)
            seconds += next(means[key] for key in known if key in means)
        size = float(EPISODE_BYTES)
        files = list((out / "episodes").glob("*.npz"))[:_MEASURED]
        if files:
            size = float(np.mean([file.stat().st_size for file in files]))
        there = next(one for one in (out.absolute(), *out.absolute().parents) if one.exists())
        abreast = max(1, min(worker_count(workers), len(new)))
        if self.settings.timeout_s is not None:
            most_s = self.settings.timeout_s * len(new) / abreast
        return Cost(
            jobs=len(jobs),
            new=len(new),
            seconds=seconds / abreast if rows or not new else None,
            most_s=most_s,
            stored=len(rows),
            size=size * len(new) if self.traces == "all" else 0.0,
            free=shutil.disk_usage(there).free,
        )

    def run(
        self,
        out: str | Path | None = None,
        *,
        workers: int | None = None,
        retry_failed: bool = False,
        any_version: bool = False,
        shard: tuple[int, int] | None = None,
        dask: str | None = None,
        progress: Progress | None = None,
    ) -> Results:
        """Run what has not been run yet in the run directory ``out``; see `run_batch`.

        Suites, policies and episodes may be added to an experiment that was run before, or left
        out: results that are not asked for stay stored.

        Args:
            out: run directory; if None only the rows are kept, and traces are dropped.
            workers: processes, all cores by default; 0 runs in this process.
            retry_failed: run jobs again whose row says that they failed.
            any_version: take results that differ only in versions of pushplan and of packages.
            shard: (k, n): only the k-th of n parts of the jobs, k from 1; `merge` joins the run
                directories of all parts.
            dask: ``"local:N"``, or the address of a Dask scheduler on whose workers jobs run.
            progress: told of every row.

        Returns:
            The results of these jobs.
        """
        with ExitStack() as stack:
            temporary = stack.enter_context(tempfile.TemporaryDirectory(prefix="pushplan-"))
            folder = Path(temporary if out is None else out)
            executor = None
            if dask is not None:
                from pushplan.evaluation.run.cluster import dask_executor

                executor = stack.enter_context(dask_executor(dask, self.memory_limit_mb))
                workers = executor.window
            run_batch(
                self._part(shard),
                out=folder,
                workers=workers,
                executor=executor,
                settings=self.settings,
                memory_limit_mb=self.memory_limit_mb,
                retry_failed=retry_failed,
                any_version=any_version,
                traces=self.traces,
                about={"suite": self.name, **self.about},
                progress=progress,
            )
            if self.metrics:
                rescore(folder, self.metrics, columns=False)
            results = Results.load(folder)
        return results if out is not None else replace(results, path=None)

    def _part(self, shard: tuple[int, int] | None) -> list[Job]:
        return self.jobs if shard is None else part_of(self.jobs, *shard)


def part_of(jobs: Sequence[Job], part: int, parts: int) -> list[Job]:
    """The jobs of the ``part``-th of so many parts, counted from 1.

    A job stays in its part when others are added: it is chosen by a hash of what tells it apart.

    Raises:
        InvalidInputError: if there is no such part.
    """
    integer("parts", parts, low=1)
    integer("part", part, low=1, high=parts)
    return [job for job in jobs if zlib.crc32(repr(job.key).encode()) % parts == part - 1]
