"""The door for most uses: compare policies on a suite."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pushplan.envs.registry import default_preset
from pushplan.evaluation.experiment import Experiment
from pushplan.evaluation.experiment_file import EPISODES
from pushplan.evaluation.report.results import Results
from pushplan.evaluation.run.batch import Progress
from pushplan.evaluation.run.job_limits import MEMORY_MB
from pushplan.evaluation.run.jobs import JobSettings
from pushplan.evaluation.run.policy_specs import PolicySpec, parse_policies, with_deadline
from pushplan.world import InvalidInputError

if TYPE_CHECKING:
    from pushplan.scenarios import Suite

Given = str | Callable[..., Any] | PolicySpec


def bench(
    suite: Any,
    policies: str | Sequence[Given],
    *,
    episodes: int | None = None,
    seed: int = 0,
    workers: int | None = None,
    out: str | Path | None = None,
    timeout_s: float | None = 300.0,
    observation: str = "auto",
    memory_limit_mb: float | None = MEMORY_MB,
    retry_failed: bool = False,
    any_version: bool = False,
    shard: tuple[int, int] | None = None,
    dask: str | None = None,
    latency_factor: float | None = None,
    deadline_s: float | None = None,
    progress: Progress | None = None,
) -> Results:
    """Run every policy on every scenario of a suite.

    Example:
        >>> from pushplan.evaluation import bench
        >>> results = bench("smoke", ["straight"], episodes=2, workers=0)
        >>> len(results.rows)
        2

    Args:
        suite: name of a suite, a folder of worlds with a slash in it, or a task of yours as
            ``"file.py:Class"``, or several of these with commas between them; a
            `pushplan.scenarios.Suite`; or a list of scenarios. A suite of your own is one setting
            of the results.
        policies: names, ``"module:Class"``, ``"file.py:Class"``, each with ``label=`` in front
            if wanted, or callables that make a policy.
        episodes: scenarios of a suite by name, or of each file of a folder; the suite's own
            number, and 1, if None.
        seed: seed of the first scenario of a suite by name.
        workers: processes, all cores by default; 0 runs in this process.
        out: run directory, continued if it holds this run already. If None only the rows are
            kept and traces are dropped.
        timeout_s: wall-clock limit of one episode [s].
        observation: ``"auto"``, ``"image"`` or ``"state"``, see `JobSettings`.
        memory_limit_mb: private memory of a worker at which allocations fail [MB]; None for no
            limit.
        retry_failed: run jobs again whose row says that they failed.
        any_version, shard, dask: as for `Experiment.run`.
        latency_factor: seconds of the world's clock for each second that a policy computes; None
            for a world that stands still meanwhile. See `run_episode`.
        deadline_s: wall-clock limit of each planning call [s], of the policies that take one;
            None for the limits of the policies, which repeat on every machine.
        progress: told of every row.

    Raises:
        UnknownNameError: if there is no such suite or policy.
        UnusablePolicyError: if a policy cannot be made, or for none of the scenarios.
        InvalidInputError: as `run_batch`.
    """
    experiment = bench_experiment(
        suite,
        policies,
        episodes=episodes,
        seed=seed,
        timeout_s=timeout_s,
        observation=observation,
        memory_limit_mb=memory_limit_mb,
        latency_factor=latency_factor,
        deadline_s=deadline_s,
    )
    return experiment.run(
        out,
        workers=workers,
        retry_failed=retry_failed,
        any_version=any_version,
        shard=shard,
        dask=dask,
        progress=progress,
    )


def bench_experiment(
    suite: Any,
    policies: str | Sequence[Given],
    *,
    episodes: int | None = None,
    seed: int = 0,
    timeout_s: float | None = 300.0,
    observation: str = "auto",
    memory_limit_mb: float | None = MEMORY_MB,
    latency_factor: float | None = None,
    deadline_s: float | None = None,
) -> Experiment:
    """Return the experiment that `bench` runs; arguments and errors as there."""
    suites = suites_of(suite, episodes, seed)
    versions = [one.version for one in suites]
    specs = parse_policies(policies)
    if deadline_s is not None:
        specs = [with_deadline(spec, deadline_s) for spec in specs]
    return Experiment(
        ",".join(one.name for one in suites),
        suites,
        tuple(specs),
        JobSettings(observation=observation, timeout_s=timeout_s, latency_factor=latency_factor),
        memory_limit_mb=memory_limit_mb,
        about={
            "suite_version": suites[0].version if len(suites) == 1 else versions,
            "first_seed": seed,
        },
    )


def suites_of(given: Any, episodes: int | None, seed: int) -> tuple[Suite, ...]:
    """Suites, folders of worlds and tasks of users, with commas, a suite, or a list of scenarios.

    Raises:
        UnknownNameError: if there is no suite of a name.
        InvalidInputError: if there is no such folder, or a file is given.
    """
    from pushplan.scenarios import Scenario, Suite, suite, suite_names, world_suite
    from pushplan.scenarios.suite import seeds_of

    if isinstance(given, Suite):
        return (given,)
    if not isinstance(given, str):
        return (Suite("scenarios", 1, tuple(given)),)
    names = [name.strip() for name in given.split(",")]
    for name in names:
        if name not in suite_names() and Path(name).is_file():
            raise InvalidInputError(
                f"{name!r} is a file, no suite and no folder of worlds: give its folder as "
                f"'{Path(name).parent}/', or run one world with "
                f"'pushplan run --task room --set world_file={name} --policy NAME'"
            )
    found = []
    for name in names:
        if ":" in name:
            start = Scenario(name, preset=default_preset(name, "pymunk"), seed=seed)
            found.append(seeds_of(start, episodes or EPISODES))
        elif "/" in name:
            found.append(world_suite(name, episodes=episodes or 1, first_seed=seed))
        else:
            found.append(suite(name, episodes=episodes, first_seed=seed))
    return tuple(found)
