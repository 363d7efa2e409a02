"""How the episodes of each policy ended that did not succeed, in one line for each."""

from __future__ import annotations

from collections import Counter

from pushplan.evaluation.rows import ResultRow
from pushplan.evaluation.run_record import RunRecord

MOST_LINES = 6


def failure_lines(run: RunRecord) -> list[str]:
    """A line for each policy with failed jobs: how many, the most frequent reason, a traceback."""
    lines = []
    for policy, rows in _by_policy(run).items():
        failed = [row for row in rows if row.failed]
        if not failed:
            continue
        ((reason, count),) = Counter(row.reason for row in failed).most_common(1)
        most = "" if count == len(failed) else f", {count} of these"
        line = f"{policy}: {len(failed)} of {len(rows)} failed{most}: {reason}"
        files = (run.path / row.detail_file for row in failed if run.path and row.reason == reason)
        if (file := next((one for one in files if one.is_file()), None)) is not None:
            line += f"; traceback: {file}"
        lines.append(line)
    return lines


def unsuccessful_lines(run: RunRecord) -> list[str]:
    """A line for each policy with episodes that ended by the rules of their task without success.

    It says how many ended for each reason. More than `MOST_LINES` policies have one together.
    """
    lines = []
    groups = _by_policy(run)
    if len(groups) > MOST_LINES:
        groups = {f"all {len(groups)} policies": list(run.rows)}
    for policy, rows in groups.items():
        reasons = Counter(row.reason for row in rows if not row.failed and not row.success)
        if reasons:
            listed = ", ".join(f"{count} {reason}" for reason, count in reasons.most_common())
            lines.append(f"{policy} without success: {listed}")
    return lines


def _by_policy(run: RunRecord) -> dict[str, list[ResultRow]]:
    found: dict[str, list[ResultRow]] = {policy: [] for policy in run.policies}
    for row in run.rows:
        found[row.policy].append(row)
    return found
