"""Run one episode or a batch, store what happened, and say what it means.

Everything is imported on first use, so that one door does not pay for the others.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pushplan.evaluation.batch import run_batch
    from pushplan.evaluation.benchmark import bench
    from pushplan.evaluation.compatibility import UnusablePolicyError
    from pushplan.evaluation.episode import InvalidActionError, PolicyError, run_episode
    from pushplan.evaluation.jobs import Job, JobResult, JobSettings
    from pushplan.evaluation.paper import Comparison, bench_paper
    from pushplan.evaluation.policies import PolicySpec, parse_policies, parse_policy
    from pushplan.evaluation.pool import WorkerPool
    from pushplan.evaluation.push_plots import push_figure
    from pushplan.evaluation.results import Results, compare
    from pushplan.evaluation.rows import TIMING_COLUMNS, ResultRow, Status, columns
    from pushplan.evaluation.statistics import Estimate, Proportion, bootstrap_interval, wilson
    from pushplan.evaluation.summary import PairedDifference, PolicySummary

_HOMES = {
    "batch": ("run_batch",),
    "benchmark": ("bench",),
    "episode": ("InvalidActionError", "PolicyError", "run_episode"),
    "compatibility": ("UnusablePolicyError",),
    "jobs": ("Job", "JobSettings", "JobResult"),
    "paper": ("Comparison", "bench_paper"),
    "policies": ("PolicySpec", "parse_policies", "parse_policy"),
    "pool": ("WorkerPool",),
    "push_plots": ("push_figure",),
    "results": ("Results", "compare"),
    "rows": ("TIMING_COLUMNS", "ResultRow", "Status", "columns"),
    "statistics": ("Estimate", "Proportion", "bootstrap_interval", "wilson"),
    "summary": ("PairedDifference", "PolicySummary"),
}
_LAZY = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "TIMING_COLUMNS", "Comparison", "Estimate", "InvalidActionError", "Job", "JobResult",
    "JobSettings", "PairedDifference", "PolicyError", "PolicySpec", "PolicySummary", "Proportion",
    "ResultRow", "Results", "Status", "UnusablePolicyError", "WorkerPool", "bench", "bench_paper",
    "bootstrap_interval", "columns", "compare", "parse_policies", "parse_policy", "push_figure",
    "run_batch", "run_episode", "wilson",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"pushplan.evaluation.{_LAZY[name]}"), name)


def __dir__() -> list[str]:
    return __all__
