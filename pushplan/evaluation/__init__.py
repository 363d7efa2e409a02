"""Run one episode or a batch, store what happened, and say what it means.

Everything is imported on first use, so that one door does not pay for the others.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pushplan.imports.on_demand import lazy_names

if TYPE_CHECKING:
    from pushplan.evaluation.benchmark import bench
    from pushplan.evaluation.experiment import Experiment
    from pushplan.evaluation.report.comparing import Rule, Verdict, compare_runs
    from pushplan.evaluation.report.results import Results
    from pushplan.evaluation.run.batch import run_batch
    from pushplan.evaluation.run.jobs import Job, JobResult, JobSettings
    from pushplan.evaluation.run.policy_calls import InvalidActionError, PolicyError
    from pushplan.evaluation.run.policy_specs import (
        PolicySpec,
        UnusablePolicyError,
        parse_planner,
        parse_policies,
        parse_policy,
    )
    from pushplan.evaluation.run.recording import run_episode
    from pushplan.evaluation.run.reproduction import Reproduction, Verification, reproduce, verify
    from pushplan.evaluation.statistics.estimates import (
        Estimate,
        Proportion,
        bootstrap_interval,
        wilson,
    )
    from pushplan.evaluation.statistics.summary import PairedDifference, PolicySummary
    from pushplan.evaluation.store.database import DamagedResultsError
    from pushplan.evaluation.store.merging import Merged, Salvaged, merge, salvage
    from pushplan.evaluation.store.rescoring import Rescored, rescore
    from pushplan.evaluation.store.rows import TIMING_COLUMNS, ResultRow, Status, columns
    from pushplan.evaluation.store.status import RunStatus, run_status
    from pushplan.evaluation.stress_testing import CONDITIONS, Condition, ScoreSheet, stress

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
    "Verification",
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
    "verify",
    "wilson",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "run.batch": "run_batch",
        "benchmark": "bench",
        "report.comparing": "Rule Verdict compare_runs",
        "store.database": "DamagedResultsError",
        "run.policy_calls": "InvalidActionError PolicyError",
        "run.recording": "run_episode",
        "experiment": "Experiment",
        "run.jobs": "Job JobResult JobSettings",
        "store.merging": "Merged Salvaged merge salvage",
        "run.policy_specs": (
            "PolicySpec UnusablePolicyError parse_planner parse_policies parse_policy"
        ),
        "run.reproduction": "Reproduction Verification reproduce verify",
        "store.rescoring": "Rescored rescore",
        "report.results": "Results",
        "store.rows": "TIMING_COLUMNS ResultRow Status columns",
        "statistics.estimates": "Estimate Proportion bootstrap_interval wilson",
        "store.status": "RunStatus run_status",
        "stress_testing": "CONDITIONS Condition ScoreSheet stress",
        "statistics.summary": "PairedDifference PolicySummary",
    },
)
