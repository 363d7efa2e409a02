"""How the episodes of each policy ended that did not succeed, in one line for each."""

from __future__ import annotations

from collections import Counter

from pushplan.evaluation.statistics.stored_run import StoredRun

MOST_LINES = 6


def failure_lines(run: StoredRun) -> list[str]:
    """A line for each policy with failed jobs: how many, the most frequent reason, a traceback."""
    lines = []
    for policy in run.policies:
        rows = [row for row in run.rows if row.policy == policy]
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


def unsuccessful_lines(run: StoredRun) -> list[str]:
    """A line for each policy with episodes that ended by the rules of their task without success.

    It says how many ended for each reason. More than `MOST_LINES` policies have one together.
    """
    ended = [row for row in run.rows if not row.failed and not row.success]
    groups = {policy: [row for row in ended if row.policy == policy] for policy in run.policies}
    if len(groups) > MOST_LINES:
        groups = {f"all {len(groups)} policies": ended}
    lines = []
    for policy, rows in groups.items():
        if rows:
            reasons = Counter(row.reason for row in rows).most_common()
            listed = ", ".join(f"{count} {reason}" for reason, count in reasons)
            lines.append(f"{policy} without success: {listed}")
    return lines
