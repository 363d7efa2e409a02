"""``pushplan runs``: commands on run directories."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from pushplan.cli.common import duration, say, tell
from pushplan.cli.output_files import check_directory, check_file
from pushplan.cli.progress import progress_of

if TYPE_CHECKING:
    from pushplan.evaluation import Reproduction

_NO_LOSS = "success<-0.0,E_nav<-0.0,I_nav<-0.0,S_manip<-0.0,E_manip<-0.0,I_manip<-0.0"
"""Rules of 'compare' that judge without closing a gate."""


def say_status(options: argparse.Namespace) -> int:
    """Say how far a run is, and what takes long."""
    from pushplan.evaluation import run_status

    now = run_status(options.directory)
    states = {True: "running", False: "at rest", None: "running or not, there are no file locks"}
    lines = [f"{states[now.active]}: {now.done} of {now.jobs} jobs done"]
    if now.per_minute:
        left = ""
        if now.left_s is not None:
            left = f", about {duration(now.left_s)} left"
        lines.append(f"{now.per_minute:.3g} a minute{left}")
    if now.failed:
        lines.append(f"{now.failed} failed")
    lines += [f"in hand for {duration(seconds)}: {title}" for title, seconds in now.running]
    lines += [f"took {duration(seconds)}: {title}" for title, seconds in now.slowest]
    tell(options, now, *lines)
    return 0


def compare_runs(options: argparse.Namespace) -> int:
    """Judge, print the verdicts."""
    from pushplan import evaluation
    from pushplan.evaluation.report.comparing import verdict_table
    from pushplan.evaluation.report.table_formats import text

    verdicts = evaluation.compare_runs(options.old, options.new, options.fail_on or _NO_LOSS)
    lines = []
    for setting in dict.fromkeys(one.setting for one in verdicts):
        table = verdict_table([one for one in verdicts if one.setting == setting])
        lines += [setting, text([table])]
    tell(options, [{**vars(one), "rule": str(one.rule)} for one in verdicts], *lines)
    if options.fail_on is None:
        return 0
    bad = [v for v in verdicts if v.failed or (options.strict and v.verdict == "unclear")]
    return 1 if bad else 0


def merge_runs(options: argparse.Namespace) -> int:
    """Take the results of run directories into one."""
    from pushplan.evaluation import merge

    check_directory(options.out)
    found = merge(options.out, options.directories)
    lines = [f"{found.added} results taken into {options.out}, {found.known} were there already"]
    if found.differing:
        count = len(found.differing)
        lines.append(f"{count} of these differ, {found.differing[0]} first: kept as they were")
    if found.incomplete:
        count = len(found.incomplete)
        lines.append(f"{count} left out for damaged episodes: {found.incomplete[0]} ...")
    tell(options, found, *lines)
    return 1 if found.incomplete else 0


def rescore_run(options: argparse.Namespace) -> int:
    """Compute the metrics of stored episodes again."""
    from pushplan.evaluation import Results, rescore
    from pushplan.evaluation.report.table_formats import text

    metrics = [name for name in options.metrics.split(",") if name]
    done = rescore(options.directory, metrics)
    lines = [f"{done.episodes} episodes scored, {len(done.changed)} rows changed"]
    if done.unreadable:
        count = len(done.unreadable)
        lines.append(f"{count} episodes cannot be read: job {done.unreadable[0]} first")
    if metrics:
        lines.append(text(Results.load(options.directory).measure(metrics)))
    tell(options, done, *lines)
    return 1 if done.unreadable else 0


def reproduce_job(options: argparse.Namespace) -> int:
    """Run a stored job again; 1 if it ends differently."""
    from pushplan.evaluation import reproduce

    found = reproduce(options.directory, options.job)
    row = found.stored
    lines = [f"{row.policy} on {row.scenario}: {row.status} ({row.reason})"]
    if found.changed:
        lines.append(f"changed since: {found.changed}")
    if found.same:
        lines.append("the same to the byte, times aside")
    tell(options, _compared(found), *lines)
    return _say_differing([found])


def verify_run(options: argparse.Namespace) -> int:
    """Run a sample of the stored jobs again; 1 if one of them ends differently."""
    from pushplan.evaluation import verify

    with progress_of() as progress:
        found = verify(
            options.directory,
            fraction=options.fraction,
            seed=options.seed,
            workers=options.workers,
            progress=progress,
        )
    same = len(found.checked) - len(found.differing)
    ran = f"{same} of {len(found.checked)} jobs that ran again"
    lines = [f"{ran} came out the same to the byte, times aside; {found.jobs} are stored"]
    if found.left_out:
        lines.append(f"{found.left_out} of these cannot be run again: {found.why}")
    lines += sorted({f"changed since: {one.changed}" for one in found.checked if one.changed})
    value = {**vars(found), "checked": [_compared(one) for one in found.checked]}
    tell(options, value, *lines)
    return _say_differing(found.differing)


def _say_differing(found: Iterable[Reproduction]) -> int:
    """Write a line for each job that came out differently; 1 if there is one, else 0."""
    lines = [
        f"pushplan: job {one.stored.job[:12]}, {one.stored.policy} on {one.stored.scenario} is "
        f"not the same: {one.how}\n"
        for one in found
        if not one.same
    ]
    sys.stderr.writelines(lines)
    return 1 if lines else 0


def _compared(one: Reproduction) -> dict[str, Any]:
    """A comparison as JSON values; rows by the columns of ``results.csv``."""
    rows = {"stored": one.stored.by_column(), "again": one.again.by_column()}
    return {**vars(one), **rows, "job": one.stored.job, "same": one.same}


def salvage_run(options: argparse.Namespace) -> int:
    """Save what a damaged run directory holds."""
    from pushplan.evaluation import salvage

    check_directory(options.out)
    found = salvage(options.directory, options.out)
    from_csv = f"{found.from_csv} of them from results.csv"
    lines = [f"{found.rows} results saved in {options.out}, {from_csv}"]
    if found.without_episode:
        count = len(found.without_episode)
        lines.append(f"{count} without their episode: {found.without_episode[0]} ...")
    tell(options, found, *lines)
    return 0


def export_rows(options: argparse.Namespace) -> int:
    """Write all rows of a run into one file."""
    from pushplan.evaluation import Results

    check_file(options.file, (".csv", ".parquet"))
    say(f"{Results.load(options.directory).export(options.file)} rows in {options.file}")
    return 0
