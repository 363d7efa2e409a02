"""Run one episode or a batch, store what happened, and say what it means.

Everything is imported on first use, so that one door does not pay for the others.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pushplan.world.lazy_names import lazy_names

if TYPE_CHECKING:
    from pushplan.evaluation.batch import run_batch
    from pushplan.evaluation.benchmark import bench
    from pushplan.evaluation.comparing import Rule, Verdict, compare_runs
    from pushplan.evaluation.database import DamagedResultsError
    from pushplan.evaluation.episode import InvalidActionError, PolicyError, run_episode
    from pushplan.evaluation.experiment import Experiment
    from pushplan.evaluation.jobs import Job, JobResult, JobSettings
    from pushplan.evaluation.merging import Merged, merge
    from pushplan.evaluation.policies import (
        PolicySpec,
        UnusablePolicyError,
        parse_planner,
        parse_policies,
        parse_policy,
    )
    from pushplan.evaluation.reproduction import Reproduction, reproduce
    from pushplan.evaluation.rescoring import Rescored, rescore
    from pushplan.evaluation.results import Results
    from pushplan.evaluation.rows import TIMING_COLUMNS, ResultRow, Status, columns
    from pushplan.evaluation.salvaging import Salvaged, salvage
    from pushplan.evaluation.statistics import Estimate, Proportion, bootstrap_interval, wilson
    from pushplan.evaluation.status import RunStatus, run_status
    from pushplan.evaluation.stress_testing import CONDITIONS, Condition, ScoreSheet, stress
    from pushplan.evaluation.summary import PairedDifference, PolicySummary

__all__ = [
    "CONDITIONS",
    "TIMING_COLUMNS",
    "Condition",
    "DamagedResultsError",
    "Estimate",
    "Experiment",
    "InvalidActionError",
    "Job",
    "JobResult",
    "JobSettings",
    "Merged",
    "PairedDifference",
    "PolicyError",
    "PolicySpec",
    "PolicySummary",
    "Proportion",
    "Reproduction",
    "Rescored",
    "ResultRow",
    "Results",
    "Rule",
    "RunStatus",
    "Salvaged",
    "ScoreSheet",
    "Status",
    "UnusablePolicyError",
    "Verdict",
    "bench",
    "bootstrap_interval",
    "columns",
    "compare_runs",
    "merge",
    "parse_planner",
    "parse_policies",
    "parse_policy",
    "reproduce",
    "rescore",
    "run_batch",
    "run_episode",
    "run_status",
    "salvage",
    "stress",
    "wilson",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "batch": "run_batch",
        "benchmark": "bench",
        "comparing": "Rule Verdict compare_runs",
        "database": "DamagedResultsError",
        "episode": "InvalidActionError PolicyError run_episode",
        "experiment": "Experiment",
        "jobs": "Job JobResult JobSettings",
        "merging": "Merged merge",
        "policies": "PolicySpec UnusablePolicyError parse_policies parse_policy parse_planner",
        "reproduction": "Reproduction reproduce",
        "rescoring": "Rescored rescore",
        "results": "Results",
        "rows": "TIMING_COLUMNS ResultRow Status columns",
        "statistics": "Estimate Proportion bootstrap_interval wilson",
        "salvaging": "Salvaged salvage",
        "status": "RunStatus run_status",
        "stress_testing": "CONDITIONS Condition ScoreSheet stress",
        "summary": "PairedDifference PolicySummary",
    },
)
