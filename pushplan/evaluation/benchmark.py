"""The door for most uses: compare policies on a suite."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from pushplan.evaluation.batch import Progress, run_batch
from pushplan.evaluation.compatibility import usable_policies
from pushplan.evaluation.jobs import Job, JobSettings
from pushplan.evaluation.policies import PolicySpec
from pushplan.evaluation.results import Results

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
    memory_limit_mb: float | None = None,
    retry_failed: bool = False,
    latency_factor: float | None = None,
    progress: Progress | None = None,
) -> Results:
    """Run every policy on every scenario of a suite.

    Example:
        >>> from pushplan.evaluation import bench
        >>> results = bench("smoke", ["straight"], episodes=2, workers=0)
        >>> len(results.rows)
        2

    Args:
        suite: name of a suite, a `pushplan.scenarios.Suite`, or a list of scenarios.
        policies: names, ``"module:Class"``, ``"file.py:Class"``, each with ``label=`` in front
            if wanted, or callables that make a policy.
        episodes: scenarios of a suite by name; the suite's own number if None.
        seed: seed of the first scenario of a suite by name.
        workers: processes, all cores by default; 0 runs in this process.
        out: run directory, continued if it holds this run already. If None only the rows are
            kept and traces are dropped.
        timeout_s: wall-clock limit of one episode [s].
        observation: ``"auto"``, ``"image"`` or ``"state"``, see `JobSettings`.
        memory_limit_mb: private memory of a worker at which allocations fail [MB].
        retry_failed: run jobs again whose row says that they failed.
        latency_factor: seconds of the world's clock for each second that a policy computes; None
            for a world that stands still meanwhile. See `run_episode`.
        progress: told of every row.

    Raises:
        UnknownNameError: if there is no such suite or policy.
        UnusablePolicyError: if a policy cannot be made, or for none of the scenarios.
        InvalidInputError: as `run_batch`.
    """
    settings = JobSettings(
        observation=observation, timeout_s=timeout_s, latency_factor=latency_factor
    )
    name, version, scenarios = scenarios_of(suite, episodes, seed)
    specs = usable_policies(policies, scenarios, settings)
    # all policies of a scenario close together: a run that is cut short still compares them
    jobs = [Job(spec, scenario) for scenario in scenarios for spec in specs]
    options: dict[str, Any] = {
        "workers": workers,
        "settings": settings,
        "memory_limit_mb": memory_limit_mb,
        "retry_failed": retry_failed,
        "about": {"suite": name, "suite_version": version, "first_seed": seed},
        "progress": progress,
    }
    if out is not None:
        run_batch(jobs, out=out, **options)
        return Results.load(out)
    with tempfile.TemporaryDirectory(prefix="pushplan-") as folder:
        run_batch(jobs, out=folder, **options)
        loaded = Results.load(folder)
    return Results(loaded.rows, loaded.about, None)


def scenarios_of(given: Any, episodes: int | None, seed: int) -> tuple[str, int, Sequence[Any]]:
    """Name, version and scenarios of a suite by name, a suite, or a list of scenarios."""
    from pushplan.scenarios import Suite, suite

    if isinstance(given, str):
        given = suite(given, episodes=episodes, first_seed=seed)
    if isinstance(given, Suite):
        return given.name, given.version, given.scenarios
    return "scenarios", 1, list(given)
