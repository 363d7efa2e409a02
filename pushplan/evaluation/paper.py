"""Every policy on the suites that mirror the tables of the Bench-Push paper, side by side."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from pushplan.evaluation.batch import Progress
from pushplan.evaluation.benchmark import Given
from pushplan.evaluation.compatibility import read_policies
from pushplan.evaluation.experiment import Experiment
from pushplan.evaluation.jobs import Job, JobSettings
from pushplan.evaluation.limits import MEMORY_MB
from pushplan.evaluation.paper_tables import overview, paper_table, preface, training_cost
from pushplan.evaluation.policies import policy_names
from pushplan.evaluation.published import PublishedTable, chosen_tables
from pushplan.evaluation.results import Results
from pushplan.evaluation.rows import ResultRow, setting_of
from pushplan.evaluation.table_formats import markdown, text
from pushplan.evaluation.tables import Table
from pushplan.metrics import compute
from pushplan.world import Episode
from pushplan.world.files import write_atomic

TO_GOAL_POINT = "E_nav_to_goal_point"
EPISODES = 100


@dataclass(frozen=True)
class Comparison:
    """Our results beside the paper's.

    Args:
        results: of all suites.
        published: what the paper says, one for each suite.
        incompatible: (suite, policy) -> why it was not run.
        to_goal_point: (policy, scenario, seed) -> E_nav in the convention of the paper.
        training: label of a network -> what its training took.
        command: what gives the same again, if known.
    """

    results: Results
    published: tuple[PublishedTable, ...]
    incompatible: Mapping[tuple[str, str], str]
    to_goal_point: Mapping[tuple[str, str, int], float]
    training: Mapping[str, str]
    command: str = ""

    def tables(self) -> list[Table]:
        """An overview, then one table a suite: the paper's policies, then ours."""
        rows = [self._rows(table) for table in self.published]
        return [overview(self.published, rows), *(self._table(table) for table in self.published)]

    def table(self, width: int = 160) -> str:
        """The tables as text."""
        return text(self.tables(), width)

    def markdown(self) -> str:
        """The tables as a Markdown document."""
        return f"{preface(self.results, self.command)}\n{markdown(self.tables())}"

    def _rows(self, table: PublishedTable) -> list[ResultRow]:
        setting = _setting(table)
        return [row for row in self.results.rows if row.setting == setting]

    def _table(self, table: PublishedTable) -> Table:
        rows = self._rows(table)
        points = {
            policy: [
                value
                for row in rows
                if row.policy == policy
                if (value := self.to_goal_point.get((policy, row.scenario, row.seed))) is not None
            ]
            for policy in self.results.policies
        }
        unfit = {
            name: why for (suite, name), why in self.incompatible.items() if suite == table.suite
        }
        return paper_table(table, rows, self.results.policies, points, self.training, unfit)


def bench_paper(
    *,
    only: str | Sequence[str] | None = None,
    policies: str | Sequence[Given] | None = None,
    episodes: int = EPISODES,
    seed: int = 0,
    workers: int | None = None,
    out: str | Path | None = None,
    timeout_s: float | None = 600.0,
    memory_limit_mb: float | None = MEMORY_MB,
    retry_failed: bool = False,
    any_version: bool = False,
    shard: tuple[int, int] | None = None,
    dask: str | None = None,
    progress: Progress | None = None,
    command: str = "",
) -> Comparison:
    """Run policies on the suites that mirror the paper's tables, each where it is made for it.

    Args:
        only: names of suites or tasks; all suites of the paper if None.
        policies: as for `bench`; every policy that comes with pushplan if None.
        episodes: scenarios of each suite.
        seed: seed of the first scenario of each suite.
        workers, timeout_s, memory_limit_mb, retry_failed, any_version, shard, dask, progress: as
            for `bench`.
        out: run directory, continued if it holds this run already; suites, policies and episodes
            may be added to it. With it, ``paper.md`` and the report of `Results` are written.
        command: what the document says gives the same again.

    Raises:
        UnknownNameError: if there is no such suite, task or policy.
        UnusablePolicyError: if a policy cannot be made, or was named and is made for no suite.
        InvalidInputError: as `run_batch`.
    """
    from pushplan.scenarios import suite

    tables = chosen_tables(only)
    specs = read_policies(list(policy_names()) if policies is None else policies)
    experiment = Experiment(
        "paper",
        tuple(suite(table.suite, episodes=episodes, first_seed=seed) for table in tables),
        tuple(specs),
        JobSettings(timeout_s=timeout_s),
        memory_limit_mb=memory_limit_mb,
        about={"first_seed": seed},
        allow_misfits=policies is None,
    )
    with tempfile.TemporaryDirectory(prefix="pushplan-") as temporary:
        folder = Path(temporary if out is None else out)
        found = experiment.run(
            folder,
            workers=workers,
            retry_failed=retry_failed,
            any_version=any_version,
            shard=shard,
            dask=dask,
            progress=progress,
        )
        results = _chosen(found, experiment.jobs, None if out is None else folder)
        points = _to_goal_point(results.rows, folder)
    training = {spec.label: training_cost(spec.network) for spec in specs if spec.network}
    comparison = Comparison(results, tables, experiment.skipped, points, training, command)
    if out is not None:
        write_atomic(folder / "paper.md", comparison.markdown().encode())
    return comparison


def _setting(table: PublishedTable) -> str:
    from pushplan.scenarios import suite

    first = suite(table.suite, episodes=1).scenarios[0]
    return setting_of(first.key, first.seed)


def _chosen(results: Results, jobs: Sequence[Job], path: Path | None) -> Results:
    """Without what an earlier run of more suites, policies or episodes left there."""
    wanted = {job.key for job in jobs}
    rows = tuple(r for r in results.rows if (r.policy, r.scenario, r.seed) in wanted)
    return replace(results, rows=rows, path=path)


def _to_goal_point(rows: Sequence[ResultRow], folder: Path) -> dict[tuple[str, str, int], float]:
    """E_nav in the paper's convention, from the stored episodes; 0 for a job that failed."""
    values = {}
    for row in rows:
        if row.E_nav is None:
            continue
        value = 0.0
        if row.success:
            assert row.trace_file is not None
            episode = Episode.load(folder / row.trace_file)
            value = compute(episode, [TO_GOAL_POINT])[TO_GOAL_POINT]
        values[row.policy, row.scenario, row.seed] = value
    return values
